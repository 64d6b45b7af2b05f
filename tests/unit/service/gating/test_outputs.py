"""The files that a run of gates leaves."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import unquote

import pytest

from meshcone.errors import InputError
from meshcone.gates.results import AssetResult, AssetView, GateRun
from service.gating.outputs import MOST_PICTURES, Outputs
from tests.unit.gates.runs import asset, check

PICTURE = b"a picture"


def seen(result: AssetResult, picture: bytes | None = PICTURE) -> AssetResult:
    view = AssetView(report="{}", preview=None, pictures=picture)
    return result.model_copy(update={"view": view})


def shown(markdown: Path) -> list[Path]:
    """The pictures that a summary shows, from where it is."""
    found = re.findall(r'src="([^"]*)"', markdown.read_text())
    return [markdown.parent / unquote(each) for each in found]


def test_what_did_not_pass_is_drawn_and_shown_in_the_summary(tmp_path: Path) -> None:
    bad, good = asset("bad.obj", check("fail")), asset("good.obj", check("pass"))
    run = GateRun.of([seen(bad), seen(good), asset("blind.obj", check("fail"))])
    (tmp_path / "reports").mkdir()
    outputs = Outputs(
        markdown=tmp_path / "reports" / "gate.md", pictures=tmp_path / "new" / "my pictures"
    )

    outputs.write(run)

    [picture] = shown(tmp_path / "reports" / "gate.md")
    assert picture.read_bytes() == PICTURE
    assert len(list((tmp_path / "new" / "my pictures").iterdir())) == 1


def test_an_asset_without_colours_has_no_picture(tmp_path: Path) -> None:
    run = GateRun.of([seen(asset("grey.obj", check("fail")), None)])

    Outputs(markdown=tmp_path / "gate.md", pictures=tmp_path / "pictures").write(run)

    assert shown(tmp_path / "gate.md") == []
    assert not (tmp_path / "pictures").exists()


def test_a_large_run_has_a_few_pictures(tmp_path: Path) -> None:
    run = GateRun.of([seen(asset(f"{number}.obj", check("fail"))) for number in range(50)])

    Outputs(pictures=tmp_path).write(run)

    assert len(list(tmp_path.iterdir())) == MOST_PICTURES


def test_only_what_is_to_be_looked_at_has_to_be_drawn() -> None:
    assert not Outputs(json=Path("a"), markdown=Path("b")).viewed
    assert Outputs(html=Path("a")).viewed
    assert Outputs(pictures=Path("a")).viewed


def test_a_folder_that_cannot_be_made_is_told_and_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "taken").touch()
    run = GateRun.of([seen(asset("bad.obj", check("fail")))])

    with pytest.raises(InputError, match="taken: cannot be made"):
        Outputs(json=tmp_path / "gate.json", pictures=tmp_path / "taken").write(run)

    assert not (tmp_path / "gate.json").exists()


def test_a_folder_in_the_place_of_a_file_is_refused_before_the_run(tmp_path: Path) -> None:
    (tmp_path / "taken").touch()

    for folder in ("taken", "taken/below"):
        with pytest.raises(InputError, match="cannot be made: not a directory"):
            Outputs(pictures=tmp_path / folder).require([])


def test_pictures_of_an_earlier_run_may_be_replaced(tmp_path: Path) -> None:
    (tmp_path / "asset-1.png").touch()

    Outputs(pictures=tmp_path).require([tmp_path / "mug.obj"], pairs=1)
