"""A source that is divided, and what verification says of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from meshcone.files import MeshFile
from meshcone.verbs.verify import verify
from tests.shapes import noisy, sphere
from tests.unit.engine.evidence import Evidence


def textured(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    """A texture with a seam, colours, and two materials."""
    lines = [
        f"v {x:.6f} {y:.6f} {z:.6f} {abs(x) / 3:.4f} 0.5 {abs(z) / 3:.4f}" for x, y, z in vertices
    ]
    lines += [f"vt {x / 5 + 0.5:.6f} {y / 5 + 0.5:.6f}" for x, y, _ in vertices]
    lines += [f"vt {y / 7 + 0.5:.6f} {z / 7 + 0.5:.6f}" for _, y, z in vertices]
    for number, corners in enumerate(faces + 1):
        if number % (len(faces) // 2) == 0:
            lines.append(f"usemtl part{number}")
        shift = 0 if number < len(faces) // 2 else len(vertices)
        lines.append("f " + " ".join(f"{corner}/{corner + shift}" for corner in corners))
    return ("\n".join(lines) + "\n").encode()


VERTICES, FACES = sphere(1)
SOURCE = MeshFile("source.obj", textured(noisy(VERTICES, 0.02), FACES))
REFERENCE = MeshFile("reference.obj", textured(*sphere(3)))

FEW: dict[str, Any] = {"samples": 500, "emd_samples": 16, "curvature_samples": 16}
OPTIONS: dict[str, Any] = {"effort": "fast", "quality": FEW, "detail": {"growth": 3}}


def lines(evidence: Evidence) -> dict[str, tuple[bool, str]]:
    """Each check by its name: whether it holds, and its words."""
    stored = MeshFile("certificate.npz", evidence.certificate.to_bytes())
    checks = verify(
        evidence.report, stored, evidence.source, evidence.reference, evidence.refined
    ).checks
    return {check.name: (check.ok, check.words) for check in checks}
