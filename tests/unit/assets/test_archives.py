"""Meshes in ZIP archives."""

from __future__ import annotations

import io
import struct
import unicodedata
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshcone.assets import Limits, read_asset
from meshcone.assets.policy import ReadPolicy
from meshcone.errors import InputError, LimitError, MeshConeError
from tests import shapes
from tests.archives import packed, unpacked

BALL = shapes.sphere(1)
GLTF, BINARY = shapes.gltf(*BALL, "data/ball%20one.bin")
FILES = {
    "read me.txt": b"hello",
    "ball/": b"",
    "ball/ball.gltf": GLTF,
    "ball/data/ball one.bin": BINARY,
    "ball/data/größe.png": bytes(range(256)),
}


@dataclass
class Damage:
    """An archive with some bytes changed.

    Attributes:
        message: how it is refused.
        change: what is done to it.
        files: what was in it.
    """

    message: str
    change: Callable[[bytearray], bytes]
    files: dict[str, bytes] = field(default_factory=lambda: {"a.obj": shapes.obj(*BALL)})
    method: int = zipfile.ZIP_DEFLATED


def refused(data: bytes, **limits: int) -> MeshConeError:
    with pytest.raises(MeshConeError) as caught:
        read_asset("pack.zip", data, limits=Limits(**limits))
    assert (caught.value.file or "").startswith("pack.zip")
    return caught.value


def patched(at: int, fmt: str, *values: int) -> Callable[[bytearray], bytes]:
    """Numbers written over a place in the first entry of the directory."""

    def change(data: bytearray) -> bytes:
        struct.pack_into(fmt, data, data.index(b"PK\1\2") + at, *values)
        return bytes(data)

    return change


def test_a_mesh_and_what_it_names_are_read_out_of_an_archive() -> None:
    asset = read_asset("pack.zip", packed(FILES))

    assert (asset.name, asset.format, asset.media_type) == ("pack.zip", "gltf", "application/zip")
    assert np.allclose(asset.vertices[asset.faces].sum(), BALL[0][BALL[1]].sum())
    assert asset.file.data == GLTF
    assert asset.file.resources["data/größe.png"] == FILES["ball/data/größe.png"]


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_only_the_files_that_moved_differ_in_the_archive_that_comes_back(method: int) -> None:
    archive = packed(FILES, method)
    asset = read_asset("pack.zip", archive)

    written = asset.patched(asset.vertices * 1.5)

    before, after = unpacked(archive), unpacked(written)
    assert list(after) == list(before)
    assert {name for name in before if before[name] != after[name]} == {"ball/ball.gltf"}
    assert np.allclose(read_asset("pack.zip", written).vertices, asset.vertices * 1.5)
    with (
        zipfile.ZipFile(io.BytesIO(archive)) as old,
        zipfile.ZipFile(io.BytesIO(written)) as new,
    ):
        assert new.comment == old.comment
        for one, other in zip(old.infolist(), new.infolist(), strict=True):
            for said in ("date_time", "comment", "external_attr", "compress_type", "extra"):
                assert getattr(one, said) == getattr(other, said)


def test_an_archive_in_which_nothing_moved_comes_back_as_it_was() -> None:
    archive = packed(FILES)
    asset = read_asset("pack.zip", archive)

    assert asset.patched(asset.vertices) == archive


def test_what_stays_keeps_even_its_compressed_bytes() -> None:
    slow = io.BytesIO()
    with zipfile.ZipFile(slow, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("a.txt", b"abcabcabd" * 300)
        archive.writestr("a.obj", shapes.obj(*BALL))
        archive.writestr("b.txt", b"defdefdeg" * 300)
    with zipfile.ZipFile(slow) as archive:
        spans = {
            each.filename: (each.header_offset, each.compress_size) for each in archive.infolist()
        }
    asset = read_asset("pack.zip", slow.getvalue())

    written = asset.patched(asset.vertices + 1)

    for name in ("a.txt", "b.txt"):
        start, size = spans[name]
        assert slow.getvalue()[start : start + 30 + len(name) + size] in written


class Unseekable(io.BytesIO):
    """Somewhere to write to and never go back, for which sizes come after the data."""

    def seekable(self) -> bool:
        return False

    def seek(self, *_: int) -> int:
        raise io.UnsupportedOperation


def test_an_archive_that_was_streamed_or_has_64_bit_sizes_is_read_and_written() -> None:
    out = Unseekable()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("a.txt", "a.obj", "b.txt"):
            with archive.open(name, "w", force_zip64=True) as file:
                file.write(shapes.obj(*BALL) if name == "a.obj" else b"text")
    asset = read_asset("pack.zip", out.getvalue())

    written = asset.patched(asset.vertices + 1)

    assert unpacked(written)["b.txt"] == b"text"
    assert np.allclose(read_asset("", unpacked(written)["a.obj"]).vertices, asset.vertices + 1)


@pytest.mark.parametrize("form", ["NFC", "NFD"])
@pytest.mark.parametrize("asked", ["NFC", "NFD"])
def test_names_that_are_not_ascii_are_found_however_they_are_spelled(form: str, asked: str) -> None:
    text, binary = shapes.gltf(*BALL, unicodedata.normalize(asked, "Größe/模型.bin"))
    names = {"Modèle/scène.gltf": text, "Modèle/Größe/模型.bin": binary}
    archive = packed({unicodedata.normalize(form, name): data for name, data in names.items()})

    asset = read_asset("pack.zip", archive)

    assert len(asset.faces) == len(BALL[1])
    after = unpacked(asset.patched(asset.vertices + 1))
    assert list(after) == [unicodedata.normalize(form, name) for name in names]


def test_names_in_utf_8_that_do_not_say_so_are_read_as_such() -> None:
    text, binary = shapes.gltf(*BALL, "größe.bin")
    archive = bytearray(packed({"a.gltf": text, "größe.bin": binary}))
    for mark, flags in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
        at = archive.index(mark, archive.index(mark) + 4) + flags
        assert archive[at + 1] & 8
        archive[at + 1] &= ~8

    assert len(read_asset("pack.zip", bytes(archive)).faces) == len(BALL[1])


def test_backslashes_of_windows_are_folders() -> None:
    text, binary = shapes.gltf(*BALL, "data/a.bin")

    asset = read_asset("pack.zip", packed({"m\\a.gltf": text, "m\\data\\a.bin": binary}))

    assert len(asset.faces) == len(BALL[1])


@pytest.mark.parametrize("uri", ["../data/a%20b.bin", "x/../../data/a b.bin"])
def test_a_file_beyond_the_folder_of_the_mesh_is_found_within_the_archive(uri: str) -> None:
    text, binary = shapes.gltf(*BALL, uri)

    asset = read_asset("pack.zip", packed({"m/a.gltf": text, "data/a b.bin": binary}))

    assert len(asset.faces) == len(BALL[1])
    with pytest.raises(InputError, match="is not the name of a file sent along"):
        read_asset("a.gltf", text, {"data/a b.bin": binary})


@pytest.mark.parametrize("uri", ["../../data/a.bin", "../other.bin"])
def test_no_file_beyond_the_archive_is_looked_for(uri: str) -> None:
    text, binary = shapes.gltf(*BALL, uri)

    with pytest.raises(InputError, match="is not the name of a file sent along"):
        read_asset("pack.zip", packed({"m/a.gltf": text, "data/a.bin": binary}))


@pytest.mark.parametrize(
    "others",
    [
        {"notes.txt": b""},
        {"parts/other.obj": b"", "parts/third.glb": b""},
        {"__MACOSX/._a.obj": b"shadow", ".hidden/b.obj": b""},
    ],
)
def test_the_obvious_mesh_is_taken(others: dict[str, bytes]) -> None:
    asset = read_asset("pack.zip", packed({**others, "a.obj": shapes.obj(*BALL)}))

    assert asset.packed is not None
    assert asset.packed.mesh.name == "a.obj"


def test_one_of_several_meshes_has_to_be_named() -> None:
    small, large = (shapes.obj(*shapes.sphere(levels)) for levels in (0, 1))
    archive = packed({"lod/one.obj": large, "lod/two.obj": small})

    assert "several meshes: 'lod/one.obj', 'lod/two.obj'" in str(refused(archive))
    asset = read_asset("pack.zip", archive, policy=ReadPolicy(member="lod/two.obj"))
    assert len(asset.faces) == 8
    assert unpacked(asset.patched(asset.vertices + 1))["lod/one.obj"] == large


def test_a_name_that_the_archive_lacks_is_refused_with_those_it_has() -> None:
    with pytest.raises(InputError, match=r"has no 'b\.obj'; it has 'a\.obj'"):
        read_asset(
            "pack.zip", packed({"a.obj": shapes.obj(*BALL)}), policy=ReadPolicy(member="b.obj")
        )


@pytest.mark.parametrize(
    "name", ["../a.obj", "b/../../a.obj", "/a.obj", "C:\\a.obj", "b/../a.obj", "./C:a.obj"]
)
def test_a_name_that_leads_out_of_the_archive_is_refused(name: str) -> None:
    archive = packed({name: shapes.obj(*BALL), "good.obj": shapes.obj(*BALL)})

    assert "absolute or leads out of its folder" in str(refused(archive))


def test_an_entry_for_the_folder_itself_is_no_file() -> None:
    archive = packed({"./": b"", "./a.obj": shapes.obj(*BALL)})

    asset = read_asset("pack.zip", archive)

    assert unpacked(asset.patched(asset.vertices + 1)).keys() == {"./", "./a.obj"}


def test_a_colon_in_a_name_is_one_of_the_name() -> None:
    files = {"Final:notes.txt": b"ready", "late: b/Final:a.obj": shapes.obj(*BALL)}

    asset = read_asset("pack.zip", packed(files))
    named = read_asset("pack.zip", packed(files), policy=ReadPolicy(member="late: b/Final:a.obj"))

    assert asset.packed is not None
    assert asset.packed.mesh.name == "late: b/Final:a.obj"
    assert named.counts() == asset.counts()
    assert unpacked(asset.patched(asset.vertices + 1))["Final:notes.txt"] == b"ready"


@pytest.mark.parametrize("name", ["", ".", "b/.."])
def test_a_file_without_a_name_is_refused(name: str) -> None:
    refused(packed({name: b"", "a.obj": shapes.obj(*BALL)}))


def test_a_link_is_refused() -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("a.obj", shapes.obj(*BALL))
        link = zipfile.ZipInfo("b.bin")
        link.external_attr = 0o120777 << 16
        archive.writestr(link, b"/etc/passwd")

    assert "'b.bin' in the archive is a link or a device" in str(refused(out.getvalue()))


def test_an_archive_of_zeros_is_refused_before_it_is_unpacked() -> None:
    bomb = packed({"a.obj": shapes.obj(*BALL), "zeros.bin": bytes(20 * 1024 * 1024)})

    error = refused(bomb)

    assert isinstance(error, LimitError)
    assert "MESHCONE_LIMIT_ARCHIVE_RATIO" in str(error)
    assert "MESHCONE_LIMIT_FILE_BYTES" in str(refused(bomb, file_bytes=10_000_000))


def test_too_many_files_are_refused_before_they_are_looked_at() -> None:
    archive = packed({f"{number}.txt": b"" for number in range(51)})

    assert "51 files in the archive" in str(refused(archive, archive_files=50))


@pytest.mark.parametrize(
    "damage",
    [
        Damage("is encrypted", patched(8, "<H", 1)),
        Damage("compressed by method 12", patched(10, "<H", 12)),
        Damage("has another checksum", patched(16, "<L", 7)),
        Damage("not to 999 as it says", patched(24, "<L", 999)),
        Damage("a file is not where the archive says", patched(42, "<L", 3)),
        Damage("are not where the archive says", patched(20, "<L", 1 << 30)),
        Damage("cut short", lambda data: bytes(data[:-40])),
        Damage("cannot be unpacked", lambda data: bytes(data[:40]) + b"\xff" * 9 + data[49:]),
        Damage(
            "two files are called 'b.obj'",
            lambda data: bytes(data.replace(b"a.obj", b"b.obj")),
            {"a.obj": b"one", "b.obj": b"two"},
        ),
        Damage(
            "share the same bytes",
            patched(20, "<2L", 60, 60),
            {"a.obj": b"the same", "b.obj": b"the same"},
            zipfile.ZIP_STORED,
        ),
        Damage("different names", lambda data: bytes(data.replace(b"a.obj", b"b.obj", 1))),
        Damage("no mesh in it", bytes, {"a.txt": b"words"}),
        Damage("an archive within an archive", bytes, {"a.obj": packed({"b.obj": b"v 0 0 0"})}),
        Damage("more files than the archive says", lambda data: counted(data, -1)),
        Damage("is not where the archive says", lambda data: counted(data, 40)),
        Damage("one of several parts", lambda data: counted(data, 1, at=8)),
    ],
    ids=lambda damage: damage.message,
)
def test_a_damaged_or_hostile_archive_is_refused_in_words(damage: Damage) -> None:
    archive = damage.change(bytearray(packed(damage.files, damage.method)))

    assert damage.message in str(refused(archive))


def counted(data: bytearray, more: int, at: int | None = None) -> bytes:
    end = data.rindex(b"PK\5\6")
    for place in (8, 10) if at is None else (at,):
        count = struct.unpack_from("<H", data, end + place)[0]
        struct.pack_into("<H", data, end + place, count + more)
    return bytes(data)


@given(st.binary(max_size=3), st.integers(0, 10**6))
def test_bytes_changed_at_random_are_refused_in_words_or_read(new: bytes, place: int) -> None:
    data = bytearray(packed({"a/b.obj": shapes.obj(*shapes.sphere(0)), "c.txt": b"hello"}))
    place %= len(data)
    data[place : place + len(new)] = new

    try:
        asset = read_asset("pack.zip", bytes(data))
    except MeshConeError:
        return
    assert len(asset.faces) > 0
    asset.patched(asset.vertices + 1)


def test_an_archive_without_files_is_refused_in_words() -> None:
    assert "mesh" in str(refused(packed({})))
