"""The certificate as a file: what is none is refused in one line."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import pytest

from meshcone.certificate.file import CertificateFile, read_certificate
from meshcone.errors import InputError
from meshcone.options import parse_options
from meshcone.verbs.refine import refine
from tests.unit.engine.pairs import CAPPED, rough, smooth


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


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_that_are_not_finite_are_refused(stored: bytes, value: float) -> None:
    certificate = read_certificate(stored, "")
    positions = certificate.positions.copy()
    positions[0, 0] = value

    with pytest.raises(InputError, match="not a MeshCone certificate"):
        read_certificate(dataclasses.replace(certificate, positions=positions).to_bytes(), "c.npz")
