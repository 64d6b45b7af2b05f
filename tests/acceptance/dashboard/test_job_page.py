"""The page of one job, besides its meshes: verdict, proof, files, what can be done with it."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import Page, expect

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from tests.acceptance.dashboard.browsing import open_tab
from tests.holding import Hold


def test_the_verdict_is_said_in_words(job_page: Page) -> None:
    verdict = job_page.get_by_test_id("verdict")

    expect(verdict).to_contain_text("Passed: 3 checks hold.")
    expect(verdict).to_contain_text(re.compile(r"\d+ times closer to its reference"))
    expect(job_page.get_by_test_id("checks").locator("li")).to_have_count(3)
    expect(job_page.get_by_test_id("checks")).to_contain_text("worst deviation")
    row = job_page.locator("tr[data-metric='point_to_surface.max']")
    expect(row).to_contain_text("pass")


def test_arrow_keys_go_through_the_tabs_and_the_link_opens_the_same_one(job_page: Page) -> None:
    gates = job_page.get_by_role("tab", name="Gates")
    expect(gates).to_have_attribute("aria-selected", "true")
    gates.press("ArrowRight")
    job_page.keyboard.press("ArrowRight")
    metrics = job_page.get_by_role("tab", name="Metrics")
    expect(metrics).to_be_focused()
    expect(job_page.get_by_role("tabpanel")).to_have_count(1)
    expect(job_page.locator("tr[data-metric='point_to_surface.max']")).to_be_visible()

    job_page.reload()

    expect(metrics).to_have_attribute("aria-selected", "true")
    metrics.press("End")
    expect(job_page.get_by_role("tab", name="Files")).to_be_focused()


def test_what_is_proven_is_stated_and_its_farthest_point_is_a_place(
    job_page: Page, client: Client, refined: Job
) -> None:
    report = client.report(refined.id)
    statement = report["statement"]

    expect(job_page.get_by_test_id("statement")).to_have_text(f"E{statement[1:]}.")
    expect(job_page.locator("tr[data-metric='deviation.max']")).to_contain_text(" to ")
    place = job_page.get_by_role("button", name=re.compile("^1 farthest, proven"))
    place.click()
    expect(place).to_have_attribute("aria-pressed", "true")


def test_the_refined_mesh_downloads_under_its_name(
    job_page: Page, client: Client, refined: Job
) -> None:
    open_tab(job_page, "Files")
    with job_page.expect_download() as downloading:
        job_page.get_by_role("link", name="jug_scan.refined.glb").click()

    assert downloading.value.suggested_filename == "jug_scan.refined.glb"
    assert Path(downloading.value.path()).read_bytes() == client.mesh(refined.id)


def test_what_was_sent_downloads_under_its_name(
    job_page: Page, rough_jug: MeshFile, jug: MeshFile
) -> None:
    open_tab(job_page, "Files")
    for file in (rough_jug, jug):
        with job_page.expect_download() as downloading:
            job_page.get_by_test_id("inputs").get_by_role("link", name=file.name).click()

        assert downloading.value.suggested_filename == file.name
        assert Path(downloading.value.path()).read_bytes() == file.data


def test_the_verify_command_proves_the_downloads(
    job_page: Page, tmp_path: Path, rough_jug: MeshFile, jug: MeshFile
) -> None:
    for file in (rough_jug, jug):
        (tmp_path / file.name).write_bytes(file.data)
    open_tab(job_page, "Files")
    for name in ("jug_scan.refined.glb", "jug_scan.report.json", "jug_scan.report.certificate.npz"):
        with job_page.expect_download() as downloading:
            job_page.get_by_role("link", name=name).click()
        downloading.value.save_as(tmp_path / name)
    open_tab(job_page, "Solver")
    shown = job_page.get_by_role("region", name="Command that verifies the certificate")

    program, *arguments = shlex.split(shown.inner_text())

    # The program beside this interpreter, whether or not its environment is activated.
    verified = subprocess.run(
        [Path(sys.executable).with_name(program), *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )

    assert verified.returncode == 0, verified.stdout + verified.stderr


def test_the_curl_command_repeats_the_job(
    job_page: Page, tmp_path: Path, rough_jug: MeshFile, jug: MeshFile, client: Client, refined: Job
) -> None:
    for file in (rough_jug, jug):
        (tmp_path / file.name).write_bytes(file.data)
    open_tab(job_page, "Files")
    shown = job_page.get_by_role("region", name="Command that repeats this job")

    sent = subprocess.run(
        ["sh", "-c", shown.inner_text()], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )

    assert sent.returncode == 0, sent.stdout + sent.stderr
    again = Job.model_validate_json(sent.stdout)
    assert (again.options, again.labels) == (refined.options, refined.labels)
    for mine, other in ((again.source, refined.source), (again.reference, refined.reference)):
        assert mine is not None
        assert other is not None
        assert (mine.name, mine.sha256) == (other.name, other.sha256)
    client.wait(again.id)  # or it would keep the one worker from what comes next


def test_a_job_runs_again_with_its_files_and_other_options(
    job_page: Page, client: Client, refined: Job
) -> None:
    job_page.get_by_role("button", name="Run again").click()
    gates = job_page.locator("#option-gates")
    expect(gates).to_have_value(re.compile('"point_to_surface.max"'))
    job_page.locator("#option-mode").select_option("measure")
    job_page.get_by_role("button", name="Start the job").click()
    job_page.wait_for_url(lambda url: refined.id not in url)

    again = client.wait(job_page.url.partition("#")[0].rpartition("/")[2])
    assert again.options == {**refined.options, "mode": "measure"}
    assert again.labels == refined.labels
    assert again.source.sha256 == refined.source.sha256


def test_a_tolerance_that_is_not_reached_is_said_with_its_worst_place(
    page: Page, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    quick = {"effort": "fast", "quality": {"samples": 500, "emd_samples": 16}}
    job = client.wait(client.submit(rough_ball, ball, {"within": "1e-9%", **quick}).id)
    page.goto(f"/jobs/{job.id}")

    told = page.get_by_test_id("within")
    expect(told).to_contain_text("Not within 1e-9% after 3 refinements")
    expect(told).to_contain_text(re.compile(r"Worst place: [\d.e-]+ units off near \("))
    assert job.verdict == "fail"


def test_a_job_that_failed_says_why(page: Page, client: Client, ball: MeshFile) -> None:
    blank = MeshFile("blank.obj", b"\n" * 16 * 2**20)
    job = client.wait(client.submit(blank, ball).id)
    page.goto(f"/jobs/{job.id}")

    expect(page.get_by_role("alert")).to_contain_text("empty")
    expect(page.get_by_role("alert")).to_contain_text("blank.obj")


def test_a_job_can_be_canceled_and_then_deleted(
    page: Page, client: Client, hold: Hold, rough_jug: MeshFile, jug: MeshFile
) -> None:
    client.submit(hold.mesh(rough_jug), jug)  # keeps the one worker from the job canceled here
    job = client.submit(rough_jug, jug)
    page.goto(f"/jobs/{job.id}")
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_text("This job was canceled")).to_be_visible()

    page.on("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name="Delete").click()
    page.wait_for_url(lambda url: url.endswith("/"))

    assert job.id not in [each.id for each in client.all_jobs()]
