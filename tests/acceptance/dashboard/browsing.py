"""A browser that notes what a page does wrong, and looks at what it draws."""

from __future__ import annotations

import io
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, FrameLocator, Locator, Page, Playwright, Request, expect

DESKTOP = {"width": 1280, "height": 800}
PHONE = {"width": 390, "height": 844}
# There is no graphics card: Chromium draws WebGL by SwiftShader, which newer ones must be told.
_WEBGL = ["--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
_NAMES = ("chromium", "chromium-browser", "google-chrome")


def launch(playwright: Playwright) -> Browser:
    """The system's Chromium; the test is skipped where there is none, which CI does not allow."""
    path = next(filter(None, map(shutil.which, _NAMES)), None)
    if path is None:
        pytest.skip("there is no Chromium; `make browser` installs it")
    # Chromium's own sandbox needs a user that is not root, which a container's is.
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
    return playwright.chromium.launch(executable_path=path, args=[*_WEBGL, *sandbox])


@dataclass
class Faults:
    """What a page must not do."""

    origin: str
    said: list[str] = field(default_factory=list)
    elsewhere: list[str] = field(default_factory=list)

    def watch(self, page: Page) -> None:
        """Note errors on the console, and requests to any other host."""
        page.on("console", lambda said: said.type == "error" and self.said.append(said.text))
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("request", self._look_where)

    def _look_where(self, request: Request) -> None:
        if not request.url.startswith((self.origin, "data:", "blob:")):
            self.elsewhere.append(request.url)


@contextmanager
def watched_page(
    browser: Browser, url: str, *, scheme: str = "light", viewport: dict[str, int] = DESKTOP
) -> Iterator[tuple[Page, Faults]]:
    """A page in a context of its own, and what it does wrong."""
    context = browser.new_context(
        base_url=url,
        viewport=viewport,
        color_scheme=scheme,
        reduced_motion="reduce",
        locale="en-GB",
        accept_downloads=True,
    )
    faults = Faults(url)
    page = context.new_page()
    faults.watch(page)
    try:
        yield page, faults
    finally:
        context.close()


def drop(page: Page, selector: str, files: dict[str, bytes]) -> None:
    """Drop files on an element, as a person would from a file manager."""
    transfer = page.evaluate_handle(
        """files => {
            const transfer = new DataTransfer();
            for (const [name, bytes] of Object.entries(files))
                transfer.items.add(new File([new Uint8Array(bytes)], name));
            return transfer;
        }""",
        {name: list(data) for name, data in files.items()},
    )
    for event in ("dragenter", "dragover", "drop"):
        page.dispatch_event(selector, event, {"dataTransfer": transfer})


def open_tab(page: Page | FrameLocator, name: str) -> None:
    """Open one of the tabs under the viewer, by what its title begins with."""
    page.get_by_role("tab", name=re.compile(f"^{name}")).click()


def pixels(element: Locator) -> NDArray[np.float64]:
    """What an element looks like, (height, width, 3) in [0, 255], once the meshes are at rest."""
    for frame in element.page.frames:
        expect(frame.locator("canvas[data-rest=false]")).to_have_count(0)
    image = Image.open(io.BytesIO(element.screenshot(animations="disabled"))).convert("RGB")
    return np.asarray(image, dtype=np.float64)


def difference(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Mean absolute difference of two pictures of about the same size."""
    height, width = (min(sizes) for sizes in zip(one.shape[:2], other.shape[:2], strict=True))
    return float(np.abs(one[:height, :width] - other[:height, :width]).mean())


def warm(image: NDArray[np.float64]) -> float:
    """Share of the pixels in the warm colours: beyond a threshold, or worse than before."""
    red, _, blue = np.moveaxis(image, 2, 0)
    return float((red > blue + 40).mean())


def settle(page: Page) -> None:
    """Wait until what was asked for has been drawn: two frames of the browser."""
    page.evaluate(
        "() => new Promise(done => requestAnimationFrame("
        "() => requestAnimationFrame(() => setTimeout(done, 50))))"
    )


def keep_picture(page: Page, name: str, height: int = 800) -> None:
    """Store how the top of a page looks where MESHCONE_SCREENSHOTS says; nowhere without it."""
    directory = os.environ.get("MESHCONE_SCREENSHOTS")
    if not directory:
        return
    width = page.viewport_size["width"] if page.viewport_size else DESKTOP["width"]
    clip = {"x": 0, "y": 0, "width": width, "height": height}
    page.evaluate("scrollTo(0, 0)")
    image = Image.open(io.BytesIO(page.screenshot(full_page=True, clip=clip)))
    image.convert("RGB").save(Path(directory) / f"{name}.png", optimize=True)
