"""What is unpacked of an answer, and what it costs."""

from __future__ import annotations

import gzip

import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshcone.errors import InputError, LimitError
from worker.transfers.budget import Budget, Share
from worker.transfers.unpacking import MEMBERS, Gzip

EMPTY = gzip.compress(b"", mtime=0)


@given(st.lists(st.binary(min_size=1), min_size=1, max_size=4), st.integers(1, 40))
def test_members_are_unpacked_in_turn_however_they_are_cut(
    contents: list[bytes], length: int
) -> None:
    packed = b"".join(map(gzip.compress, contents))
    unpacker = Gzip()

    pieces = [
        piece
        for start in range(0, len(packed), length)
        for piece in unpacker.unpacked(packed[start : start + length])
    ]
    unpacker.finish()

    assert b"".join(pieces) == b"".join(contents)


def test_an_empty_file_may_be_packed() -> None:
    unpacker = Gzip()

    assert list(unpacker.unpacked(EMPTY)) == []
    unpacker.finish()


@pytest.mark.parametrize("first", [EMPTY, gzip.compress(b"v 0 0 0", mtime=0)])
def test_an_empty_member_after_the_first_is_refused(first: bytes) -> None:
    with pytest.raises(InputError, match="empty member"):
        list(Gzip().unpacked(first + EMPTY))


def test_members_are_bounded_in_number() -> None:
    member = gzip.compress(b"v")

    assert b"".join(Gzip().unpacked(member * MEMBERS)) == b"v" * MEMBERS
    with pytest.raises(InputError, match=f"more than {MEMBERS} members"):
        list(Gzip().unpacked(member * (MEMBERS + 1)))


def test_an_answer_takes_the_larger_of_its_two_sizes() -> None:
    budget = Budget(100)
    share = Share(budget)
    share.receive(10)
    share.unpack(60)
    share.receive(20)
    budget.require(40)
    with pytest.raises(LimitError):
        budget.require(41)

    share.receive(50)  # 80 in all

    budget.require(20)
    with pytest.raises(LimitError):
        budget.require(21)
