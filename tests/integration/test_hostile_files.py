"""Files that cost other readers gigabytes and minutes are refused, or read, within bounds."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

from tests.hostile import BOMBS
from tests.hostile.case import Case

MEMORY = 2 * 1024**3  # address space of the reading process, the file itself included
SECONDS = 120

_READ = """
import resource, sys
from meshcone.assets import read_asset
from meshcone.errors import MeshConeError
from tests.hostile import BOMBS
case = next(case for case in BOMBS if str(case) == sys.argv[1])
data = case.make()
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]), int(sys.argv[2])))
try:
    asset = read_asset(case.name, data)
    try:
        asset.patched(asset.vertices + 1)
    except MeshConeError as error:  # a reference, or a mesh that is drawn twice: refused in words
        assert error.kind == "input", error
    print("ok")
except MeshConeError as error:
    print(error.kind, error.place, error.message, sep="\\n")
"""


@pytest.mark.parametrize("case", BOMBS, ids=str)
def test_a_small_cause_has_no_large_effect(case: Case) -> None:
    command = [sys.executable, "-c", _READ, str(case), str(MEMORY)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert ended.returncode == 0, ended.stderr
    kind, *rest = ended.stdout.splitlines()
    assert kind == case.kind
    if kind != "ok":
        place, message = rest
        assert re.fullmatch(case.place or "None", place)
        assert re.search(case.message, message)


_READ_WITHIN = """
import sys
from meshcone.assets import read_asset
from worker.run.sandbox import limit_resources
start = {"a.obj": b"v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n", "a.off": b"OFF\\n3 1 0\\n"}
end = {"a.obj": b"", "a.off": b"0 0 0\\n1 0 0\\n0 1 0\\n3 0 1 2\\n"}
name, line = sys.argv[1], sys.argv[2].encode() + b"\\n"
data = start[name] + line * (16 * 2**20 // len(line)) + end[name]
limit_resources(seconds=600, memory=int(sys.argv[3]), file_bytes=None)
print(len(read_asset(name, data).faces))
"""


@pytest.mark.parametrize(
    ("name", "line", "times"),
    [("a.obj", "#", 24), ("a.obj", "##", 24), ("a.obj", "##\\", 24), ("a.off", "##", 8)],
)
def test_lines_that_say_nothing_take_little_memory(name: str, line: str, times: int) -> None:
    memory = str(times * 16 * 2**20)  # an object a line takes 80, 53, 56 and 20 times the file
    command = [sys.executable, "-c", _READ_WITHIN, name, line, memory]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert ended.stdout == "1\n", ended.stderr
