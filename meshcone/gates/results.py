"""What came of holding many assets against their gates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from meshcone.errors import ErrorKind, MeshConeError
from meshcone.gates.records import GateCheck, GateVerdict
from meshcone.notices import WarningRecord

# `error`: there is no verdict, because a file could not be used or the work was not done.
Ending = Literal["pass", "fail", "not_tested", "error"]
_WORST_FIRST: tuple[Ending, ...] = ("error", "fail", "not_tested", "pass")


NO_GATE = "No gate applies to this asset."


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, serialize_by_alias=True)


class AssetError(_Record):
    """Why an asset has no verdict."""

    kind: ErrorKind
    message: str = Field(description="one line, with the file it concerns")

    @staticmethod
    def of(error: MeshConeError) -> AssetError:
        """The public part of an error."""
        return AssetError(kind=error.kind, message=str(error))


class AssetView(_Record):
    """What a page shows of an asset beyond its verdict.

    Attributes:
        report: the whole report, as JSON.
        preview: its meshes, as a GLB file.
        pictures: them in their colours from six sides, as a PNG file.
    """

    report: str
    preview: bytes | None
    pictures: bytes | None = None


JUDGED = {"gates", "warnings", "statement"}
"""The parts of a report that :class:`Judgement` is made of."""


@dataclass(frozen=True)
class Judgement:
    """What a report says of an asset."""

    verdict: GateVerdict
    warnings: tuple[WarningRecord, ...]
    view: AssetView | None = None
    statement: str | None = None

    @staticmethod
    def of(report: dict[str, Any], view: AssetView | None = None) -> Judgement:
        """Take it from a report as JSON, of which the parts ``JUDGED`` are enough."""
        gates = report["gates"]
        verdict = GateVerdict.of(()) if gates is None else GateVerdict.model_validate(gates)
        warnings = tuple(map(WarningRecord.model_validate, report["warnings"]))
        return Judgement(verdict, warnings, view, report.get("statement"))

    def fields(self) -> dict[str, Any]:
        """The same as fields of a result."""
        return {
            "verdict": self.verdict,
            "warnings": self.warnings,
            "view": self.view,
            "statement": self.statement,
        }


class AssetResult(_Record):
    """One asset: a verdict, or an error instead."""

    name: str = Field(description="what globs and reports know it by")
    source: str = Field(description="path, with forward slashes")
    reference: str | None = Field(description="likewise; null where the asset alone was audited")
    lod: int | None = Field(
        None, description="level of detail, 1 for the first below the reference; null if none"
    )
    seconds: float = Field(description="wall-clock time it took")
    verdict: GateVerdict | None = None
    error: AssetError | None = None
    statement: str | None = Field(None, description="what is proven of its deviation")
    warnings: tuple[WarningRecord, ...] = Field((), description="what the report warns of")
    view: AssetView | None = Field(None, exclude=True, description="kept only where asked for")

    @property
    def ending(self) -> Ending:
        """The verdict in a word, or that there is none."""
        return "error" if self.verdict is None else self.verdict.verdict

    @property
    def is_ungated(self) -> bool:
        """Whether there was nothing to hold it against, which is no pass."""
        return self.verdict is not None and not self.verdict.checks

    def checks(self) -> Sequence[GateCheck]:
        """Its checks; empty if there is no verdict."""
        return () if self.verdict is None else self.verdict.checks


class GateRun(_Record):
    """All assets of one run."""

    schema_: Literal["meshcone.gate/2"] = Field("meshcone.gate/2", alias="schema")
    version: str
    label: str | None = Field(None, description="what the run is called")
    verdict: Ending = Field(description="the worst there is: error, fail, not_tested, pass")
    counts: dict[Ending, int] = Field(description="assets by how they ended")
    assets: tuple[AssetResult, ...]

    @staticmethod
    def of(assets: Sequence[AssetResult], label: str | None = None) -> GateRun:
        """Sum up the results; where there are none, nothing fails."""
        counts = Counter(asset.ending for asset in assets)
        return GateRun(
            version=version("meshcone"),
            label=label,
            verdict=next((ending for ending in _WORST_FIRST if counts[ending]), "pass"),
            counts={ending: counts[ending] for ending in _WORST_FIRST},
            assets=tuple(assets),
        )

    def internal_errors(self) -> Iterator[AssetResult]:
        """The assets that a fault of ours left without a verdict."""
        return (each for each in self.assets if each.error and each.error.kind == "internal")
