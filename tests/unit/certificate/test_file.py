"""The certificate as a file: what is none is refused in one line."""

from __future__ import annotations

import dataclasses
import io
import tracemalloc
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from meshcone.certificate.archive import write_arrays
from meshcone.certificate.file import CertificateFile, most_bytes, read_certificate
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.quality.deviation.leaves import Leaves
from meshcone.verbs.refine import refine
from meshcone.verbs.verify import verify
from tests.unit.engine.pairs import CAPPED, rough, smooth

RECORD = {
    "cut": np.int32,
    "edge": np.int8,
    "at": np.float64,
    "count": np.int8,
    "faces": np.int32,
    "weights": np.int32,
}


@pytest.fixture(scope="module")
def stored() -> bytes:
    certificate = refine(rough(), smooth(), parse_options(CAPPED)).certificate
    assert certificate is not None
    return certificate


def test_a_certificate_is_read_as_it_was_written(stored: bytes) -> None:
    assert read_certificate(stored, "").to_bytes() == stored


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[:0],
        lambda data: data[:4],
        lambda data: data[: len(data) // 2],
        lambda data: data[:60] + bytes(40) + data[100:],
        lambda data: data.replace(b"before.npy", b"behind.npy"),
        lambda data: data.replace(b"which_max", b"where_max"),
    ],
)
def test_what_is_no_certificate_is_refused(stored: bytes, damage: Callable[[bytes], bytes]) -> None:
    damaged = damage(stored)

    with pytest.raises(InputError, match="certificate"):
        read_certificate(damaged, "certificate.npz")


@pytest.mark.parametrize("name", ["before", "positions", "tension"])
def test_arrays_that_do_not_fit_each_other_are_refused(stored: bytes, name: str) -> None:
    certificate = read_certificate(stored, "")
    cut: CertificateFile = dataclasses.replace(
        certificate, **{name: getattr(certificate, name)[1:]}
    )

    with pytest.raises(InputError, match="do not fit"):
        read_certificate(cut.to_bytes(), "certificate.npz")


def repacked(stored: bytes, **changes: Any) -> bytes:
    """The archive with other arrays in it; one that is None is left out."""
    with np.load(io.BytesIO(stored)) as archive:
        arrays = {**archive, **changes}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **{key: kept for key, kept in arrays.items() if kept is not None})
    return buffer.getvalue()


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no document": ({"document": None}, "it has no array 'document'"),
    "a document that is none": ({"document": np.array("Dear diary")}, "cannot be used, at"),
    "no start": ({"before": None}, "it has no array 'before'"),
    "an unknown array": ({"diary": np.zeros(3)}, "an unknown array, 'diary'"),
    "whole numbers for positions": (
        {"positions": np.zeros((66, 3), dtype=np.int64)},
        "'positions' holds no floating-point numbers",
    ),
    "text for positions": ({"positions": np.array(["a"])}, "holds no floating-point numbers"),
    "no cut": ({"extra_cut": None}, "no usable array 'cut'"),
    "no leaves of the reference": (
        {f"missing_{key}": None for key in ("cut", "edge", "at", "count", "faces", "weights")},
        "no usable array 'cut'",
    ),
    "halves of faces": ({"extra_faces": np.array([0.5])}, "numbers that are not whole: 'faces'"),
    "a table of cuts": ({"extra_cut": np.zeros((2, 2), dtype=np.int32)}, "no usable array 'cut'"),
    "text for edges": ({"extra_edge": np.array(["a"])}, "no usable array 'edge'"),
    "a cut at nowhere": (
        {"missing_at": np.array([np.nan])},
        "the array 'missing_at' holds values that are not finite",
    ),
    "edges of 8 bytes": (
        {"extra_edge": np.zeros(1, dtype=np.int64)},
        "an array of another type: 'edge'",
    ),
    "more edges than cuts": (
        {"extra_edge": np.zeros(999, dtype=np.int8)},
        "cuts that are not whole",
    ),
    "more leaves than faces that bound them": (
        {"extra_count": np.zeros(99_999, dtype=np.int8)},
        "a piece has no bound",
    ),
    "fewer leaves than cuts": ({"extra_count": np.zeros(0, dtype=np.int8)}, "a piece has no bound"),
    "faces without weights": (
        {"extra_weights": np.zeros(3, dtype=np.int32)},
        "bounds that are not whole",
    ),
    "leaves of a third surface": ({"other_cut": np.zeros(1)}, "an unknown array, 'other_cut'"),
}


@pytest.mark.parametrize("name", WRONG)
def test_an_array_that_is_wrong_is_named(stored: bytes, name: str) -> None:
    changes, said = WRONG[name]

    with pytest.raises(InputError, match="not a MeshCone certificate: ") as refused:
        read_certificate(repacked(stored, **changes), "certificate.npz")

    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_record_is_not_copied_to_a_larger_type_before_its_lengths_are_compared() -> None:
    edges = np.zeros(8 << 20, dtype=np.int8)
    arrays = {name: np.zeros(1, dtype=kind) for name, kind in RECORD.items()} | {"edge": edges}
    tracemalloc.start()

    with pytest.raises(InputError, match="cuts that are not whole"):
        Leaves.of_arrays(arrays)

    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1 << 20


def test_a_certificate_unpacks_to_no_more_than_its_files_can_need(stored: bytes) -> None:
    needed = sum(entry.file_size for entry in zipfile.ZipFile(io.BytesIO(stored)).infolist())

    assert read_certificate(stored, "", needed).to_bytes() == stored
    with pytest.raises(InputError, match="unpacks to more than any certificate holds"):
        read_certificate(stored, "", needed - 1)


def test_a_large_certificate_of_small_meshes_is_refused_when_it_is_verified(stored: bytes) -> None:
    few = parse_options({**CAPPED, "deviation": {"pieces": 1000}})
    answer = refine(rough(), smooth(), few)
    noise = np.random.default_rng(1).integers(-128, 127, 12 << 20, dtype=np.int8)
    large = MeshFile("c.npz", repacked(stored, extra_edge=noise))

    with pytest.raises(InputError, match="unpacks to more than any certificate holds"):
        verify(answer.report, large, rough(), smooth(), MeshFile(answer.name, answer.data))


def test_honest_certificates_are_far_below_what_their_files_may_need() -> None:
    options = parse_options({**CAPPED, "deviation": {"width": 1e-6, "share": 1e-6}})
    certificate = refine(rough(), smooth(), options).certificate
    assert certificate is not None
    needed = sum(entry.file_size for entry in zipfile.ZipFile(io.BytesIO(certificate)).infolist())
    assert needed < most_bytes(66 + 258, 128 + 512, options) - (8 << 20)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_that_are_not_finite_are_refused(stored: bytes, value: float) -> None:
    certificate = read_certificate(stored, "")
    positions = certificate.positions.copy()
    positions[0, 0] = value

    with pytest.raises(InputError, match="not a MeshCone certificate"):
        read_certificate(dataclasses.replace(certificate, positions=positions).to_bytes(), "c.npz")


def test_an_archive_is_one_that_numpy_reads_and_coordinates_in_it_are_as_they_are() -> None:
    arrays = {
        "positions": np.random.default_rng(0).normal(size=(5000, 3)),
        "which": np.arange(50_000),
        "empty": np.empty((0, 3)),
        "document": np.array("{}"),
    }

    data = write_arrays(arrays)

    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        ways = {entry.filename: entry.compress_type for entry in archive.infolist()}
    assert ways["positions.npy"] == zipfile.ZIP_STORED
    assert ways["which.npy"] == zipfile.ZIP_DEFLATED
    with np.load(io.BytesIO(data)) as read:
        assert {name: read[name].tolist() for name in read} == {
            name: array.tolist() for name, array in arrays.items()
        }
