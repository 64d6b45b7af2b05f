"""The table of parts that `--per` prints."""

from __future__ import annotations

from rich.console import Console

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.measure import measure
from service.cli.parts_table import parts_table
from tests.truck import truck_obj


def test_what_is_missing_comes_first_and_what_is_not_there_has_a_dash() -> None:
    options = parse_options(
        {"mode": "measure", "quality": {"per": "node", "samples": 200, "emd_samples": 16}}
    )
    truck = MeshFile("truck.obj", truck_obj(without=["wheel_front_left"]))
    per = measure(truck, MeshFile("master.obj", truck_obj()), options).quality.per
    assert per is not None
    console = Console(width=80)

    with console.capture() as captured:
        console.print(parts_table(per.model_dump(mode="json")))

    rows = [line.split() for line in captured.get().splitlines() if line.strip()]
    [first, second] = [row for row in rows if row[0].startswith(("wheel", "body"))][:2]
    assert first[:2] == ["wheel_front_left", "MISSING"]
    assert first[4:] == ["-", "-"]
    assert second[1:] == ["0", "0", "0", "0"]
