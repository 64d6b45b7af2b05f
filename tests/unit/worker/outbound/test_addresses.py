"""Where this machine may connect to."""

from __future__ import annotations

import asyncio
import ipaddress
import socket
import threading

import pytest
from httpcore2 import ConnectError

from meshcone.errors import InputError
from worker.outbound.addresses import PublicBackend, is_public, require_url


@pytest.mark.parametrize(
    ("first", "last"),
    [
        ("0.0.0.0", "0.255.255.255"),  # noqa: S104
        ("10.0.0.0", "10.255.255.255"),
        ("100.64.0.0", "100.127.255.255"),
        ("127.0.0.0", "127.255.255.255"),
        ("169.254.0.0", "169.254.255.255"),
        ("172.16.0.0", "172.31.255.255"),
        ("192.0.0.0", "192.0.0.255"),
        ("192.0.2.0", "192.0.2.255"),
        ("192.31.196.0", "192.31.196.255"),
        ("192.52.193.0", "192.52.193.255"),
        ("192.88.99.0", "192.88.99.255"),
        ("192.168.0.0", "192.168.255.255"),
        ("192.175.48.0", "192.175.48.255"),
        ("198.18.0.0", "198.19.255.255"),
        ("198.51.100.0", "198.51.100.255"),
        ("203.0.113.0", "203.0.113.255"),
        ("224.0.0.0", "255.255.255.255"),  # multicast, reserved, broadcast
        ("::", "::fffe:ffff:ffff"),  # unspecified, loopback, IPv4-compatible
        ("::127.0.0.1", "::127.0.0.1"),
        ("::8.8.8.8", "::8.8.8.8"),
        ("::ffff:10.0.0.1", "::ffff:10.0.0.1"),
        ("::ffff:127.0.0.1", "::ffff:127.0.0.1"),
        ("::ffff:0:8.8.8.8", "::ffff:0:8.8.8.8"),  # IPv4-translated
        ("64:ff9b::7f00:1", "64:ff9b::7f00:1"),  # NAT64 of 127.0.0.1
        ("64:ff9b::a9fe:a9fe", "64:ff9b::a9fe:a9fe"),  # NAT64 of 169.254.169.254
        ("64:ff9b:1::", "64:ff9b:1:ffff:ffff:ffff:ffff:ffff"),  # NAT64 of a network's own
        ("100::", "100::ffff:ffff:ffff:ffff"),  # discard-only
        ("1fff::", "1fff:ffff:ffff:ffff:ffff:ffff:ffff:ffff"),
        ("2001::", "2001:1ff:ffff:ffff:ffff:ffff:ffff:ffff"),  # Teredo, ORCHID, benchmarks
        ("2001:db8::", "2001:db8:ffff:ffff:ffff:ffff:ffff:ffff"),
        ("2002::", "2002:ffff:ffff:ffff:ffff:ffff:ffff:ffff"),  # 6to4
        ("2002:808:808::", "2002:808:808::1"),
        ("2620:4f:8000::", "2620:4f:8000:ffff:ffff:ffff:ffff:ffff"),
        ("3fff::", "3fff:fff:ffff:ffff:ffff:ffff:ffff:ffff"),
        ("4000::", "ffff:ffff:ffff:ffff:ffff:ffff:ffff:ffff"),
        ("5f00::", "5f00:ffff:ffff:ffff:ffff:ffff:ffff:ffff"),  # segment routing
        ("fc00::", "fdff:ffff:ffff:ffff:ffff:ffff:ffff:ffff"),  # unique local
        ("fe80::", "febf:ffff:ffff:ffff:ffff:ffff:ffff:ffff"),  # link-local
        ("fec0::", "feff:ffff:ffff:ffff:ffff:ffff:ffff:ffff"),  # site-local
        ("ff02::1", "ff0e::1"),  # multicast
    ],
)
def test_a_block_of_special_use_is_not_public(first: str, last: str) -> None:
    assert not is_public(ipaddress.ip_address(first))
    assert not is_public(ipaddress.ip_address(last))


@pytest.mark.parametrize(
    "address",
    [
        "1.0.0.0",
        "1.1.1.1",
        "9.255.255.255",
        "11.0.0.0",
        "93.184.215.14",
        "100.63.255.255",
        "100.128.0.0",
        "172.15.255.255",
        "172.32.0.0",
        "192.0.1.0",
        "198.17.255.255",
        "198.20.0.0",
        "223.255.255.255",
        "2001:200::1",
        "2001:db7::1",
        "2001:4860:4860::8888",
        "2003::1",
        "2606:4700::1111",
        "2a00:1450:4001::1",
        "3ffe::1",
        "::ffff:1.1.1.1",
        "64:ff9b::101:101",  # NAT64 of 1.1.1.1
    ],
)
def test_a_public_address_is_known_as_such(address: str) -> None:
    assert is_public(ipaddress.ip_address(address))


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("http://example.org/hook", "begins with https://"),
        ("ftp://example.org/hook", "begins with https://"),
        ("example.org/hook", "begins with https://"),
        ("https:///hook", "begins with https://"),
        ("https://user:word@example.org/", "user or a password"),
        ("https://example.org:port/", "no URL"),
        ("https://[::1/", "no URL"),
        ("https://example.org/#here", "fragment"),
        ("https://example.org/\r\nX: y", "ASCII"),
        ("https://example.org/" + "x" * 2048, "ASCII"),
        ("https://localhost/hook", "not a public one"),
        ("https://localhost./hook", "not a public one"),
        ("https://10.0.0.1/hook", "not a public one"),
        ("https://[::ffff:10.0.0.1]/hook", "not a public one"),
        ("https://[::127.0.0.1]/hook", "not a public one"),
        ("https://[fe80::1%25eth0]/hook", "not a public one"),
        ("https://169.254.169.254/latest", "not a public one"),
    ],
)
def test_a_url_that_could_not_be_connected_to_is_refused_at_once(url: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        require_url(url, "the webhook", private_addresses=False)


def test_a_closed_network_can_be_allowed() -> None:
    url = "http://10.0.0.1:8080/hook?job=1"

    assert require_url(url, "the webhook", private_addresses=True) == url


def test_a_name_server_that_does_not_answer_holds_up_its_own_connection_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answers = threading.Event()

    def look_up(host: str, *_: object, **__: object) -> list[object]:
        if host == "slow.example":
            answers.wait(60)
        return []

    monkeypatch.setattr(socket, "getaddrinfo", look_up)

    async def connect_to_the_slow_one() -> str:
        backend = PublicBackend(private_addresses=False, look_up_seconds=0.05)
        connections = [backend.connect_tcp("slow.example", 443) for _ in range(8)]
        refused = await asyncio.gather(*connections, return_exceptions=True)
        answers_meanwhile = await asyncio.to_thread(lambda: "the store's")
        answers.set()
        assert {type(error) for error in refused} == {ConnectError}
        assert str(refused[0]) == "the server's name was not resolved within 0.05 s"
        return answers_meanwhile

    assert asyncio.run(connect_to_the_slow_one()) == "the store's"
