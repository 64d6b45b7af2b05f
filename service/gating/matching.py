"""Which pairs a command line asks for: those it lists, or finds by the names of files.

A pattern says where the reference of a source is, relative to the source's folder. In it,
``{stem}`` is the source's name without extension and level of detail, ``{name}`` the name
without extension, ``{lod}`` the level and ``{ext}`` the extension: of ``rock_LOD2.glb`` these are
``rock``, ``rock_LOD2``, ``2`` and ``glb``.
"""

from __future__ import annotations

import glob
import os
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

from meshcone.errors import InputError
from meshcone.gates.levels import level_of, split_level
from meshcone.places import is_folder, is_there, may_be_file, real, reason
from meshcone.suggestions import did_you_mean
from meshcone.text import as_text
from service.gating.pairs import Pair, read_manifest, single_pair

_REFINED = {".obj", ".glb", ".gltf", ".ply", ".stl", ".off", ".zip"}
_MEASURED = {".step", ".stp", ".3mf", ".usd", ".usda", ".usdc", ".usdz"}
MESHES = frozenset(_REFINED | _MEASURED)
REFERENCES = MESHES | {".xyz"}
_PLACES = {"stem": "[^/]+", "name": "[^/]+", "lod": "[0-9]+", "ext": "[^/.]+"}


class ReferencePattern:
    """Where the reference of a source is, by the source's name."""

    def __init__(self, text: str) -> None:
        """Read a pattern.

        Raises:
            InputError: it names what does not exist.
        """
        self._text = text
        try:
            parts = list(Formatter().parse(text))
        except ValueError as error:
            raise self._wrong(str(error).lower()) from None
        for _, place, form, conversion in parts:
            if place is None:
                continue
            if place not in _PLACES:
                raise self._wrong(f"unknown '{{{place}}}'{did_you_mean(place, _PLACES)}")
            if form or conversion:
                raise self._wrong(f"'{{{place}}}' stands alone between its braces")
        if not text or "\0" in text:
            raise self._wrong("it names no file")
        self._places = {place for _, place, _, _ in parts}

    def reference_of(self, source: Path, folder: Path | None = None) -> Path:
        """Where the reference of a source is.

        Args:
            source: the file.
            folder: what the pattern is relative to; by default the source's folder.

        Raises:
            InputError: the pattern needs a level of detail, which the source's name has not.
        """
        stem, level = split_level(source.stem)
        if level is None and any(
            place == "lod" for _, place, _, _ in Formatter().parse(self._text)
        ):
            raise InputError(
                f"--reference-pattern '{self._text}' has {{lod}}, but the name has no level of "
                "detail, such as _LOD1, at its end",
                file=str(source),
            )
        name = self._text.format(
            stem=stem, name=source.stem, lod=level, ext=source.suffix.removeprefix(".")
        )
        return (source.parent if folder is None else folder) / name

    def can_name(self, reference: Path) -> bool:
        """Whether some source in the same place would have this reference, relative to a folder."""
        parts = Formatter().parse(self._text)
        words = "".join(
            re.escape(text) + (_PLACES[place] if place else "") for text, place, _, _ in parts
        )
        return re.fullmatch(f"(?:.*/)?{words}", reference.as_posix()) is not None

    def _wrong(self, why: str) -> InputError:
        return InputError(f"--reference-pattern '{self._text}': {why}")


def pairs_to_gate(
    paths: list[Path],
    manifest: Path | None,
    pattern: str | None,
    always: set[Path],
    listed: str | None = None,
) -> list[Pair]:
    """The pairs that a command line asks for.

    Args:
        paths: one or two files, or one or two folders; or, with a manifest, files that
            changed, to keep only the pairs they belong to.
        manifest: a file that lists pairs, or a glob of sources.
        pattern: where the references of a glob or folder are; without one, they have none.
        always: files that concern every pair if they are among ``paths``.
        listed: the file beside each source that the options name.

    Raises:
        InputError: the arguments do not fit each other, or no mesh is found.
    """
    references = None if pattern is None else ReferencePattern(pattern)
    if manifest is None:
        return _given(paths, references)
    if not _is_glob(manifest):
        if references is not None:
            raise InputError(
                "--reference-pattern is for folders and for a glob as --manifest: put the glob "
                "in quotes, or the shell replaces it by what it finds"
            )
        pairs = read_manifest(manifest)
        always = always | {manifest}
    else:
        pairs = pairs_of_glob(manifest, references)
    if not paths or not set(map(real, always)).isdisjoint(map(real, paths)):
        return pairs
    return [pair for pair in pairs if pair.has(paths, listed)]


def _given(paths: list[Path], references: ReferencePattern | None) -> list[Pair]:
    """The pairs of two files, of two folders, or of a folder whose references a pattern names."""
    folders = [is_folder(path) for path in paths]
    if folders == [True, True]:
        return pairs_of_folders(paths[0], paths[1], references)
    if folders == [True]:
        return pairs_of_folder(paths[0], references)
    if any(folders):
        raise InputError("expected two files, two folders, or one of either")
    if references is not None:
        raise InputError("--reference-pattern is for folders and for a glob as --manifest")
    if len(paths) not in (1, 2):  # a source, and a reference
        raise InputError("expected SOURCE and REFERENCE, or --manifest")
    return [single_pair(paths[0], paths[1] if len(paths) > 1 else None)]


def _is_glob(path: Path) -> bool:
    """Whether a path stands for many: it has a wildcard, and no file has that name."""
    return glob.has_magic(str(path)) and not is_there(path)


def pairs_of_glob(pattern: Path, references: ReferencePattern | None) -> list[Pair]:
    """Every file that a glob finds and its reference, if any; ``**`` is any number of folders.

    A file that the pattern calls its own reference is one, and no source.

    Raises:
        InputError: no file is found, or none that has a reference beside itself.
    """
    names = glob.glob(str(pattern), recursive=True)  # noqa: PTH207 - Path's finds hidden ones
    found = sorted(map(Path, names))
    return _paired(str(pattern), [each for each in found if may_be_file(each)], references)


def pairs_of_folder(folder: Path, references: ReferencePattern | None) -> list[Pair]:
    """Every mesh in and below a folder, and its reference, if any.

    Raises:
        InputError: as :func:`pairs_of_glob`.
    """
    return _paired(str(folder), [folder / each for each in _meshes(folder)], references)


def pairs_of_folders(
    sources: Path, references: Path, pattern: ReferencePattern | None = None
) -> list[Pair]:
    """Every mesh of one folder and its reference in another, in the same place below it.

    Without a pattern the two have the same name, or else the same but for the extension, if only
    one file in the folder of references has that. A mesh that only this folder has, of those that
    the pattern can name, makes a pair too, whose source is missing: it has to be noticed.

    Raises:
        InputError: there is no mesh in them.
    """
    own = _meshes(sources)
    others = _meshes(references, REFERENCES)
    if not (own or others):
        raise InputError(f"has no mesh in it: looked for {_suffixes()}", file=str(sources))
    if pattern is not None:
        places = [pattern.reference_of(sources / each, references / each.parent) for each in own]
        named = {real(place) for place in places}
        pairs = [_pair(sources / each, place) for each, place in zip(own, places, strict=True)]
        lost = [each for each in others if pattern.can_name(each)]
        return pairs + [
            _pair(sources / each, references / each)
            for each in lost
            if real(references / each) not in named
        ]
    paired = _counterparts(own, others)
    paired |= {each: each for each in others if each not in paired.values()}
    return [_pair(sources / each, references / paired[each]) for each in sorted(paired)]


def _counterparts(sources: list[Path], references: list[Path]) -> dict[Path, Path]:
    """The reference of each source: of its name, or else of its name but for the extension."""
    same = set(sources) & set(references)
    free: dict[Path, list[Path]] = defaultdict(list)
    for each in references:
        if each not in same:
            free[each.with_suffix("")].append(each)
    found = {}
    for each in sources:
        like = [] if each in same else free[each.with_suffix("")]
        found[each] = like[0] if len(like) == 1 else each
    return found


def _paired(where: str, sources: list[Path], references: ReferencePattern | None) -> list[Pair]:
    if not sources:
        raise InputError("finds no mesh", file=where)
    if references is None:
        return [_pair(source, None) for source in sources]
    found = [(source, references.reference_of(source)) for source in sources]
    pairs = [_pair(*pair) for pair in found if real(pair[0]) != real(pair[1])]
    if not pairs:
        raise InputError("each mesh here is its own reference by the pattern", file=where)
    return pairs


def _pair(source: Path, reference: Path | None) -> Pair:
    return Pair(as_text(source.as_posix()), source, reference, level_of(source.name))


def _meshes(folder: Path, suffixes: frozenset[str] = MESHES) -> list[Path]:
    """All below a folder, relative to it, but for what is hidden."""
    return sorted(_walk(folder, suffixes))


def _walk(folder: Path, suffixes: frozenset[str]) -> Iterator[Path]:
    """What has one of these suffixes; links to folders are followed, each folder once."""
    seen: set[Path] = set()
    waiting = [folder]
    while waiting:
        for place, folders, names in os.walk(waiting.pop(0), onerror=_refuse):
            here = Path(place)
            if real(here) in seen:
                folders.clear()
                continue
            seen.add(real(here))
            folders[:] = sorted(each for each in folders if not each.startswith("."))
            # A folder has its own name before those of links to it.
            waiting += [here / each for each in folders if (here / each).is_symlink()]
            for name in names:
                if not name.startswith(".") and Path(name).suffix.lower() in suffixes:
                    yield (here / name).relative_to(folder)


def _refuse(error: OSError) -> None:
    words = f"a folder whose meshes cannot be listed: {reason(error)}"
    raise InputError(words, file=as_text(str(error.filename)))


def _suffixes() -> str:
    return ", ".join(sorted(MESHES))
