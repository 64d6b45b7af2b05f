"""Measure a mesh file against a reference file, moving nothing."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib.metadata import version

from meshcone.files import MeshFile
from meshcone.gates.fitting import require_known
from meshcone.gates.judge import judged
from meshcone.notices import Code
from meshcone.options import Options
from meshcone.pair import read_pair
from meshcone.report.asset_checks import NOT_AUDITED
from meshcone.report.audits import Audited, audited
from meshcone.report.data_checks import appearance_warnings
from meshcone.report.outcome import decide_agreement
from meshcone.report.report import MeasureReport, Timings
from meshcone.report.scoring import Scorer
from meshcone.report.statement import statement
from meshcone.stopwatch import Stopwatch
from meshcone.views.scene import Scene


@dataclass(frozen=True)
class Measurement:
    """The answer to a measurement.

    Attributes:
        report: how the mesh compares with its reference.
        scene: what there is to see of it.
    """

    report: MeasureReport = field(repr=False)
    scene: Scene = field(repr=False)


def measure(source: MeshFile, reference: MeshFile, options: Options) -> MeasureReport:
    """Measure ``source`` against ``reference``.

    Raises:
        InputError, LimitError: a file or a gate cannot be used; the message says which and why.
    """
    return measurement(source, reference, options).report


def measurement(source: MeshFile, reference: MeshFile, options: Options) -> Measurement:
    """Measure ``source`` against ``reference``, and keep what there is to see.

    Raises:
        InputError, LimitError: as :func:`measure`.
    """
    require_known(options.gates, "measure")
    watch = Stopwatch()
    with watch.stage("read"):
        pair = read_pair(source, reference, options)
        pair.require_units(options)
    with watch.stage("align"):
        if options.align != "none":
            pair = pair.aligned(options.align, options.seed)
    with watch.stage("quality"):
        parts = pair.measured_parts(options)
        scorer = Scorer(pair.source, pair.reference, options, pair.collapsed, parts)
        quality = scorer.quality(refined=None, frame=pair.frame)
        appearance = scorer.appearance(*pair.paints)
        proven = scorer.deviation(pair.frame, pair.gates(options), pair.tolerance)
        told = pair.warnings(quality.input.validity, quality.floor.validity)
        told += appearance_warnings(appearance, asked=options.quality.appearance)
    with watch.stage("audit"):
        audits = (
            audited(
                options,
                Audited(source, pair.source_asset, quality.input.validity, pair.alignment),
                Audited(reference, pair.reference_asset, quality.floor.validity),
            )
            if options.audit
            else None
        )
    report = MeasureReport(
        version=version("meshcone"),
        statement=proven and statement(proven.record, pair.unit(options)),
        outcome=decide_agreement(
            quality.input,
            quality.floor,
            is_opposed=told.has(Code.NORMALS_OPPOSED),
        ),
        inputs=pair.inputs(quality.input.validity, quality.floor.validity),
        frame=pair.frame_record(),
        alignment=pair.alignment_record(),
        options=options,
        quality=quality,
        appearance=appearance,
        asset=audits and audits.asset,
        changes=audits and audits.changes,
        deviation=proven and proven.record,
        **(told + (audits.told if audits else NOT_AUDITED)).section(),
        timings=Timings(
            read=watch.seconds["read"],
            align=watch.seconds["align"],
            quality=watch.seconds["quality"],
            audit=watch.seconds["audit"],
            total=watch.total,
            metrics=scorer.seconds,
        ),
    )
    return Measurement(judged(report), scorer.scene(pair.frame))
