"""Audit a mesh file by itself, or against a reference file; nothing is moved or measured."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version

from meshcone.appearance.paint import Paint
from meshcone.assets import read_asset
from meshcone.assets.points.asset import points_alone
from meshcone.assets.policy import ReadPolicy
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.fitting import require_known, require_units
from meshcone.gates.judge import judged
from meshcone.notices import COLORS, OF_PAIRS, Told
from meshcone.options import Options
from meshcone.pair import describe, read_pair
from meshcone.quality.validity import inspect
from meshcone.report.audits import Audited, audited
from meshcone.report.data_checks import defects
from meshcone.report.report import AuditInputs, AuditReport, Timings
from meshcone.stopwatch import Stopwatch
from meshcone.surface import Mesh


@dataclass(frozen=True)
class Examination:
    """An audit, and what there is to see of its asset.

    Attributes:
        mesh: of the source, in model units.
        paint: its colours.
    """

    report: AuditReport
    mesh: Mesh
    paint: Paint


def audit(source: MeshFile, reference: MeshFile | None, options: Options) -> AuditReport:
    """Say what ``source`` is as a whole asset, and what changed against ``reference``.

    As :func:`examination`, of which this is the report.
    """
    return examination(source, reference, options).report


def examination(source: MeshFile, reference: MeshFile | None, options: Options) -> Examination:
    """Say what ``source`` is as a whole asset, and what changed against ``reference``.

    Args:
        source: the asset.
        reference: what it should be like, if there is such an asset.
        options: ``gates`` and ``quality.intersection_pairs`` are read.

    Raises:
        InputError, LimitError: a file or a gate cannot be used; the message says which and why.
    """
    require_known(options.gates, "audit")
    if options.keep and reference is None:
        raise InputError("option 'keep' is about a reference, and there is none")
    watch = Stopwatch()
    if reference is None:
        first, told = _alone(source, options, watch)
        second = None
    else:
        first, second, told = _beside(source, reference, options, watch)
    with watch.stage("audit"):
        found = audited(options, first, second)
    report = AuditReport(
        version=version("meshcone"),
        inputs=AuditInputs(
            source=describe(first.file, first.asset, first.validity),
            reference=second and describe(second.file, second.asset, second.validity),
        ),
        options=options,
        asset=found.asset,
        changes=found.changes,
        **(told + found.told).section(),
        timings=Timings(
            read=watch.seconds["read"],
            quality=watch.seconds["quality"],
            audit=watch.seconds["audit"],
            total=watch.total,
        ),
    )
    mesh = Mesh(first.asset.vertices, first.asset.faces)
    return Examination(judged(report), mesh, Paint(first.asset))


def _alone(file: MeshFile, options: Options, watch: Stopwatch) -> tuple[Audited, Told]:
    with watch.stage("read"):
        policy = ReadPolicy.of_source(options)
        asset = read_asset(file.name, file.data, file.resources, policy=policy)
        if asset.is_points:
            raise points_alone(asset.name)
        require_units(options.gates, asset.format, None, scaled=False)
        mesh = Mesh(asset.vertices, asset.faces, precision=asset.precision)
        if not mesh.face_areas.sum() > 0:
            raise InputError("every face is without area", file=asset.name)
    with watch.stage("quality"):
        validity = inspect(mesh, options.quality.intersection_pairs, collapsed=asset.collapsed)
    told = Told([notice.about("source", asset.name) for notice in asset.warnings], OF_PAIRS)
    return Audited(file, asset, validity), told + defects("source", mesh, validity)


def _beside(
    source: MeshFile, reference: MeshFile, options: Options, watch: Stopwatch
) -> tuple[Audited, Audited, Told]:
    with watch.stage("read"):
        pair = read_pair(source, reference, options)
        pair.require_units(options)
    with watch.stage("quality"):
        found, held = (
            inspect(mesh, options.quality.intersection_pairs, collapsed=collapsed)
            for mesh, collapsed in zip((pair.source, pair.reference), pair.collapsed, strict=True)
        )
        told = pair.warnings(found, held) + Told([], COLORS)
    return (
        Audited(source, pair.source_asset, found),
        Audited(reference, pair.reference_asset, held),
        told,
    )
