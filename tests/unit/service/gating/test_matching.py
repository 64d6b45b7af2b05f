"""Pairs found by the names of files: globs, folders, levels of detail."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import pytest

from meshcone.errors import InputError
from service.gating.matching import ReferencePattern, pairs_to_gate


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty directory to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def make(*names: str) -> None:
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).touch()


def found(
    *paths: str, manifest: str | None = None, pattern: str | None = None, always: Iterable[str] = ()
) -> list[tuple[str, str | None, int | None]]:
    pairs = pairs_to_gate(
        list(map(Path, paths)),
        None if manifest is None else Path(manifest),
        pattern,
        set(map(Path, always)),
    )
    return [
        (pair.name, None if pair.reference is None else pair.reference.as_posix(), pair.level)
        for pair in pairs
    ]


@pytest.mark.parametrize(
    ("pattern", "reference"),
    [
        ("{stem}_LOD0.glb", "props/rock_LOD0.glb"),
        ("{stem}.{ext}", "props/rock.gltf"),
        ("{name}.obj", "props/rock_LOD2.obj"),
        ("../masters/{stem}/{lod}.obj", "props/../masters/rock/2.obj"),
        ("one for all.obj", "props/one for all.obj"),
        ("{{{stem}}}.obj", "props/{rock}.obj"),
        ("/library/{stem}.obj", "/library/rock.obj"),
    ],
)
def test_a_pattern_names_the_reference_of_a_source(pattern: str, reference: str) -> None:
    source = Path("props/rock_LOD2.gltf")

    assert ReferencePattern(pattern).reference_of(source).as_posix() == reference


@pytest.mark.parametrize(
    ("pattern", "said"),
    [
        ("{stm}.glb", "unknown '{stm}'; did you mean 'stem'?"),
        ("{}.glb", "unknown '{}'"),
        ("{0}.glb", "unknown '{0}'"),
        ("{stem.parent}.glb", "unknown '{stem.parent}'"),
        ("{stem:>9}.glb", "stands alone between its braces"),
        ("{stem!r}.glb", "stands alone between its braces"),
        ("{stem.glb", "'}'"),
        ("stem}.glb", "'}'"),
        ("", "names no file"),
    ],
)
def test_a_pattern_that_means_nothing_is_refused(pattern: str, said: str) -> None:
    with pytest.raises(InputError) as refusal:
        ReferencePattern(pattern)

    assert said in refusal.value.message


def test_a_pattern_with_a_level_refuses_a_name_without_one() -> None:
    with pytest.raises(InputError, match=r"rock\.glb: .* no level of detail"):
        ReferencePattern("{stem}{lod}.glb").reference_of(Path("rock.glb"))


def test_a_glob_finds_the_levels_of_every_chain() -> None:
    make(*(f"assets/{name}_LOD{level}.glb" for name in ("b", "x/a") for level in (0, 1, 2)))
    make("assets/c.glb", "elsewhere/d_LOD1.glb")

    assert found(manifest="assets/**/*_LOD[1-9].glb", pattern="{stem}_LOD0.glb") == [
        ("assets/b_LOD1.glb", "assets/b_LOD0.glb", 1),
        ("assets/b_LOD2.glb", "assets/b_LOD0.glb", 2),
        ("assets/x/a_LOD1.glb", "assets/x/a_LOD0.glb", 1),
        ("assets/x/a_LOD2.glb", "assets/x/a_LOD0.glb", 2),
    ]


def test_a_file_that_is_its_own_reference_is_no_source() -> None:
    make("a_LOD0.glb", "a_LOD1.glb", "b_LOD0.glb")

    assert found(manifest="*.glb", pattern="{stem}_LOD0.glb") == [
        ("a_LOD1.glb", "a_LOD0.glb", 1),
    ]


def test_a_source_whose_reference_is_missing_is_a_pair_all_the_same() -> None:
    make("a_LOD1.glb")

    assert found(manifest="*.glb", pattern="{stem}_LOD0.glb") == [("a_LOD1.glb", "a_LOD0.glb", 1)]


def test_a_folder_is_searched_where_a_pattern_names_the_references() -> None:
    make("a_LOD0.obj", "a_LOD1.obj", "x/b_LOD0.obj", "x/b_LOD1.obj", "x/notes.txt")

    assert found(".", pattern="{stem}_LOD0.{ext}") == [
        ("a_LOD1.obj", "a_LOD0.obj", 1),
        ("x/b_LOD1.obj", "x/b_LOD0.obj", 1),
    ]


def test_two_folders_pair_what_is_called_the_same() -> None:
    make("new/a.obj", "new/x/b.GLB", "new/x/b.bin", "new/.cache/c.obj")
    make("old/a.obj", "old/x/b.GLB")

    assert found("new", "old") == [
        ("new/a.obj", "old/a.obj", None),
        ("new/x/b.GLB", "old/x/b.GLB", None),
    ]


def test_what_only_the_second_folder_has_is_noticed() -> None:
    make("new/a.obj", "old/a.obj", "old/lost.obj")

    assert ("new/lost.obj", "old/lost.obj", None) in found("new", "old")


def test_a_reference_may_differ_in_its_extension_if_it_is_the_only_one() -> None:
    make("scans/bolt.ply", "drawings/bolt.step", "scans/nut.obj", "drawings/nut.stl")
    make("drawings/nut.xyz", "drawings/pin.usdz")

    assert found("scans", "drawings") == [
        ("scans/bolt.ply", "drawings/bolt.step", None),
        ("scans/nut.obj", "drawings/nut.obj", None),
        ("scans/nut.stl", "drawings/nut.stl", None),
        ("scans/nut.xyz", "drawings/nut.xyz", None),
        ("scans/pin.usdz", "drawings/pin.usdz", None),
    ]


def test_a_reference_of_the_same_name_comes_before_one_of_another_extension() -> None:
    make("scans/bolt.ply", "scans/bolt.obj", "drawings/bolt.obj", "drawings/bolt.3mf")

    assert found("scans", "drawings") == [
        ("scans/bolt.obj", "drawings/bolt.obj", None),
        ("scans/bolt.ply", "drawings/bolt.3mf", None),
    ]


def test_archives_and_design_files_are_sources_and_points_are_not() -> None:
    make("parts/a.zip", "parts/b.step", "parts/c.3mf", "parts/d.usd", "parts/e.xyz", "parts/f.txt")

    assert [name for name, *_ in found("parts")] == [
        "parts/a.zip",
        "parts/b.step",
        "parts/c.3mf",
        "parts/d.usd",
    ]


def test_two_folders_can_differ_by_a_pattern() -> None:
    make("new/x/a_LOD1.glb", "old/x/a.obj", "old/x/a.glb")

    assert found("new", "old", pattern="{stem}.obj") == [("new/x/a_LOD1.glb", "old/x/a.obj", 1)]


def test_what_only_the_second_folder_has_by_a_pattern_is_noticed() -> None:
    make("new/x/a_LOD1.glb", "old/x/a.obj", "old/x/lost.obj", "old/x/other.glb")

    assert found("new", "old", pattern="{stem}.obj") == [
        ("new/x/a_LOD1.glb", "old/x/a.obj", 1),
        ("new/x/lost.obj", "old/x/lost.obj", None),
    ]


def test_links_to_folders_are_followed_and_each_folder_once() -> None:
    make("x/a.obj", "x/z/c.obj", "elsewhere/b.obj")
    Path("x/link").symlink_to(Path("elsewhere").absolute())
    Path("x/again").symlink_to(Path("x/z").absolute())
    Path("x/z/up").symlink_to(Path("x").absolute())

    assert [name for name, *_ in found("x")] == ["x/a.obj", "x/link/b.obj", "x/z/c.obj"]


def test_a_folder_that_cannot_be_looked_into_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    make("x/a.obj", "x/locked/b.obj")
    scan = os.scandir

    def locked(place: str) -> object:
        if Path(place).name == "locked":
            raise PermissionError(13, "Permission denied", place)
        return scan(place)

    monkeypatch.setattr("os.scandir", locked)

    with pytest.raises(InputError, match=r"x/locked: .* cannot be listed: permission denied"):
        found("x")


def test_assets_can_be_without_references() -> None:
    make("x/a.obj", "x/y/b.glb")

    alone = [("x/a.obj", None, None)]
    assert found("x/a.obj") == alone
    assert found(manifest="x/*.obj") == alone
    assert found("x") == [*alone, ("x/y/b.glb", None, None)]


def test_changed_files_choose_among_what_a_glob_finds() -> None:
    make("a_LOD0.glb", "a_LOD1.glb", "b_LOD0.glb", "b_LOD1.glb", "gates.toml")

    def by(changed: str) -> int:
        pairs = found(
            changed, manifest="*_LOD[1-9].glb", pattern="{stem}_LOD0.glb", always={"gates.toml"}
        )
        return len(pairs)

    assert (by("b_LOD0.glb"), by("gates.toml"), by("c.glb")) == (1, 2, 0)


def test_a_file_whose_name_looks_like_a_glob_is_a_manifest() -> None:
    Path("pairs[1].csv").write_text("source,reference\na.obj,b.obj\n")

    assert found(manifest="pairs[1].csv") == [("a.obj", "b.obj", None)]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"paths": ["a", "f.obj"]}, "expected two files, two folders, or one of either"),
        ({"paths": ["a", "a", "a"]}, "expected two files, two folders, or one of either"),
        ({"paths": ["empty", "empty"]}, "has no mesh in it"),
        ({"paths": ["empty"], "pattern": "{stem}"}, "finds no mesh"),
        ({"paths": ["f.obj", "g.obj"], "pattern": "{stem}"}, "is for folders and for a glob"),
        ({"paths": []}, "expected SOURCE and REFERENCE"),
        ({"paths": ["f.obj", "g.obj", "h.obj"]}, "expected SOURCE and REFERENCE"),
        ({"manifest": "*.glb", "pattern": "{stem}"}, "finds no mesh"),
        ({"manifest": "*.obj", "pattern": "{name}.obj"}, "its own reference"),
        ({"manifest": "f.obj", "pattern": "{stem}_LOD0.obj"}, "put the glob in quotes"),
    ],
)
def test_arguments_that_do_not_fit_each_other_are_refused(
    arguments: dict[str, object], said: str
) -> None:
    make("f.obj", "a/b.obj")
    Path("empty").mkdir()
    paths = arguments.pop("paths", [])
    assert isinstance(paths, list)

    with pytest.raises(InputError) as refusal:
        found(*paths, **arguments)  # type: ignore[arg-type] # from the table above

    assert said in str(refusal.value)
