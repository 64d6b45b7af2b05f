"""Rows of the table and the stream that tells of them, made by a test: it says when what comes."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from playwright.sync_api import Page, Request, Route

_STREAMS = """(() => {
    const fetched = window.fetch;
    window.streams = [];
    window.fetch = (path, options) => {
        if (!String(path).startsWith("/dashboard/events")) return fetched(path, options);
        const stream = new ReadableStream({ start: (each) => window.streams.push(each) });
        return Promise.resolve(new Response(stream));
    };
})()"""
_TELL = """([stream, change]) => window.streams.at(stream).enqueue(
    new TextEncoder().encode(`event: jobs\\ndata: ${JSON.stringify(change)}\\n\\n`))"""
_COMING = 60.0  # seconds after which a request comes no more
_PARTS = ("all", "fail", "failed", "not_tested", "pass", "running", "queued", "canceled")


def job(number: int, state: str = "succeeded", **other: object) -> dict[str, Any]:
    """A job as the table tells of it, by a number that is its id, too."""
    return {
        "id": f"j{number}",
        "state": state,
        "labels": [],
        "project": "default",
        "created": "2026-01-01T00:00:00Z",
        "mode": "audit",
        "progress": None,
        "verdict": "pass" if state == "succeeded" else None,
        "expired": None,
        "batch": None,
        "name": None,
        "source": {"name": f"mesh {number}.obj"},
        "reference": None,
        "error": None,
        "links": {"thumbnail": None},
        "summary": None,
    } | other


def running(number: int, fraction: float) -> dict[str, Any]:
    """A job on its way."""
    progress = {"stage": "solve", "fraction": fraction, "round": 1, "rounds": 2}
    return job(number, "running", progress=progress)


def batch(ended: int) -> dict[str, Any]:
    """A batch of ten pairs, some of which have ended."""
    counts = {"queued": 10 - ended, "running": 0, "succeeded": ended, "failed": 0, "canceled": 0}
    links = {"self": "/v1/batches/b1", "cancel": "/v1/batches/b1/cancel"}
    return {
        "id": "b1",
        "name": "nightly",
        "pairs": 10,
        "state": "running",
        "counts": counts,
        "verdicts": {"pass": ended, "fail": 0, "not_tested": 0},
        "verdict": None,
        "labels": [],
        "project": "default",
        "created": "2026-01-01T00:00:00Z",
        "cancel_requested": None,
        "links": links | dict.fromkeys(("result", "junit", "sarif", "markdown"), "/none"),
    }


class MadeFeed:
    """In place of the stream of events of a page that is opened after it is made."""

    def __init__(self, page: Page) -> None:
        self._page = page
        page.add_init_script(_STREAMS)

    def tell(
        self,
        changed: Iterable[dict[str, Any]],
        order: Iterable[str] | None = None,
        *,
        more: str | None = None,
        stream: int = -1,
    ) -> None:
        """Tell of rows that have changed, and of the order of the first; by default theirs."""
        rows = list(changed)
        change = {
            "order": [row["id"] for row in rows] if order is None else list(order),
            "changed": rows,
            "more": more,
            "counts": dict.fromkeys(_PARTS, 0),
        }
        self._page.wait_for_function("stream => window.streams.at(stream)", arg=stream)
        self._page.evaluate(_TELL, [stream, change])


@dataclass
class Held:
    """Requests that are answered when a test says so."""

    routes: list[Route] = field(default_factory=list)

    def on(self, page: Page, url: str) -> Held:
        """Hold those to an address."""
        page.route(url, lambda route: self.routes.append(route))
        return self

    @property
    def requests(self) -> list[Request]:
        """All that have come so far."""
        return [route.request for route in self.routes]

    def wait(self, page: Page, count: int = 1) -> None:
        """Wait until some have come."""
        end = time.monotonic() + _COMING
        while len(self.routes) < count:
            assert time.monotonic() < end, f"{len(self.routes)} of {count} requests have come"
            page.wait_for_timeout(20)
