"""What the tests of closeness share."""

from __future__ import annotations

from typing import Any

from meshcone.certificate.checks import Check
from meshcone.files import MeshFile
from meshcone.verbs.verify import verify
from tests.unit.engine.evidence import Evidence

FAST: dict[str, Any] = {"effort": "fast"}


def check(evidence: Evidence, name: str = "closeness") -> Check:
    stored = MeshFile("certificate.npz", evidence.certificate.to_bytes())
    checks = verify(
        evidence.report, stored, evidence.source, evidence.reference, evidence.refined
    ).checks
    (found,) = (check for check in checks if check.name == name)
    return found
