"""A refinement whose certificate proves a narrow interval."""

from __future__ import annotations

import pytest

from tests.unit.certificate.closeness import FAST
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import rough, smooth


@pytest.fixture(scope="module")
def honest() -> Evidence:
    # So narrow an interval that faces have to be cut.
    return Evidence.of(rough(), smooth(), {**FAST, "deviation": {"width": 1e-6, "share": 1e-6}})
