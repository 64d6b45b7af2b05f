"""What ``meshcone thresholds`` refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from meshcone.errors import InputError
from service.cli.thresholds import command


@pytest.mark.parametrize("given", ["mode=refine", "gates={}", "keep=all", "within=1mm"])
def test_options_that_would_be_ignored_are_refused(tmp_path: Path, given: str) -> None:
    (tmp_path / "mug.obj").touch()

    with pytest.raises(InputError, match=f"option '{given.partition('=')[0]}' says nothing"):
        command([tmp_path], assignments=[given])
