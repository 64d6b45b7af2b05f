"""Archives whose headers lie are refused before their arrays are read."""

from __future__ import annotations

import io
import re
import tracemalloc
import warnings
import zipfile

import numpy as np
import pytest

from meshcone.certificate.file import read_certificate
from meshcone.errors import InputError

_BEFORE = "before.npy"


def archive(*entries: tuple[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # two entries of one name
        for name, content in entries:
            file.writestr(name, content)
    return buffer.getvalue()


def array(header: str, content: bytes = b"", version: bytes = b"\x01\x00") -> bytes:
    text = header.encode() + b"\n"
    length = len(text).to_bytes(2 if version == b"\x01\x00" else 4, "little")
    return b"\x93NUMPY" + version + length + text + content


def declared(shape: str, kind: str = "<f8", fortran: bool = False) -> str:
    return f"{{'descr': '{kind}', 'fortran_order': {fortran}, 'shape': {shape}, }}"


LYING = {
    "ten trillion rows": array(declared("(10000000000000, 3)")),
    "ten trillion columns by Fortran": array(declared("(3, 10000000000000)", fortran=True)),
    "a product beyond 64 bits": array(declared("(4294967296, 4294967296, 3)")),
    "fewer rows than there are": array(declared("(1, 3)"), bytes(48)),
    "cut short": array(declared("(2, 3)"), bytes(24)),
    "a negative number of rows": array(declared("(-1, -3)"), bytes(24)),
    "objects": array(declared("(1,)", "|O"), bytes(8)),
    "text of a gigabyte": array(declared("()", "<U268435456")),
    "a header of 60 kB": array(declared("(1, 3)") + " " * 60_000, bytes(24)),
    "a header that nests": array("-" * 9000 + "1"),
    "a header that is no Python": array("{'descr': ("),
    "nothing by more than anything": array(declared(f"(0, {10**28})")),
    "a type of nothing": array("{'descr': (), 'fortran_order': False, 'shape': (0,), }"),
    "a type of halves": array("{'descr': [5], 'fortran_order': False, 'shape': (0,), }"),
    "text without a letter": array(declared("(100000000000000,)", "<U0")),
    "more dimensions than there can be": array(declared(f"({100 * '0,'})")),
    "names that are numbers": array("{1: 2, 'descr': '<f8'}"),
    "a header of the second version": array(declared("(1, 3)"), bytes(24), b"\x02\x00"),
    "40 MB of zeros": array(declared("(5000000,)"), bytes(40_000_000)),
}


@pytest.mark.parametrize("lie", LYING)
def test_a_lying_header_is_refused_without_spending_memory(lie: str) -> None:
    data = archive((_BEFORE, LYING[lie]))
    tracemalloc.start()

    with pytest.raises(InputError, match="this is not a MeshCone certificate") as refused:
        read_certificate(data, "certificate.npz")

    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 16 << 20
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("lie", "said"),
    [
        ("ten trillion rows", "the header of 'before.npy' does not match its data"),
        ("objects", "'before.npy' has a type that certificates do not hold: |O"),
        ("a header that nests", "the header of 'before.npy' cannot be read"),
        ("a header of the second version", "the header of 'before.npy' has another version"),
        ("40 MB of zeros", "the archive unpacks to more than any certificate holds"),
    ],
)
def test_a_lying_header_is_told_from_others(lie: str, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"not a MeshCone certificate: {said}")):
        read_certificate(archive((_BEFORE, LYING[lie])), "certificate.npz")


def test_more_arrays_than_any_certificate_has_are_refused() -> None:
    entry = array(declared("(0,)"))

    with pytest.raises(InputError, match="the archive holds 65 arrays, at most 64"):
        read_certificate(archive(*((f"a{number}.npy", entry) for number in range(65))), "c.npz")


def test_two_arrays_of_one_name_are_refused() -> None:
    buffer = io.BytesIO()
    np.save(buffer, np.zeros((1, 3)))
    data = archive((_BEFORE, buffer.getvalue()), (_BEFORE, buffer.getvalue()))

    with pytest.raises(InputError, match="this is not a MeshCone certificate") as refused:
        read_certificate(data, "certificate.npz")

    assert "same name" in str(refused.value.__cause__)


def test_an_array_is_not_there_with_and_without_the_ending_of_its_name() -> None:
    entry = array(declared("(0, 3)"))

    with pytest.raises(InputError, match="two arrays of the same name, 'before'"):
        read_certificate(archive((_BEFORE, entry), ("before", entry)), "certificate.npz")
