from __future__ import annotations

from service.client.patience import Patience


def test_a_pause_is_never_shorter_than_asked_for() -> None:
    slept: list[float] = []
    patience = Patience(100, sleep=slept.append)

    assert patience.pause({"retry-after": "7"})

    assert 7 <= slept[0] <= 8.75


def test_pauses_grow_where_nothing_is_asked_for() -> None:
    slept: list[float] = []
    patience = Patience(100, sleep=slept.append)

    for _ in range(4):
        assert patience.pause()

    assert slept == sorted(slept)
    assert slept[3] >= 8 * 0.25


def test_it_ends_without_a_last_pause_in_vain() -> None:
    slept: list[float] = []
    patience = Patience(10, sleep=slept.append)

    tries = 0
    while patience.pause({"retry-after": "3"}):
        tries += 1
    assert not patience.pause({"retry-after": "3600"})

    assert 2 <= tries <= 3
    assert sum(slept) <= 10


def test_what_is_no_number_of_seconds_is_not_obeyed() -> None:
    slept: list[float] = []

    assert Patience(100, sleep=slept.append).pause({"retry-after": "Fri, 31 Dec 1999 23:59:59 GMT"})

    assert slept[0] < 1
