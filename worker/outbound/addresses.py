"""Where this machine may connect to: public addresses, checked at the moment of connecting.

A name is resolved once, and the connection made to the very address that was checked: a
name that points elsewhere a moment later (DNS rebinding) gains nothing.
"""

from __future__ import annotations

import asyncio
import ipaddress
import socket
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from httpcore2 import AnyIOBackend, AsyncNetworkBackend, ConnectError

from meshcone.errors import InputError

if TYPE_CHECKING:
    from httpcore2 import SOCKET_OPTION, AsyncNetworkStream

    Address = ipaddress.IPv4Address | ipaddress.IPv6Address

URL_LENGTH = 2048  # characters
LOOK_UP_SECONDS = 10.0
_LOOK_UPS = 16  # at one time

# What follows is written out, because what Python calls global differs between its versions.
# It is all of IANA's special-purpose address registries, what they call reachable included:
# no server of other people is there. Multicast has a registry of its own.
_SPECIAL_IPV4 = tuple(
    ipaddress.IPv4Network(block)
    for block in (
        "0.0.0.0/8",  # this network
        "10.0.0.0/8",  # private
        "100.64.0.0/10",  # shared by a carrier's customers
        "127.0.0.0/8",  # loopback
        "169.254.0.0/16",  # link-local, and the metadata of cloud machines
        "172.16.0.0/12",  # private
        "192.0.0.0/24",  # protocol assignments
        "192.0.2.0/24",  # documentation
        "192.31.196.0/24",  # AS112
        "192.52.193.0/24",  # AMT
        "192.88.99.0/24",  # relays of 6to4
        "192.168.0.0/16",  # private
        "192.175.48.0/24",  # AS112
        "198.18.0.0/15",  # benchmarks
        "198.51.100.0/24",  # documentation
        "203.0.113.0/24",  # documentation
        "224.0.0.0/4",  # multicast
        "240.0.0.0/4",  # reserved, and broadcast
    )
)
_UNICAST_IPV6 = ipaddress.IPv6Network("2000::/3")  # all that IANA gives out of global addresses
_SPECIAL_IPV6 = tuple(
    ipaddress.IPv6Network(block)
    for block in (
        "2001::/23",  # protocol assignments, Teredo, benchmarks and ORCHID among them
        "2001:db8::/32",  # documentation
        "2002::/16",  # 6to4
        "2620:4f:8000::/48",  # AS112
        "3fff::/20",  # documentation
    )
)
# Other spellings of an IPv4 address, which then decides. A host without IPv4 is given the
# second by its resolver for every server that has no IPv6 (RFC 6147).
_CARRIERS_OF_IPV4 = (
    ipaddress.IPv6Network("::ffff:0:0/96"),  # RFC 4291, section 2.5.5.2
    ipaddress.IPv6Network("64:ff9b::/96"),  # RFC 6052, section 2.1
)


class RefusedAddressError(ConnectError):
    """The server's name leads to no address that may be connected to."""


def is_public(address: Address) -> bool:
    """Whether an address is of the public internet: a global unicast address of no special use."""
    if isinstance(address, ipaddress.IPv6Address):
        if any(address in network for network in _CARRIERS_OF_IPV4):
            return is_public(ipaddress.IPv4Address(int(address) & 0xFFFFFFFF))
        return address in _UNICAST_IPV6 and not any(address in block for block in _SPECIAL_IPV6)
    return not any(address in block for block in _SPECIAL_IPV4)


def require_url(url: str, what: str, *, private_addresses: bool) -> str:
    """Return a URL if it could be connected to; its name is resolved only then.

    Args:
        url: what a stranger has sent.
        what: what to call it in messages, such as "the webhook".
        private_addresses: whether addresses that are not public, and http, are allowed.

    Raises:
        InputError: it is no URL, or one that will not be connected to.
    """
    try:
        parts = urlsplit(url)
        host, _port = parts.hostname, parts.port
    except ValueError:
        raise InputError(f"{what} is no URL") from None
    if len(url) > URL_LENGTH or not url.isascii() or not url.isprintable() or " " in url:
        raise InputError(f"{what} must be a URL of up to {URL_LENGTH} ASCII characters")
    schemes = ("https", "http") if private_addresses else ("https",)
    if parts.scheme not in schemes or not host:
        raise InputError(f"{what} must be a URL that begins with {schemes[0]}://")
    if parts.username is not None or parts.password is not None:
        raise InputError(f"{what} must not carry a user or a password")
    if parts.fragment:
        raise InputError(f"{what} must not have a fragment")
    if not private_addresses and _is_refused_literal(host):
        raise InputError(f"{what} leads to an address that is not a public one")
    return url


class PublicBackend(AsyncNetworkBackend):
    """Connects to public addresses only, or to any if so allowed.

    Names are looked up in threads of their own: those of a name server that does not answer, which
    nothing can end, are not missed by the file store or the broker.
    """

    def __init__(
        self, *, private_addresses: bool, look_up_seconds: float = LOOK_UP_SECONDS
    ) -> None:
        self._private_addresses = private_addresses
        self._look_up_seconds = look_up_seconds
        self._resolver = ThreadPoolExecutor(_LOOK_UPS, thread_name_prefix="resolver")
        self._backend = AnyIOBackend()

    async def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[SOCKET_OPTION] | None = None,
    ) -> AsyncNetworkStream:
        """Resolve a name and connect to the first of its addresses, if all are allowed.

        Raises:
            RefusedAddressError: one of them is not public.
            ConnectError: there is none, or it does not answer.
        """
        addresses = await self._resolved(host, port)
        if not self._private_addresses and not all(map(is_public, addresses)):
            raise RefusedAddressError("the server's address is not a public one")
        return await self._backend.connect_tcp(
            str(addresses[0]), port, timeout, local_address, socket_options
        )

    async def _resolved(self, host: str, port: int) -> list[Address]:
        look_up = partial(socket.getaddrinfo, host, port, type=socket.SOCK_STREAM)
        try:
            async with asyncio.timeout(self._look_up_seconds):
                found = await asyncio.get_running_loop().run_in_executor(self._resolver, look_up)
        except TimeoutError:
            raise ConnectError(
                f"the server's name was not resolved within {self._look_up_seconds:g} s"
            ) from None
        except (OSError, UnicodeError):
            raise ConnectError("the server's name cannot be resolved") from None
        return [ipaddress.ip_address(str(entry[4][0]).partition("%")[0]) for entry in found]


def _is_refused_literal(host: str) -> bool:
    name = host.removesuffix(".")
    if name == "localhost" or name.endswith(".localhost"):  # RFC 6761, section 6.3
        return True
    try:
        return not is_public(ipaddress.ip_address(host))
    except ValueError:
        return False
