"""The verbs as functions: refine, measure, audit, gate, thresholds and verify."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from meshcone.errors import ArgumentError, InputError
from meshcone.gates.files import GateFile, parse_gate_file, parse_gates, profile_gates
from meshcone.gates.levels import level_of
from meshcone.gates.thresholds import PERCENTILE
from meshcone.gates.thresholds import thresholds as proposed_gates
from meshcone.library.arguments import (
    kind_of,
    require_accepted,
    require_processes,
    require_text,
)
from meshcone.library.inputs import LoadedMesh, MeshLike, load_unread
from meshcone.library.keywords import OptionKeywords, options_from, plain
from meshcone.library.results import Audited, Measured, Refined, Verdict
from meshcone.local_files import read_bytes
from meshcone.outputs import certificate_path
from meshcone.processes import processes_allowed
from meshcone.text import as_text
from meshcone.threads import one_thread

if TYPE_CHECKING:
    from meshcone.certificate.checks import Verification
    from meshcone.options import Mode, Options
    from meshcone.progress import ProgressCallback

Gates = Mapping[str, Any] | str | os.PathLike[str]


def refine(
    source: MeshLike,
    reference: MeshLike,
    *,
    gates: Mapping[str, Any] | None = None,
    progress: ProgressCallback | None = None,
    processes: int = 1,
    **options: Unpack[OptionKeywords],
) -> Refined:
    """Move the vertices of ``source`` towards the surface of ``reference``.

    The result is that of ``meshcone refine``, byte for byte.

    Args:
        source: the mesh to refine: a path (``.obj``, ``.glb``, ``.gltf``, ``.ply``, ``.stl``,
            ``.off``, or a ``.zip`` with one), ``(name, bytes)``, a ``trimesh.Trimesh`` or
            ``Scene``, ``(vertices, faces)``, or what :func:`meshcone.load` or another call
            returned.
        reference: the mesh it should have been, likewise; a file may also be STEP, 3MF, USD
            or ``.xyz``.
        gates: bounds on values of the report, as in ``docs/gates.md``; the verdict is in
            ``.report.gates``.
        progress: called between stages and rounds with a ``meshcone.progress.Progress``.
        processes: how many regions of the source to solve at once, where ``surface.regions``
            divides it; the result is the same for any number. Linux; elsewhere it is one.
        **options: those of ``docs/options.md``: ``effort="fast"``, and a mapping for what
            has a dot there: ``surface={"edge_cap": 3}``. ``within="0.5mm"`` is a tolerance to
            reach and to prove; ``.report.within`` says whether it is reached, and where not.
            ``detail={"growth": 4}`` adds faces where ``source`` has too few.

    Returns:
        A result with ``.mesh``, ``.data``, ``.report``, ``.certificate`` and ``.save(path)``.

    Raises:
        meshcone.errors.InputError: a file, an array, an option or a gate cannot be used.
        meshcone.errors.ArgumentError: an argument is nothing that can be a mesh.
        meshcone.errors.LimitError: a mesh is larger than this installation accepts.
        meshcone.errors.InfeasibleError: the constraints contradict each other.
        meshcone.errors.SolveTimeoutError: ``solver={"time_limit": …}`` passed.
    """
    resolved = options_from(options, "refine", gates)
    return refine_loaded(
        load_unread(source, "source"),
        load_unread(reference, "reference"),
        resolved,
        progress,
        processes,
    )


def refine_loaded(
    source: LoadedMesh,
    reference: LoadedMesh,
    options: Options,
    progress: ProgressCallback | None = None,
    processes: int = 1,
) -> Refined:
    """Refine as :func:`refine` does, with what it has made of its arguments."""
    require_processes(processes)
    from meshcone.verbs.within import refine_within  # 2.5 s, not to be paid for a mistyped name

    source = source.with_file(options.cones.pin.vertices_file)
    with one_thread(), processes_allowed(processes):
        return Refined(source, reference, refine_within(source, reference, options, progress))


def measure(
    source: MeshLike,
    reference: MeshLike,
    *,
    gates: Mapping[str, Any] | None = None,
    **options: Unpack[OptionKeywords],
) -> Measured:
    """Measure ``source`` against ``reference``; nothing is moved.

    Args:
        source: a mesh in any form that :func:`refine` takes.
        reference: the mesh it should be, likewise.
        gates: as in :func:`refine`.
        **options: as in :func:`refine`; those of sampling and metrics matter here.

    Returns:
        A result with ``.report``.

    Raises:
        meshcone.errors.InputError: a file, an array, an option or a gate cannot be used.
        meshcone.errors.ArgumentError: an argument is nothing that can be a mesh.
        meshcone.errors.LimitError: a mesh is larger than this installation accepts.
    """
    resolved = options_from(options, "measure", gates)
    return _measured(load_unread(source, "source"), load_unread(reference, "reference"), resolved)


def _measured(source: LoadedMesh, reference: LoadedMesh, options: Options) -> Measured:
    from meshcone.verbs.measure import measurement

    with one_thread():
        return Measured(source, reference, measurement(source, reference, options))


def audit(
    asset: MeshLike,
    reference: MeshLike | None = None,
    *,
    gates: Mapping[str, Any] | None = None,
    **options: Unpack[OptionKeywords],
) -> Audited:
    """Say what ``asset`` is as a whole, and what changed in it against ``reference``.

    Args:
        asset: a mesh in any form that :func:`refine` takes; a path with its materials and
            textures, which are found beside it.
        reference: the asset it should be like, if there is one.
        gates: as in :func:`refine`; they can be about ``asset``, ``changes`` and ``warnings``.
        **options: as in :func:`refine`; ``quality={"intersection_pairs": …}`` matters here.

    Returns:
        A result with ``.report``.

    Raises:
        meshcone.errors.InputError: a file, an array, an option or a gate cannot be used.
        meshcone.errors.ArgumentError: an argument is nothing that can be a mesh.
        meshcone.errors.LimitError: a mesh is larger than this installation accepts.
    """
    resolved = options_from(options, "audit", gates)
    from meshcone.verbs.audit import audit as run

    source = load_unread(asset, "asset")
    held = None if reference is None else load_unread(reference, "reference")
    with one_thread():
        return Audited(source, held, run(source, held, resolved))


def gate(
    source: MeshLike,
    reference: MeshLike,
    *,
    gates: Gates | None = None,
    profile: str | None = None,
    refine: bool = False,
    name: str | None = None,
    **options: Unpack[OptionKeywords],
) -> Verdict:
    """Hold ``source`` against ``reference`` and give a verdict, as ``meshcone gate`` does.

    Args:
        source: a mesh in any form that :func:`refine` takes.
        reference: the mesh it should be, likewise.
        gates: path of a gate file; or its content as a mapping; or only the bounds:
            ``{"point_to_surface.max": {"max": 0.01}}``. It can be left out where ``profile`` or
            ``keep`` says what to hold it against.
        profile: gates for a common use, by its name: ``"web"``, ``"mobile"`` and those that
            ``meshcone gate --help`` lists. ``gates`` replace those of the same name.
        refine: gate what refining ``source`` leads to, not ``source`` itself.
        name: what the classes of a gate file know the asset by; by default, the path or file
            name of ``source``.
        **options: as in :func:`refine`.

    Returns:
        A verdict with ``.passed``, ``.checks`` and ``.report``, which is true if all is well.

    Raises:
        meshcone.errors.InputError: a file, an array, an option or a gate cannot be used.
        meshcone.errors.ArgumentError: an argument is nothing that can be a mesh.
        meshcone.errors.LimitError: a mesh is larger than this installation accepts.
        meshcone.errors.InfeasibleError: ``refine`` is true and the constraints contradict each
            other.
    """
    require_text(name, "name")
    require_text(profile, "profile")
    mode: Mode = "refine" if refine else "measure"
    resolved = options_from(options, mode)
    if resolved.gates:
        raise InputError("'gates' is given twice")
    asset = load_unread(source, "source")
    if name is None:
        name = asset.name if asset.path is None else as_text(asset.path.as_posix())
    chosen = None if profile is None else profile_gates(profile, mode)
    if gates is not None:
        chosen = _gate_file(gates, mode, chosen)
    if chosen is not None:
        table = chosen.for_asset(name, level_of(name))
        resolved = resolved.model_copy(update={"gates": dict(table)})
    elif not resolved.keep:
        raise ArgumentError(
            "'gates', 'profile' and 'keep' are all missing: give one of them, or there is nothing "
            "to check"
        )
    held = load_unread(reference, "reference")
    if refine:
        return Verdict(refine_loaded(asset, held, resolved))
    return Verdict(_measured(asset, held, resolved))


def thresholds(
    accepted: Mapping[str, Measured | Audited], percentile: float = PERCENTILE
) -> dict[str, dict[str, Any]]:
    """Propose gates from what assets that somebody has accepted scored.

    Args:
        accepted: what :func:`measure`, or of assets alone :func:`audit`, returned of each, by name.
        percentile: from 50 to 100; the share of the assets that each bound lets pass.

    Returns:
        Gates as :func:`gate` and :func:`measure` take them.

    Raises:
        meshcone.errors.InputError: there is no asset, or the percentile is out of its range.
    """
    require_accepted(accepted, percentile)
    reports = [(name, result.report) for name, result in accepted.items()]
    return {each.key: {each.side: each.bound} for each in proposed_gates(reports, percentile)}


def _gate_file(gates: Gates, mode: Mode, base: GateFile | None) -> GateFile:
    if isinstance(gates, str | os.PathLike):
        path = Path(gates)
        return parse_gate_file(path.name, read_bytes(path), mode, base)
    if not isinstance(gates, Mapping):
        raise ArgumentError(f"'gates' must be a path or a mapping, found {kind_of(gates)}")
    # No value of a report has such a name.
    is_file = bool(gates.keys() & {"gates", "classes"})
    document = plain(gates if is_file else {"gates": gates})
    return parse_gates(document, mode, base=base)


def verify(
    result: Refined | str | os.PathLike[str],
    *,
    source: MeshLike | None = None,
    reference: MeshLike | None = None,
    refined: MeshLike | None = None,
    certificate: str | os.PathLike[str] | None = None,
    replay: bool = False,
) -> Verification:
    """Check, without a solver, that a refined mesh is the optimum its inputs lead to.

    Args:
        result: what :func:`refine` returned, which has all that is needed; or the path of a
            report, and then the three meshes are needed too.
        source: the mesh that was refined.
        reference: its reference.
        refined: the mesh that came of it.
        certificate: path of the certificate file; by default beside the report.
        replay: refine again, with the solver, and compare what comes out byte for byte: the
            only check of the rounds before the last.

    Returns:
        The checks, ``.ok`` if all hold; it is true then.

    Raises:
        meshcone.errors.InputError: a file cannot be read, or there is no certificate because
            the input was kept as it was and no proof of closeness was asked for.
        meshcone.errors.ArgumentError: a mesh is missing.
    """
    from meshcone.files import MeshFile
    from meshcone.verbs.verify import read_report
    from meshcone.verbs.verify import verify as check

    if replay:
        from meshcone.verbs.replay import verify_by_replay as check

    given = {"source": source, "reference": reference, "refined": refined}
    if isinstance(result, Refined):
        if result.certificate is None:
            raise InputError(
                "the result has no certificate: the input was kept as it was, and no proof of "
                "closeness asked for",
                file=result.name,
            )
        report, stored = result.report, MeshFile("certificate", result.certificate)
        own = {"source": result.source, "reference": result.reference, "refined": result}
        given = {name: own[name] if mesh is None else mesh for name, mesh in given.items()}
    elif isinstance(result, str | os.PathLike):
        path = Path(result)
        report = read_report(read_bytes(path), path.name)
        place = certificate_path(path) if certificate is None else Path(certificate)
        stored = MeshFile(place.name, read_bytes(place))
    else:
        raise ArgumentError(
            f"expected a result of meshcone.refine or the path of a report, found {kind_of(result)}"
        )
    files = [_required(mesh, name) for name, mesh in given.items()]
    files[0] = files[0].with_file(report.options.cones.pin.vertices_file)
    with one_thread():
        return check(report, stored, *files)


def _required(mesh: MeshLike | None, name: str) -> LoadedMesh:
    if mesh is None:
        raise ArgumentError(f"'{name}' is missing: a report on its own does not hold the mesh")
    return load_unread(mesh, name)
