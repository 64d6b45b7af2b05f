from __future__ import annotations

import stat
from pathlib import Path
from urllib.parse import unquote

import pytest

from meshcone.errors import InputError
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker


def test_what_was_written_is_there_after_a_restart(tmp_path: Path) -> None:
    with EmbeddedBroker(tmp_path) as broker, connect_text(broker.url) as client:
        client.set("mug", "refined")

    with EmbeddedBroker(tmp_path) as broker, connect_text(broker.url) as client:
        assert client.get("mug") == "refined"


def test_a_second_broker_on_the_same_data_is_refused_in_one_line(tmp_path: Path) -> None:
    with EmbeddedBroker(tmp_path), pytest.raises(InputError) as refusal:
        EmbeddedBroker(tmp_path).start()

    assert "is in use by another broker" in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_stopped_broker_frees_its_data_directory(tmp_path: Path) -> None:
    first = EmbeddedBroker(tmp_path)
    first.start()
    first.stop()

    with EmbeddedBroker(tmp_path) as second:
        assert not second.has_ended()


def test_a_data_directory_may_have_a_space_and_a_long_path(tmp_path: Path) -> None:
    data_dir = tmp_path / "my data" / ("d" * 120)

    with EmbeddedBroker(data_dir) as broker, connect_text(broker.url) as client:
        socket = socket_of(broker.url)
        assert client.ping()
        assert len(bytes(socket)) < 108
        assert stat.S_IMODE(socket.parent.stat().st_mode) == 0o700

    assert not socket.parent.exists()


def test_only_its_owner_can_reach_the_socket(broker: EmbeddedBroker) -> None:
    assert stat.S_IMODE(socket_of(broker.url).stat().st_mode) == 0o700


def test_no_write_is_acknowledged_before_it_is_on_disk(broker: EmbeddedBroker) -> None:
    with connect_text(broker.url) as client:
        settings = client.config_get("append*", "maxmemory-policy")

    assert settings["appendonly"] == "yes"
    assert settings["appendfsync"] == "always"
    assert settings["maxmemory-policy"] == "noeviction"


def test_an_unwritable_data_directory_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")

    with pytest.raises(InputError, match="data directory cannot be used"):
        EmbeddedBroker(tmp_path / "file").start()


def socket_of(url: str) -> Path:
    return Path(unquote(url.removeprefix("unix://")))
