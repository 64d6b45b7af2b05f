"""What the functions of the library return."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from meshcone.gates.records import GateCheck, GateVerdict, Status
from meshcone.gates.words import label
from meshcone.library.inputs import LoadedMesh, MeshHolder
from meshcone.local_files import left_behind
from meshcone.outputs import (
    certificate_path,
    certificate_place,
    require_format,
    require_places,
    write_together,
)

if TYPE_CHECKING:
    import os

    import trimesh

    from meshcone.report.report import AuditReport, MeasureReport, Report
    from meshcone.verbs.measure import Measurement
    from meshcone.verbs.refine import Refinement

# Of each mesh in a notebook, whose file keeps every page that was shown.
_SHOWN_FACES = 20_000
_FRAME_HEIGHT = 900  # pixels


@dataclass(frozen=True, repr=False, eq=False)
class Measured:
    """How a mesh compares with its reference.

    Attributes:
        source: the mesh.
        reference: its reference.
        done: what the engine returned.
    """

    source: LoadedMesh
    reference: LoadedMesh
    done: Measurement

    @property
    def report(self) -> MeasureReport:
        """Every metric, with the conventions behind it."""
        return self.done.report

    def __repr__(self) -> str:
        pair = f"{self.source.name} → {self.reference.name}"
        mean = self.report.quality.input.point_to_surface.mean
        return f"<Measured {pair}: {self.report.outcome}, mean deviation {mean:.3g} of the radius>"

    def html(self) -> str:
        """The report as a page that needs no network: what ``--html`` writes."""
        from service.html_report.results import html_of_result

        return html_of_result(self.done.report, self.done.scene).decode()

    def _repr_html_(self) -> str:
        from service.html_report.results import html_of_result

        page = html_of_result(self.done.report, self.done.scene, most_faces=_SHOWN_FACES)
        return _framed(page, repr(self))


@dataclass(frozen=True, repr=False, eq=False)
class Audited:
    """What an asset is as a whole, and what changed in it.

    Attributes:
        source: the asset.
        reference: what it should be like; None if there is no such asset.
        report: everything that was found.
    """

    source: LoadedMesh
    reference: LoadedMesh | None
    report: AuditReport

    def __repr__(self) -> str:
        budget = self.report.asset.source.budget
        changes = self.report.changes
        told = "" if changes is None else f", {len(changes.rows)} changes"
        size = f"{budget.triangles:,} triangles, {budget.materials} materials"
        return f"<Audited {self.source.name}: {size}{told}>"


@dataclass(frozen=True, repr=False, eq=False)
class Refined(MeshHolder):
    """A refined mesh, with its report and certificate.

    Attributes:
        source: the mesh that was refined.
        reference: the mesh it should have been.
        done: what the engine returned.
    """

    source: LoadedMesh
    reference: LoadedMesh
    done: Refinement

    @property
    def name(self) -> str:
        """File name of the refined file."""
        return self.done.name

    @property
    def data(self) -> bytes:
        """The refined file, in the source's format."""
        return self.done.data

    @property
    def report(self) -> Report:
        """What was done and how good the result is."""
        return self.done.report

    @property
    def certificate(self) -> bytes | None:
        """The certificate file; of a kept input, about closeness alone, or None without that."""
        return self.done.certificate

    @cached_property
    def file(self) -> LoadedMesh:
        """The refined file, with the source's resources."""
        source = self.source
        detail = self.report.detail
        # With added faces it has other vertices and faces than those that were given.
        given = source.given if detail is None or not detail.divided else None
        return replace(source, name=self.name, data=self.data, given=given)

    @property
    def mesh(self) -> trimesh.Trimesh:
        """The refined mesh as one ``trimesh.Trimesh``; see :attr:`LoadedMesh.mesh`."""
        return self.file.mesh

    @property
    def scene(self) -> trimesh.Scene:
        """The refined file as a ``trimesh.Scene``, with materials and textures."""
        return self.file.scene

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        report: str | os.PathLike[str] | None = None,
        html: str | os.PathLike[str] | None = None,
    ) -> None:
        """Write the refined file; either all files that are asked for are written or none.

        Buffers, images and material libraries that the file names are not written. Where they do
        not stand beside it as they came with the source, a ``UserWarning`` says which.

        Args:
            path: where to; its name ends as the source's does.
            report: where to write the report, as JSON, with its certificate beside it.
            html: where to write the page of :meth:`html`.

        Raises:
            InputError: a place cannot be written, or is that of an input.
        """
        told = self.write(path, report=report, html=html)
        if told is not None:
            warnings.warn(told, stacklevel=2)

    def write(
        self,
        path: str | os.PathLike[str],
        *,
        report: str | os.PathLike[str] | None = None,
        html: str | os.PathLike[str] | None = None,
    ) -> str | None:
        """Do what :meth:`save` does, and return in place of a warning what there is to tell."""
        out = Path(path)
        report_path = None if report is None else Path(report)
        html_path = None if html is None else Path(html)
        require_saveable(out, report_path, html_path, self.source, self.reference)
        contents = {out: self.data}
        if report_path is not None:
            contents[report_path] = self.report.model_dump_json(indent=2).encode() + b"\n"
            if self.certificate is not None:
                contents[certificate_path(report_path)] = self.certificate
        if html_path is not None:
            report_name = None if report_path is None else report_path.name
            contents[html_path] = self._page(out.name, report_name)
        write_together(contents)
        return left_behind(self.source, self.data, out)

    def __repr__(self) -> str:
        pair = f"{self.source.name} → {self.reference.name}"
        quality = self.report.quality
        means = [found.point_to_surface.mean for found in (quality.input, quality.refined) if found]
        moved = " → ".join(f"{mean:.3g}" for mean in means)
        return f"<Refined {pair}: {self.report.outcome}, mean deviation {moved} of the radius>"

    def html(self) -> str:
        """The report as a page that needs no network: what ``--html`` writes."""
        return self._page(self.name).decode()

    def _page(self, refined: str, report_name: str | None = None) -> bytes:
        from service.html_report.results import html_of_result

        return html_of_result(
            self.done.report, self.done.scene, refined=refined, report_name=report_name
        )

    def _repr_html_(self) -> str:
        from service.html_report.results import html_of_result

        page = html_of_result(
            self.done.report, self.done.scene, refined=self.name, most_faces=_SHOWN_FACES
        )
        return _framed(page, repr(self))


def require_saveable(
    out: Path,
    report: Path | None,
    html: Path | None,
    source: LoadedMesh,
    reference: LoadedMesh,
) -> None:
    """Refuse places that :meth:`Refined.save` could not write.

    Raises:
        InputError: as that does.
    """
    require_places(
        (out, report, certificate_place(report), html),
        source.files() + reference.files(),
    )
    require_format(out, source.name)


@dataclass(frozen=True, repr=False, eq=False)
class Verdict:
    """What the gates say of a mesh; true if it passed.

    Attributes:
        result: what was gated; its report has everything else.
    """

    result: Measured | Refined

    @property
    def report(self) -> MeasureReport | Report:
        """The report that was held against the gates."""
        return self.result.report

    @property
    def passed(self) -> bool:
        """Whether every bound was tested and holds."""
        return self.verdict == "pass"

    @property
    def verdict(self) -> Status:
        """``pass``, ``fail``, or ``not_tested`` where a value or every gate was missing."""
        return self._gates.verdict

    @property
    def checks(self) -> tuple[GateCheck, ...]:
        """A row for each bound: ``key``, ``value``, ``limit``, ``status``, ``words`` and more."""
        return self._gates.checks

    @property
    def _gates(self) -> GateVerdict:
        return self.report.gates or GateVerdict.of(())

    def __bool__(self) -> bool:
        return self.passed

    def __str__(self) -> str:
        lines = [f"{label(each.status, each.severity):<11} {each.words}" for each in self.checks]
        return "\n".join(lines) or "no gate applies to this asset"

    def __repr__(self) -> str:
        name = self.result.source.name
        bad = [each for each in self.checks if each.status != "pass"]
        if not self.checks:
            return f"<Verdict not tested: {name}: no gate applies>"
        shown = {"pass": "ok", "fail": "FAILED", "not_tested": "not tested"}[self.verdict]
        count = f"{len(self.checks) - len(bad)} of {len(self.checks)} checks passed"
        return f"<Verdict {shown}: {name}: {count}{f'; {bad[0].words}' if bad else ''}>"

    def html(self) -> str:
        """The report as a page that needs no network."""
        return self.result.html()

    def _repr_html_(self) -> str:
        return self.result._repr_html_()


def _framed(page: bytes, title: str) -> str:
    # A frame of its own: the page's style and scripts stay apart from the notebook's.
    return (
        f'<iframe srcdoc="{escape(page.decode())}" sandbox="allow-scripts" '
        f'title="{escape(title)}" style="width: 100%; height: {_FRAME_HEIGHT}px; border: 0">'
        "</iframe>"
    )
