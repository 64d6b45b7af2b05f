from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator

from service.api.streams import OpenStreams


async def endless(ended: list[str]) -> AsyncGenerator[bytes]:
    """One part, and then nothing for a long time."""
    try:
        yield b"first"
        await asyncio.sleep(3600)
        yield b"never"
    finally:
        ended.append("source")


async def short() -> AsyncGenerator[bytes]:
    yield b"first"
    yield b"last"


def test_a_source_that_ends_ends_its_stream() -> None:
    async def received() -> list[bytes]:
        return [part async for part in OpenStreams().until_closed(short())]

    assert asyncio.run(received()) == [b"first", b"last"]


def test_closing_ends_a_stream_that_waits_for_something_to_happen() -> None:
    ended: list[str] = []

    async def received() -> list[bytes]:
        streams = OpenStreams()
        parts = []
        async with asyncio.timeout(60):
            async for part in streams.until_closed(endless(ended)):
                parts.append(part)
                streams.close()
        return parts

    assert asyncio.run(received()) == [b"first"]
    assert ended == ["source"]


def test_whoever_stops_listening_ends_the_source() -> None:
    ended: list[str] = []

    async def listen() -> None:
        stream = OpenStreams().until_closed(endless(ended))
        assert await anext(stream) == b"first"
        await stream.aclose()

    asyncio.run(listen())
    assert ended == ["source"]
