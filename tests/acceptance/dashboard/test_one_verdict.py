"""Pairs whose files have equal names: each of the five ways to send one comes to one verdict."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.acceptance.dashboard.test_sides import drop_from_disk, sent
from tests.acceptance.two_exports import GATES, two_exports
from tests.commands import meshcone

OPTIONS = {"mode": "measure", "gates": GATES}
Folder = Mapping[str, bytes]
Folders = tuple[Folder, Folder]


def buffers() -> Folders:
    new, old = two_exports()
    return {"a.gltf": new.data, **new.resources}, {"a.gltf": old.data, **old.resources}


def textures() -> Folders:
    """A texture of either side beside the buffer, of one name too."""

    def textured(folder: Folder, texture: bytes) -> Folder:
        document = json.loads(folder["a.gltf"])
        document["images"] = [{"uri": "skin.png"}]
        return {**folder, "a.gltf": json.dumps(document).encode(), "skin.png": texture}

    new, old = buffers()
    return textured(new, b"red"), textured(old, b"green")


def spelled_otherwise() -> Folders:
    """The buffers' names as exporters write them: from the file's own folder, percent-encoded."""

    def renamed(folder: Folder) -> Folder:
        document = json.loads(folder["a.gltf"])
        document["buffers"][0]["uri"] = "./a%20buffer.bin"
        return {"a.gltf": json.dumps(document).encode(), "a buffer.bin": folder["a.bin"]}

    new, old = buffers()
    return renamed(new), renamed(old)


def materials() -> Folders:
    """OBJ files that differ, with a material library of one name each."""
    vertices, faces = shapes.sphere(2)
    spiked = vertices.copy()
    spiked[5] *= 1.2

    def folder(positions: np.ndarray, colour: bytes) -> Folder:
        library = b"newmtl paint\nKd " + colour + b"\n"
        return {"a.obj": b"mtllib a.mtl\n" + shapes.obj(positions, faces), "a.mtl": library}

    return folder(spiked, b"1 0 0"), folder(vertices, b"0 1 0")


def one_file_twice() -> Folders:
    _, old = buffers()
    return old, old


CASES: dict[str, tuple[Callable[[], Folders], str]] = {
    "buffers": (buffers, "fail"),
    "buffers spelled otherwise": (spelled_otherwise, "fail"),
    "textures": (textures, "fail"),
    "material libraries": (materials, "fail"),
    "the same bytes": (one_file_twice, "pass"),
}


@pytest.mark.parametrize("case", CASES)
def test_files_of_equal_names_lead_to_one_verdict_by_every_way(
    stack: Stack, client: Client, page: Page, tmp_path: Path, case: str
) -> None:
    folders, expected = CASES[case]
    for side, files in zip(("new", "old"), folders(), strict=True):
        (tmp_path / side).mkdir()
        for name, data in files.items():
            (tmp_path / side / name).write_bytes(data)

    verdicts = {
        "gate": by_gate(tmp_path),
        "gate --server": by_gate(tmp_path, "--server", stack.url),
        "submit": by_submit(tmp_path, stack.url),
        "curl": by_curl(tmp_path, stack.url, client),
        "dashboard": by_dashboard(tmp_path, page, client, f"one verdict: {case}"),
    }

    assert verdicts == dict.fromkeys(verdicts, expected)


def mesh_in(folder: Path) -> str:
    [mesh] = [path for path in folder.iterdir() if path.suffix in (".gltf", ".obj")]
    return f"{folder.name}/{mesh.name}"


def run(directory: Path, *command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=directory, capture_output=True, text=True, check=False, timeout=240
    )


def by_gate(directory: Path, *server: str) -> str:
    pair = (mesh_in(directory / "new"), mesh_in(directory / "old"))
    (directory / "gates.json").write_text(json.dumps({"gates": GATES}))
    arguments = ("gate", *pair, "--gates", "gates.json", "--json", "out.json", *server)
    done = meshcone(directory, *arguments)
    assert done.returncode in (0, 1), done.stderr
    [asset] = json.loads((directory / "out.json").read_text())["assets"]
    return str(asset["verdict"]["verdict"])


def by_submit(directory: Path, url: str) -> str:
    pair = (mesh_in(directory / "new"), mesh_in(directory / "old"))
    assignments = [f"--set={key}={json.dumps(value)}" for key, value in OPTIONS.items()]
    arguments = ("submit", *pair, "--server", url, "--report", "r.json", *assignments)
    done = meshcone(directory, *arguments)
    assert done.returncode in (0, 1), done.stderr
    return str(json.loads((directory / "r.json").read_text())["gates"]["verdict"])


def by_curl(directory: Path, url: str, client: Client) -> str:
    fields = ["--form-string", f"options={json.dumps(OPTIONS)}"]
    for side, folder in (("source", "new"), ("reference", "old")):
        mesh = mesh_in(directory / folder)
        fields += ["-F", f"{side}=@{mesh}"]
        for path in (directory / folder).iterdir():
            if f"{folder}/{path.name}" != mesh:
                fields += ["-F", f"{side}_resources=@{folder}/{path.name}"]
    done = run(directory, "curl", "-sS", "--noproxy", "*", f"{url}/v1/jobs", *fields)
    return str(client.wait(json.loads(done.stdout)["id"]).verdict)


def by_dashboard(directory: Path, page: Page, client: Client, label: str) -> str:
    page.goto("/")
    drop_from_disk(page, [directory / "new", directory / "old"])
    expect(page.locator(".slot[data-slot=source]")).to_contain_text("new/a.")
    page.locator("#options > summary").click()
    page.locator("#option-mode").select_option("measure")
    page.locator("#option-gates").fill(json.dumps(GATES))
    return str(sent(page, client, label).verdict)
