"""The files that a run of gates leaves."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from meshcone.errors import InputError
from meshcone.gates.results import GateRun
from meshcone.outputs import require_folder, require_places, write_together
from meshcone.places import is_folder, real, reason

MOST_PICTURES = 12


@dataclass(frozen=True)
class Outputs:
    """Where to write what; None is left out.

    Attributes:
        pictures: a folder, which is made if it is not there, for pictures of what did not pass.
    """

    json: Path | None = None
    junit: Path | None = None
    sarif: Path | None = None
    html: Path | None = None
    markdown: Path | None = None
    pictures: Path | None = None

    def require(self, inputs: Iterable[Path], pairs: int = 0) -> None:
        """Refuse places that cannot be written, before there is a run.

        Args:
            inputs: what was read or will be.
            pairs: how many there are to judge, each of which may get a picture.

        Raises:
            InputError: as :func:`meshcone.outputs.require_places`.
        """
        places = [self.json, self.junit, self.sarif, self.html, self.markdown]
        if self.pictures is not None:
            require_folder(self.pictures)
            # In a folder that is yet to be made there is nothing that a picture could replace.
            if is_folder(self.pictures):
                places += map(self._picture, range(min(pairs, MOST_PICTURES)))
        require_places(places, inputs)

    @property
    def viewed(self) -> bool:
        """Whether results have to carry what there is to see."""
        return self.html is not None or self.pictures is not None

    def write(self, run: GateRun) -> None:
        """Write all of them, or none.

        Raises:
            InputError: a file or folder cannot be written.
        """
        drawn = dict(self._drawn(run))
        pictures = {self._picture(number): data for number, (_, data) in enumerate(drawn.items())}
        if pictures and self.pictures is not None:
            _make(self.pictures)
        write_together({**dict(self._written(run, list(drawn))), **pictures})

    def _drawn(self, run: GateRun) -> Iterator[tuple[str, bytes]]:
        """Names of assets that did not pass, and their pictures."""
        if self.pictures is None:
            return
        failed = [each for each in run.assets if each.ending != "pass" and each.view is not None]
        for asset in failed[:MOST_PICTURES]:
            if asset.view is not None and asset.view.pictures is not None:
                yield asset.name, asset.view.pictures

    def _picture(self, number: int) -> Path:
        # An asset's name can hold anything; it stands beside the picture where that is shown.
        return (self.pictures or Path()) / f"asset-{number + 1}.png"

    def _written(self, run: GateRun, drawn: list[str]) -> Iterator[tuple[Path, bytes]]:
        from meshcone.gates.formats.junit import to_junit
        from meshcone.gates.formats.markdown import to_markdown
        from meshcone.gates.formats.sarif import to_sarif

        if self.json is not None:
            yield self.json, run.model_dump_json(indent=2).encode() + b"\n"
        if self.junit is not None:
            yield self.junit, to_junit(run)
        if self.sarif is not None:
            yield self.sarif, to_sarif(run)
        if self.html is not None:
            from service.html_report.document import html_of_run

            yield self.html, html_of_run(run)
        if self.markdown is not None:
            yield self.markdown, to_markdown(run, self._places(self.markdown, drawn))

    def _places(self, markdown: Path, drawn: list[str]) -> Mapping[str, str]:
        """Where each asset's picture is, seen from the summary."""
        here = real(markdown).parent
        return {
            name: Path(os.path.relpath(real(self._picture(number)), here)).as_posix()
            for number, name in enumerate(drawn)
        }


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be made: {reason(error)}", file=str(folder)) from None
