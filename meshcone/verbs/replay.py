"""Re-checking a refinement by doing it again: the only check of every round of it.

Needs the solver. The same program on the same files with the same options gives the same
bytes; whatever differs is said.
"""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np

from meshcone.assets import read_asset
from meshcone.assets.policy import ReadPolicy
from meshcone.certificate.checks import Check, Verification
from meshcone.certificate.file import read_certificate
from meshcone.certificate.settings import settings_check
from meshcone.errors import MeshConeError
from meshcone.files import MeshFile
from meshcone.report.reaching import within_record
from meshcone.report.report import InputRecord, Report
from meshcone.surface.arrays import row_lengths
from meshcone.verbs.refine import Refinement, refine
from meshcone.verbs.verify import verify

# How long anything took is not the same twice, and textures need not have been kept.
_PASSING = {
    *("timings", "seconds", "confirm_seconds", "setup_seconds", "solve_seconds", "time"),
    *("resources", "source_resources", "reference_resources"),
}


def verify_by_replay(
    report: Report,
    certificate: MeshFile,
    source: MeshFile,
    reference: MeshFile,
    refined: MeshFile,
) -> Verification:
    """Check as :func:`meshcone.verbs.verify.verify` does, then refine again and compare.

    Where the replay gives the same file, certificate and report, the start of the last round
    is proven and no option is out of range; where it does not, the check ``road`` says what
    differs.

    Args:
        report: the report; see :func:`meshcone.verbs.verify.read_report`.
        certificate: its certificate file.
        source: as it was sent.
        reference: as it was sent.
        refined: as it was returned.

    Raises:
        InputError, LimitError: the certificate, source or reference cannot be read at all.
    """
    found = verify(report, certificate, source, reference, refined)
    road = _road(report, certificate, source, reference, refined)
    if not road.ok:
        return found.with_checks([road])
    return found.with_checks([settings_check(report.options, ranges=False), road])


def _road(
    report: Report, certificate: MeshFile, source: MeshFile, reference: MeshFile, refined: MeshFile
) -> Check:
    installed, inputs, options = version("meshcone"), report.inputs, report.options
    if report.version != installed:
        words = f"made by version {report.version}, which alone can replay it; this is {installed}"
        return Check("road", False, words)
    try:
        again = refine(_named(source, inputs.source), _named(reference, inputs.reference), options)
    except MeshConeError as error:
        return Check("road", False, f"refining again ends with: {error}")
    if again.data != refined.data:
        return Check("road", False, _other_file(again, source, refined))
    if not _same_certificate(again.certificate, certificate.data):
        return Check("road", False, "refining again gives the same file with another certificate")
    found_again = again.report
    if report.within is not None:  # this was one of its attempts; of their number nothing is known
        stated = within_record(found_again, report.within.asked, report.within.attempts)
        found_again = found_again.model_copy(update={"within": stated})
    told, found = (_lasting(made.model_dump(mode="json")) for made in (report, found_again))
    if told != found:
        words = f"the report states another '{_first_difference(told, found)}'"
        return Check("road", False, f"refining again gives the same file, but {words}")
    words = "every round was solved again and gives the same bytes; so does all of the report"
    return Check("road", True, f"{words} but its times")


def _named(file: MeshFile, sent: InputRecord) -> MeshFile:
    """Call a file what it was called then: its name is in the report and in warnings."""
    return replace(file, name=sent.name)


def _same_certificate(again: bytes | None, stored: bytes) -> bool:
    if again is None:
        return False
    one, other = (read_certificate(data, "certificate") for data in (again, stored))
    stated = [_lasting(found.document.model_dump(mode="json")) for found in (one, other)]
    return stated[0] == stated[1] and one.arrays_equal(other)


def _other_file(again: Refinement, source: MeshFile, refined: MeshFile) -> str:
    words = "refining again gives another file"
    policy = ReadPolicy.of_source(again.report.options)
    try:
        here, there = (
            read_asset(source.name, data, source.resources, policy=policy)
            for data in (again.data, refined.data)
        )
    except MeshConeError:
        return words
    if here.positions.shape != there.positions.shape:
        return f"{words}, of another mesh"
    farthest = float(row_lengths(here.positions - there.positions).max(initial=0.0))
    if farthest < 1e-5 * float(np.ptp(there.positions, axis=0).max()):
        words += "; another processor or library may round in another way"
    return f"{words}: a vertex is {farthest:.2g} away from there, in the file's units"


def _lasting(value: Any) -> Any:
    """What two runs have in common."""
    if isinstance(value, dict):
        return {name: _lasting(below) for name, below in value.items() if name not in _PASSING}
    return [_lasting(below) for below in value] if isinstance(value, list) else value


def _first_difference(one: Any, other: Any, path: str = "") -> str:
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for name in one:
            if one[name] != other[name]:
                return _first_difference(one[name], other[name], f"{path}.{name}" if path else name)
    return path
