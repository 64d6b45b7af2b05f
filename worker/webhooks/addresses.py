"""Where a webhook may go: public addresses, checked at the moment of connecting.

A name is resolved once, and the connection made to the very address that was checked: a
name that points elsewhere a moment later (DNS rebinding) gains nothing.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Iterable
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import anyio
from httpcore2 import AnyIOBackend, AsyncNetworkBackend, ConnectError

from meshcone.errors import InputError

if TYPE_CHECKING:
    from httpcore2 import SOCKET_OPTION, AsyncNetworkStream

    Address = ipaddress.IPv4Address | ipaddress.IPv6Address

URL_LENGTH = 2048  # characters
_NAT64 = ipaddress.IPv6Network("64:ff9b::/96")  # RFC 6052, section 2.1


class RefusedAddressError(ConnectError):
    """The receiver's name leads to no address that may be connected to."""


def is_public(address: Address) -> bool:
    """Whether an address is of the public internet, and so is any it carries inside."""
    if isinstance(address, ipaddress.IPv6Address):
        inner = [address.ipv4_mapped, address.sixtofour, *(address.teredo or ())]
        if address in _NAT64:
            inner.append(ipaddress.IPv4Address(int(address) & 0xFFFFFFFF))
        if not all(is_public(carried) for carried in inner if carried is not None):
            return False
        if address.ipv4_mapped is not None:
            return True  # older Pythons call every mapped address private
    return address.is_global and not address.is_multicast


def require_webhook_url(url: str, *, private_addresses: bool) -> str:
    """Return a webhook's URL if it could be sent to; its name is resolved only then.

    Raises:
        InputError: it is no URL, or one that will not be connected to.
    """
    try:
        parts = urlsplit(url)
        host, _port = parts.hostname, parts.port
    except ValueError:
        raise InputError("the webhook is no URL") from None
    if len(url) > URL_LENGTH or not url.isascii() or not url.isprintable() or " " in url:
        raise InputError(f"the webhook must be a URL of up to {URL_LENGTH} ASCII characters")
    schemes = ("https", "http") if private_addresses else ("https",)
    if parts.scheme not in schemes or not host:
        raise InputError(f"the webhook must be a URL that begins with {schemes[0]}://")
    if parts.username is not None or parts.password is not None:
        raise InputError(
            "the webhook must not carry a user or a password; its signature proves who sent it"
        )
    if parts.fragment:
        raise InputError("the webhook must not have a fragment")
    if not private_addresses and _is_refused_literal(host):
        raise InputError("the webhook's address is not a public one")
    return url


class PublicBackend(AsyncNetworkBackend):
    """Connects to public addresses only, or to any if so allowed."""

    def __init__(self, *, private_addresses: bool) -> None:
        self._private_addresses = private_addresses
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
        addresses = await _resolved(host, port)
        if not self._private_addresses and not all(map(is_public, addresses)):
            raise RefusedAddressError("the receiver's address is not a public one")
        return await self._backend.connect_tcp(
            str(addresses[0]), port, timeout, local_address, socket_options
        )


async def _resolved(host: str, port: int) -> list[Address]:
    try:
        found = await anyio.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        raise ConnectError("the receiver's name cannot be resolved") from None
    return [ipaddress.ip_address(str(entry[4][0]).partition("%")[0]) for entry in found]


def _is_refused_literal(host: str) -> bool:
    if host == "localhost" or host.endswith(".localhost"):  # RFC 6761, section 6.3
        return True
    try:
        return not is_public(ipaddress.ip_address(host))
    except ValueError:
        return False
