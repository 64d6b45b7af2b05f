"""Reports to judge, of meshes made here."""

from __future__ import annotations

import numpy as np

from meshcone.files import MeshFile
from meshcone.gates.judge import judge
from meshcone.gates.records import GateCheck
from meshcone.gates.rules import GateRule
from meshcone.options import QualityOptions, parse_options
from meshcone.report.report import AnyReport, MeasureReport, Report
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine
from tests import shapes

RADIUS = 2.0  # of the reference, in model units
QUICK = QualityOptions(samples=1000, emd_samples=64)
SPIKE = 100  # a vertex


def reference() -> MeshFile:
    """A ball."""
    return MeshFile("ball.obj", shapes.obj(*shapes.sphere(3, RADIUS)))


def spiked(height: float) -> tuple[MeshFile, np.ndarray]:
    """The ball with one vertex pulled out by a length in model units, and where that is."""
    vertices, faces = shapes.sphere(3, RADIUS)
    vertices[SPIKE] *= 1 + height / RADIUS
    return MeshFile("spiked.obj", shapes.obj(vertices, faces)), vertices[SPIKE]


def measured(source: MeshFile, gates: dict[str, object] | None = None) -> MeasureReport:
    """The report of a source, with a verdict of these gates."""
    options = parse_options({"mode": "measure", "gates": gates or {}})
    return measure(source, reference(), options.model_copy(update={"quality": QUICK}))


def refined() -> Report:
    """The report of a rough ball that was refined."""
    vertices, faces = shapes.sphere(2, RADIUS)
    source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))
    options = parse_options({"effort": "fast"}).model_copy(update={"quality": QUICK})
    return refine(source, reference(), options).report


def check(report: AnyReport, key: str, **rule: object) -> GateCheck:
    """What the only bound of a rule says of a report."""
    [only] = judge(report, {key: GateRule.model_validate(rule)}).checks
    return only
