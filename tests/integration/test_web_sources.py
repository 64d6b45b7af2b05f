"""Files of servers that answer as they should, and of those that do not."""

from __future__ import annotations

import asyncio
import gzip
import io
import zlib
from collections.abc import Callable

import pytest

from meshcone.errors import InputError, LimitError, MeshConeError
from tests.integration.file_server import Answer, FileServer, file_server
from worker.transfers.budget import Budget
from worker.transfers.errors import PassingError
from worker.transfers.web import REDIRECTS, Web

MUG = b"v 0 0 0\n" * 1000


def fetched(
    url: str, most: int = 1_000_000, secret: str | None = None, *, private: bool = True
) -> bytes:
    """What is fetched of a URL."""

    async def fetch() -> bytes:
        web, into = Web(private_addresses=private), io.BytesIO()
        try:
            await web.fetch(url, into, Budget(most), secret)
        finally:
            await web.close()
        return into.getvalue()

    return asyncio.run(fetch())


def refusal(fetch: Callable[[], bytes]) -> MeshConeError:
    with pytest.raises(MeshConeError) as caught:
        fetch()
    return caught.value


def test_a_file_is_fetched_as_it_is(server: FileServer) -> None:
    assert fetched(server.has("/mug.obj", MUG)) == MUG
    assert server.seen[0].headers["accept-encoding"] == "identity"
    assert "authorization" not in server.seen[0].headers


def test_a_body_without_a_length_is_fetched_to_its_end(server: FileServer) -> None:
    assert fetched(server.has("/mug.obj", MUG, length=-1)) == MUG


@pytest.mark.parametrize(
    ("encoding", "packed"),
    [
        ("gzip", gzip.compress(MUG, mtime=0)),
        ("x-gzip", gzip.compress(MUG[:4000], mtime=0) + gzip.compress(MUG[4000:], mtime=0)),
        ("deflate", zlib.compress(MUG)),
        ("identity", MUG),
    ],
)
def test_a_file_that_is_served_packed_is_unpacked(
    server: FileServer, encoding: str, packed: bytes
) -> None:
    url = server.has("/mug.obj", packed, headers={"Content-Encoding": encoding})

    assert fetched(url) == MUG


def test_packed_bytes_that_unpack_to_nothing_count_as_well(server: FileServer) -> None:
    begun = zlib.compressobj(wbits=zlib.MAX_WBITS | 16).flush(zlib.Z_SYNC_FLUSH)
    empty_blocks = b"\0\0\0\xff\xff" * 40_000  # RFC 1951, section 3.2.4
    url = server.has("/mug.obj", begun + empty_blocks, headers={"Content-Encoding": "gzip"})

    assert refusal(lambda: fetched(url, 100_000)).kind == "limit"


def test_a_gzip_bomb_is_stopped_at_the_limit(server: FileServer) -> None:
    bomb = gzip.compress(bytes(50_000_000))  # 50 KB
    url = server.has("/mug.obj", bomb, headers={"Content-Encoding": "gzip"})

    error = refusal(lambda: fetched(url))

    assert isinstance(error, LimitError)
    assert "MESHCONE_FETCH_BYTES" in error.message


@pytest.mark.parametrize(
    ("encoding", "body", "said"),
    [
        ("br", MUG, "packed as 'br'"),
        ("gzip", MUG, "packed (gzip), and is not"),
        ("gzip", gzip.compress(MUG, mtime=0)[:-9], "in the middle"),
    ],
)
def test_what_cannot_be_unpacked_is_said(
    server: FileServer, encoding: str, body: bytes, said: str
) -> None:
    url = server.has("/mug.obj", body, headers={"Content-Encoding": encoding})

    assert said in refusal(lambda: fetched(url)).message


def test_a_file_over_the_limit_is_refused_before_it_comes(server: FileServer) -> None:
    url = server.has("/mug.obj", MUG, length=10_000_000)

    assert isinstance(refusal(lambda: fetched(url)), LimitError)


def test_an_endless_body_is_stopped_at_the_limit(server: FileServer) -> None:
    url = server.has("/mug.obj", MUG, endless=True)

    assert isinstance(refusal(lambda: fetched(url)), LimitError)


def test_a_body_shorter_than_it_claims_to_be_is_tried_again(server: FileServer) -> None:
    url = server.has("/mug.obj", MUG, length=len(MUG) + 1)

    error = refusal(lambda: fetched(url))

    assert isinstance(error, PassingError)
    assert "did not send the whole file" in error.message


@pytest.mark.parametrize("status", [201, 204, 206, 304, 400, 401, 403, 404, 410, 416])
def test_an_answer_without_the_file_is_final_and_names_host_and_status(
    server: FileServer, status: int
) -> None:
    url = server.has("/mug.obj", b"", status=status) + "?signature=3f9a"

    error = refusal(lambda: fetched(url))

    assert not isinstance(error, PassingError)
    assert f"127.0.0.1 answered {status}" in error.message
    assert "3f9a" not in error.message


@pytest.mark.parametrize("status", [408, 429, 500, 502, 503, 504])
def test_an_answer_that_may_pass_is_tried_again(server: FileServer, status: int) -> None:
    url = server.has("/mug.obj", b"", status=status)

    assert isinstance(refusal(lambda: fetched(url)), PassingError)


def test_nobody_there_may_pass() -> None:
    assert isinstance(refusal(lambda: fetched("http://127.0.0.1:9/mug.obj")), PassingError)


@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
def test_a_redirect_is_followed(server: FileServer, status: int) -> None:
    server.has("/new/mug.obj", MUG)
    url = server.has("/mug.obj", b"", status=status, headers={"Location": "new/mug.obj"})

    assert fetched(url) == MUG


@pytest.mark.parametrize(
    ("place", "path"),
    [
        ("/red mug.obj", "/red%20mug.obj"),
        ("/caf\u00c3\u00a9.obj", "/caf%C3%A9.obj"),  # UTF-8, as the server's latin-1 has it
        ("/a%20b.obj?sign=a+b/c=", "/a%20b.obj?sign=a+b/c="),
    ],
)
def test_what_no_url_has_is_escaped_in_a_redirect(
    server: FileServer, place: str, path: str
) -> None:
    server.has(path.partition("?")[0], MUG)
    url = server.has("/mug.obj", b"", status=302, headers={"Location": place})

    assert fetched(url) == MUG
    assert server.seen[-1].path == path


def test_redirects_without_end_are_not_followed(server: FileServer) -> None:
    url = server.has("/mug.obj", b"", status=302, headers={"Location": "/mug.obj"})

    assert "redirects" in refusal(lambda: fetched(url)).message
    assert len(server.seen) == REDIRECTS + 1


@pytest.mark.parametrize(
    "place",
    [
        "ftp://example.org/",
        "file:///etc/passwd",
        "http://u:p@127.0.0.1/",
        "http://[",
        "http://a b/",
        "",
    ],
)
def test_a_redirect_to_what_is_not_fetched_is_refused(server: FileServer, place: str) -> None:
    url = server.has("/mug.obj", b"", status=302, headers={"Location": place})

    error = refusal(lambda: fetched(url))

    assert isinstance(error, InputError)
    assert not isinstance(error, PassingError)


def test_a_secret_is_shown_to_its_own_origin_alone(server: FileServer) -> None:
    with file_server() as other:
        other.has("/mug.obj", MUG)
        server.has("/here.obj", b"", status=302, headers={"Location": f"{other.url}/mug.obj"})
        url = server.has("/mug.obj", b"", status=302, headers={"Location": "/here.obj"})

        assert fetched(url, secret="Bearer word") == MUG  # noqa: S106 - of this test

        assert [each.headers.get("authorization") for each in server.seen] == ["Bearer word"] * 2
        assert "authorization" not in other.seen[0].headers


def test_a_secret_that_cannot_be_sent_is_in_no_message(server: FileServer) -> None:
    url = server.has("/mug.obj", MUG)

    error = refusal(lambda: fetched(url, secret="Bearer word "))  # noqa: S106 - of this test

    assert not isinstance(error, PassingError)
    assert "MESHCONE_TRANSFER_AUTHORIZATIONS" in error.message
    assert "word" not in error.message


@pytest.mark.parametrize(
    "host",
    [
        "localhost",
        "127.1",
        "2130706433",
        "0x7f000001",
        "0177.0.0.1",
        "0",
        "[::1]",
        "[::ffff:127.0.0.1]",
        "[::ffff:7f00:1]",
    ],
)
def test_this_machine_is_not_connected_to_however_it_is_written(
    server: FileServer, host: str
) -> None:
    server.has("/mug.obj", MUG)
    url = server.url.replace("127.0.0.1", host) + "/mug.obj"

    error = refusal(lambda: fetched(url, private=False))

    assert not isinstance(error, PassingError)
    assert "not a public one" in error.message
    assert server.seen == []


def test_a_name_in_the_answer_is_not_heeded(server: FileServer) -> None:
    tricks = {"Content-Disposition": 'attachment; filename="../../etc/passwd"'}

    assert fetched(server.has("/mug.obj", MUG, headers=tricks)) == MUG


def test_a_server_that_hangs_up_at_once_may_pass(server: FileServer) -> None:
    server.answers["/mug.obj"] = Answer(MUG, length=len(MUG) * 2)

    assert isinstance(refusal(lambda: fetched(f"{server.url}/mug.obj")), PassingError)


def test_a_dozen_servers_that_do_not_come_to_an_end_hold_up_no_other(server: FileServer) -> None:
    url, slow = server.has("/mug.obj", MUG), server.has("/slow.obj", b"v", endless=True, pause=0.05)

    async def fetch_beside_the_slow() -> bytes:
        web, into = Web(private_addresses=True), io.BytesIO()
        begun = [
            asyncio.create_task(web.fetch(slow, io.BytesIO(), Budget(1_000_000), None))
            for _ in range(12)
        ]
        async with asyncio.timeout(60):
            while len(server.seen) < len(begun):
                await asyncio.sleep(0.01)
            await web.fetch(url, into, Budget(1_000_000), None)
        for task in begun:
            task.cancel()
        await asyncio.gather(*begun, return_exceptions=True)
        await web.close()
        return into.getvalue()

    assert asyncio.run(fetch_beside_the_slow()) == MUG
