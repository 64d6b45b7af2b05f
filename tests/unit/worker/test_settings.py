from __future__ import annotations

import pytest

from meshcone.errors import InputError
from meshcone.settings import load_settings
from worker.settings import WorkerSettings


def test_a_setting_comes_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MESHCONE_JOB_TIMEOUT", "17")

    assert load_settings(WorkerSettings).job_timeout == 17


def test_a_setting_out_of_range_is_named_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MESHCONE_ATTEMPTS", "9")

    with pytest.raises(InputError, match="environment variable MESHCONE_ATTEMPTS"):
        load_settings(WorkerSettings)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("RESULT_TTL", "300000000000"),
        ("RECORD_TTL", "300000000000"),
        ("HEARTBEAT_TIMEOUT", "inf"),
        ("RECONCILE_INTERVAL", "nan"),
        ("STOP_GRACE", "inf"),
        ("JOB_TIMEOUT", "100000000000000000000"),
    ],
)
def test_a_time_without_end_is_refused(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(f"MESHCONE_{name}", value)

    with pytest.raises(InputError, match=f"MESHCONE_{name}"):
        load_settings(WorkerSettings)


def test_a_missing_broker_is_told_with_the_way_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MESHCONE_REDIS_URL", raising=False)

    with pytest.raises(InputError, match="MESHCONE_REDIS_URL is not set"):
        load_settings(WorkerSettings).required_redis_url()
