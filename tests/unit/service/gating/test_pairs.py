"""Manifests: three ways to list pairs, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from meshcone.errors import InputError
from service.api.request_schemas import LinkedFile
from service.gating.pairs import Pair, read_manifest, shown, single_pair

TOML = """
[[pairs]]
source = "props/barrel.obj"
reference = "masters/barrel.obj"

[[pairs]]
name = "hero"
source = "hero.glb"
reference = "masters/hero.obj"
"""
CSV = (
    "source,reference,name\nprops/barrel.obj,masters/barrel.obj,\nhero.glb,masters/hero.obj,hero\n"
)
ENTRIES = [
    {"source": "props/barrel.obj", "reference": "masters/barrel.obj"},
    {"source": "hero.glb", "reference": "masters/hero.obj", "name": "hero"},
]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("pairs.toml", TOML),
        ("pairs.csv", CSV),
        ("pairs.json", json.dumps(ENTRIES)),
        ("pairs.json", json.dumps({"pairs": ENTRIES})),
    ],
)
def test_paths_are_relative_to_the_manifest(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)

    assert read_manifest(tmp_path / name) == [
        Pair(
            "props/barrel.obj",
            tmp_path / "props" / "barrel.obj",
            tmp_path / "masters" / "barrel.obj",
        ),
        Pair("hero", tmp_path / "hero.glb", tmp_path / "masters" / "hero.obj"),
    ]


def test_a_url_in_a_manifest_is_for_a_service_to_fetch(tmp_path: Path) -> None:
    entry = {
        "source": "https://example.org/mug_LOD2.glb?token=3f9a",
        "reference": "s3://in/mug.ply",
    }
    (tmp_path / "pairs.json").write_text(json.dumps([entry]))

    [pair] = read_manifest(tmp_path / "pairs.json")

    assert pair.name == "https://example.org/mug_LOD2.glb"
    assert pair.source == LinkedFile(url=entry["source"], resources="relative")
    assert pair.reference == LinkedFile(url="s3://in/mug.ply")
    assert pair.level == 2
    assert (pair.files(), shown(pair.source)) == ([], "https://example.org/mug_LOD2.glb")


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("pairs.toml", "", "lists no pairs"),
        ("pairs.toml", "[[pair]]\nsource = 'a'", "unknown key 'pair'; did you mean 'pairs'?"),
        ("pairs.toml", "[[pairs]]\nsource = 'a'", "pair 1: 'reference': field required"),
        ("pairs.toml", "[[pairs]", "is no valid TOML"),
        ("pairs.json", "[1]", "pair 1: expected a source and a reference"),
        ("pairs.json", '[{"source": "a", "reference": 2}]', "pair 1: 'reference'"),
        ("pairs.json", "{", "is no valid JSON"),
        ("pairs.json", "null", "lists no pairs"),
        ("pairs.csv", "source,reference\n", "lists no pairs"),
        ("pairs.csv", "sorce,reference\na,b\n", "unknown key 'sorce'; did you mean 'source'?"),
        ("pairs.csv", "source,reference,source\na,b,c\n", "column 'source' is there twice"),
        ("pairs.json", '[{"source": "a", "source": "b", "reference": "c"}]', "'source' is there"),
        ("pairs.csv", "source,reference\na\n", "pair 1: 'reference'"),
        ("pairs.csv", "source,reference\na,b,c\n", "unknown key 'further columns'"),
        ("pairs.csv", "source,reference\na,b\na,c\n", "2 pairs are called 'a'"),
        ("pairs.csv", "source,reference,lod\na,b,x\n", "expected a level from 1 to 99"),
        ("pairs.csv", "source,reference,lod\na,b,0\n", "expected a level from 1 to 99"),
        ("pairs.toml", "[[pairs]]\nreference = 'a'", "pair 1: 'source' is missing"),
        ("pairs.toml", "[[pairs]]\nreference = 'a'\nlod = []", "'lod' lists 1 to 99 files"),
        (
            "pairs.toml",
            "[[pairs]]\nsource = 'b'\nreference = 'a'\nlod = ['c']",
            "leave 'source' away",
        ),
    ],
)
def test_what_is_no_list_of_pairs_is_refused(
    tmp_path: Path, name: str, text: str, said: str
) -> None:
    (tmp_path / name).write_text(text)

    with pytest.raises(InputError) as refusal:
        read_manifest(tmp_path / name)

    assert said in str(refusal.value)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("pairs.csv", "source,reference,lod\na.glb,r.glb,1\nb.glb,r.glb,2\nc.glb,r.glb,\n"),
        (
            "pairs.toml",
            '[[pairs]]\nreference = "r.glb"\nlod = ["a.glb", "b.glb"]\n'
            '[[pairs]]\nsource = "c.glb"\nreference = "r.glb"\n',
        ),
    ],
)
def test_a_manifest_says_which_level_of_detail_a_source_is(
    tmp_path: Path, name: str, text: str
) -> None:
    (tmp_path / name).write_text(text)

    levels = {pair.name: pair.level for pair in read_manifest(tmp_path / name)}

    assert levels == {"a.glb": 1, "b.glb": 2, "c.glb": None}


def test_a_named_chain_names_its_levels(tmp_path: Path) -> None:
    (tmp_path / "pairs.toml").write_text(
        '[[pairs]]\nname = "rock"\nreference = "r.glb"\nlod = ["far.glb", "farther.glb"]\n'
    )

    names = [pair.name for pair in read_manifest(tmp_path / "pairs.toml")]

    assert names == ["rock_LOD1", "rock_LOD2"]


def test_a_level_can_be_read_off_the_name_of_a_source(tmp_path: Path) -> None:
    (tmp_path / "pairs.csv").write_text("source,reference\na_LOD2.glb,r.glb\n")

    [pair] = read_manifest(tmp_path / "pairs.csv")

    assert pair.level == 2


def test_a_manifest_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "pairs.toml").write_bytes(b"\xff\xfe")

    with pytest.raises(InputError, match="is no valid TOML"):
        read_manifest(tmp_path / "pairs.toml")


def test_a_pair_on_the_command_line_is_called_by_its_path() -> None:
    assert single_pair(Path("props/a.obj"), Path("b.obj")).name == "props/a.obj"


def test_a_pair_knows_its_files(tmp_path: Path) -> None:
    pair = single_pair(tmp_path / "a.obj", tmp_path / "b.obj")

    assert pair.has([tmp_path / "x" / ".." / "b.obj"])
    assert not pair.has([tmp_path / "c.obj"])


def test_reports_name_files_from_where_one_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside, outside = tmp_path / "here" / "props" / "a.obj", tmp_path / "b.obj"
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")

    assert shown(inside) == "props/a.obj"
    assert shown(outside) == outside.as_posix()


def test_the_list_of_vertices_beside_a_source_is_one_of_its_files(tmp_path: Path) -> None:
    pair = single_pair(tmp_path / "a" / "mug.obj", tmp_path / "b" / "mug.obj")
    listed = tmp_path / "a" / "pins.txt"

    assert pair.has([listed], "pins.txt")
    assert not pair.has([listed])
    assert not pair.has([tmp_path / "b" / "pins.txt"], "pins.txt")
