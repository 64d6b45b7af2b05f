"""Files at servers that speak HTTP."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import contextmanager
from http import HTTPStatus
from typing import IO, TYPE_CHECKING, NoReturn
from urllib.parse import quote, urlsplit

import httpcore2

from meshcone.errors import InputError
from meshcone.text import as_line
from worker.outbound.addresses import PublicBackend, RefusedAddressError, require_url
from worker.transfers.budget import Share
from worker.transfers.errors import PassingError
from worker.transfers.places import host_of
from worker.transfers.relative import joined
from worker.transfers.unpacking import unpacker

if TYPE_CHECKING:
    from worker.transfers.budget import Budget

REDIRECTS = 5  # followed at most, one after the other

_PIECE = 256 * 1024  # bytes
_TIMEOUTS = {"connect": 10.0, "read": 30.0, "write": 30.0}  # seconds of silence
_MOVED = frozenset({301, 302, 303, 307, 308})
_PASSING = frozenset({408, 421, 425, 429})  # and all that are the server's own fault
_IN_URLS = "".join(map(chr, range(0x21, 0x7F)))  # as they are sent; the rest is escaped
_ADVICE = {
    401: "name a secret of this installation as 'authorization', or give a presigned URL",
    403: "name a secret of this installation as 'authorization', or give a presigned URL that is "
    "still valid",
    404: "there is nothing there; look at the URL",
    410: "it is gone; look at the URL",
}


class Web:
    """Fetches and puts files; each connection is made to an address that was checked for it.

    Args:
        private_addresses: whether addresses that are not public, and http, are allowed.
    """

    def __init__(self, *, private_addresses: bool) -> None:
        self._private_addresses = private_addresses
        self._pool = httpcore2.AsyncConnectionPool(
            network_backend=PublicBackend(private_addresses=private_addresses),
            max_connections=None,  # how many transfers there are at once is for others to say
            max_keepalive_connections=0,
        )

    async def close(self) -> None:
        """End every connection."""
        await self._pool.aclose()

    async def fetch(self, url: str, into: IO[bytes], budget: Budget, secret: str | None) -> str:
        """Write the content of a URL into a file, and return the URL that had it.

        Redirects are followed a few times, each as if it had been given; none to another origin
        is shown the secret. ``Content-Disposition`` is not heeded.

        Raises:
            InputError: the server, or what it says, cannot be used. A
                :class:`~worker.transfers.errors.PassingError` if that may change by itself.
            LimitError: there is more than the budget has left.
        """
        for _ in range(REDIRECTS + 1):
            following = await self._fetch_once(url, into, budget, secret)
            if following is None:
                return url
            require_url(
                following,
                f"the redirect of {host_of(url)}",
                private_addresses=self._private_addresses,
            )
            if _origin(following) != _origin(url):
                secret = None
            url = following
        raise InputError(f"{host_of(url)} redirects for the {REDIRECTS + 1}th time")

    async def _fetch_once(
        self, url: str, into: IO[bytes], budget: Budget, secret: str | None
    ) -> str | None:
        """Fetch, and return None; or return where a redirect leads."""
        headers = {
            "accept": "*/*",
            "accept-encoding": "identity",
            "user-agent": "meshcone",
            "connection": "close",
            **({} if secret is None else {"authorization": secret}),
        }
        request = self._pool.stream(
            "GET", url, headers=list(headers.items()), extensions={"timeout": _TIMEOUTS}
        )
        with _plainly(url, "did not send the whole file"):
            async with request as answer:
                found = {name.decode().lower(): value for name, value in answer.headers}
                if answer.status in _MOVED:
                    return _target(url, found)
                _require_file(url, answer.status)
                await _receive(answer, found, into, budget)
        return None

    async def put(self, url: str, content: IO[bytes], media_type: str, secret: str | None) -> None:
        """Send a file by ``PUT``, as a presigned URL of an object store takes it.

        A redirect is not followed.

        Raises:
            InputError: the server does not take it. A
                :class:`~worker.transfers.errors.PassingError` if that may change by itself.
        """
        size = content.seek(0, os.SEEK_END)
        content.seek(0)
        headers = {
            "content-type": media_type,
            "content-length": str(size),
            "user-agent": "meshcone",
            "connection": "close",
            **({} if secret is None else {"authorization": secret}),
        }
        request = self._pool.stream(
            "PUT",
            url,
            headers=list(headers.items()),
            content=_pieces(content),
            extensions={"timeout": _TIMEOUTS},
        )
        with _plainly(url, "did not take the whole file"):
            async with request as answer:
                _require_taken(url, answer.status)


@contextmanager
def _plainly(url: str, unfinished: str) -> Iterator[None]:
    try:
        yield
    except RefusedAddressError:
        raise InputError(f"{host_of(url)} has an address that is not a public one") from None
    except httpcore2.TimeoutException:
        raise PassingError(f"{host_of(url)} did not answer in time") from None
    except httpcore2.NetworkError as error:
        raise PassingError(f"{host_of(url)} cannot be reached: {_words(error)}") from None
    except httpcore2.LocalProtocolError:  # its words would quote the header, and the secret in it
        raise InputError(
            f"{host_of(url)} cannot be sent the request: its URL, or the secret to show there, has "
            "a character that HTTP does not allow (MESHCONE_TRANSFER_AUTHORIZATIONS)"
        ) from None
    except httpcore2.ProtocolError as error:
        raise PassingError(f"{host_of(url)} {unfinished}: {_words(error)}") from None


async def _pieces(content: IO[bytes]) -> AsyncIterator[bytes]:
    while piece := content.read(_PIECE):
        yield piece


async def _receive(
    answer: httpcore2.Response, headers: Mapping[str, bytes], into: IO[bytes], budget: Budget
) -> None:
    encoding = headers.get("content-encoding", b"").decode("latin-1").strip().lower()
    content = unpacker(encoding)
    length = headers.get("content-length", b"")
    if encoding in ("", "identity") and length.isdigit():
        budget.require(int(length))  # before any of it is taken
    share = Share(budget)
    async for data in answer.aiter_stream():
        share.receive(len(data))
        for piece in content.unpacked(data):
            share.unpack(len(piece))
            into.write(piece)
            await asyncio.sleep(0)  # a small answer can unpack to much, while others wait
    content.finish()


def _target(url: str, headers: Mapping[str, bytes]) -> str:
    # Blanks and letters with accents are in no URL; servers send them, and browsers escape them.
    place = quote(headers.get("location", b"").strip(), safe=_IN_URLS)
    if not place:
        raise InputError(f"{host_of(url)} redirects to nowhere")
    try:
        target = joined(url, place).partition("#")[0]
        host = urlsplit(target).netloc
    except ValueError:
        raise InputError(f"{host_of(url)} redirects to something that is not a URL") from None
    if "%" in host:
        raise InputError(f"{host_of(url)} redirects to a host whose name is not in ASCII")
    return target


def _require_file(url: str, status: int) -> None:
    if status != HTTPStatus.OK:
        _refuse(f"{host_of(url)} answered {status} where 200 and the file were expected", status)


def _require_taken(url: str, status: int) -> None:
    if not 200 <= status < 300:
        _refuse(f"{host_of(url)} answered {status} to the PUT of a result", status)


def _refuse(said: str, status: int) -> NoReturn:
    if status in _PASSING or status >= HTTPStatus.INTERNAL_SERVER_ERROR:
        raise PassingError(said)
    advice = _ADVICE.get(status)
    raise InputError(said if advice is None else f"{said}: {advice}")


def _origin(url: str) -> tuple[str, str]:
    parts = urlsplit(url)
    return parts.scheme, parts.netloc.lower()


def _words(error: Exception) -> str:
    words = str(error) or type(error).__name__
    return as_line(words, " ")[:200]
