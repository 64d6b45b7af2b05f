"""The page of all jobs: send one by dropping it, and watch it."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.acceptance.dashboard.browsing import drop, keep_picture, watched_page
from tests.holding import Hold


def test_two_dropped_files_become_a_job_that_is_followed_to_its_verdict(
    page: Page, hold: Hold, rough_jug: MeshFile, jug: MeshFile
) -> None:
    source = hold.mesh(rough_jug)
    page.goto("/")
    drop(page, "#drop", {source.name: source.data, jug.name: jug.data})
    expect(page.locator(".slot[data-slot=source]")).to_contain_text(source.name)
    expect(page.locator(".slot[data-slot=reference]")).to_contain_text("jug.glb")
    page.get_by_role("button", name="Start the job").click()
    page.get_by_role("link", name="Watch this job").click()

    expect(page.get_by_test_id("progress")).to_be_visible()
    expect(page.get_by_text(re.compile("^reading"))).to_be_visible()
    hold.release()
    verdict = page.get_by_test_id("verdict")
    expect(verdict).to_contain_text("times closer to its reference")
    expect(verdict).to_contain_text("No gates were set")


def test_the_table_shows_a_job_sent_elsewhere_without_being_asked(
    page: Page, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    page.goto("/")
    expect(page.locator("#live")).to_have_text("live")

    job = client.submit(rough_ball, ball, {"gates": {"fscore": {"min": 1.0}}})
    row = page.locator(f"tr[data-id='{job.id}']")

    expect(row).to_be_visible()
    expect(row).to_contain_text("improved")
    expect(row).to_contain_text("fail")
    expect(row).to_contain_text("F-score")


def test_counts_filter_and_failures_come_first_both_in_the_link(
    page: Page, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    quick = {"mode": "measure", "quality": {"samples": 500, "emd_samples": 16}}
    gates = {"gates": {"fscore": {"min": 1.0}}}
    failing, fine = (
        client.wait(client.submit(rough_ball, ball, {**quick, **more}, labels=["one of a kind"]).id)
        for more in (gates, {})
    )
    page.goto("/")
    page.locator(f"tr[data-id='{fine.id}']").get_by_role("link", name="one of a kind").click()

    shown = page.locator("#rows tr[data-id]")
    expect(shown).to_have_count(2)
    assert page.url.endswith("/?label=one+of+a+kind")
    expect(page.get_by_role("button", name=re.compile(r"^All\s+2$"))).to_be_visible()
    expect(shown.first).to_have_attribute("data-id", fine.id)

    page.get_by_label("Failures first").check()
    expect(shown.first).to_have_attribute("data-id", failing.id)
    page.get_by_role("button", name=re.compile(r"^Fail\s+1$")).click()
    expect(shown).to_have_count(1)
    assert page.url.endswith("/?label=one+of+a+kind&verdict=fail&order=failures")

    page.reload()
    expect(shown).to_have_count(1)
    expect(page.get_by_label("Failures first")).to_be_checked()
    page.get_by_role("button", name=re.compile("^Canceled")).click()
    expect(page.get_by_text("No job is like that")).to_be_visible()
    page.go_back()
    expect(shown).to_have_count(1)


def test_the_table_can_be_searched_by_the_name_of_a_file(
    page: Page, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    named = MeshFile("Lantern of brass.obj", rough_ball.data)
    job = client.submit(named, ball, {"mode": "measure"})
    page.goto("/")
    page.get_by_label("Search by name").fill("lantern OF")

    expect(page.locator("#rows tr[data-id]")).to_have_count(1)
    expect(page.locator(f"tr[data-id='{job.id}']")).to_be_visible()
    assert page.url.endswith("/?name=lantern+OF")


def test_the_sample_is_shown_before_it_is_sent_and_gets_better(page: Page, client: Client) -> None:
    page.goto("/")
    page.get_by_role("button", name="New job").click()
    page.get_by_role("button", name="Fill in a sample").click()
    expect(page.locator(".slot[data-slot=source]")).to_contain_text("vase_scan.obj")
    expect(page.locator("#intent")).to_contain_text("vase_scan.obj is judged against vase.obj")
    page.get_by_label("Label").first.fill("a sample")
    page.get_by_role("button", name="Start the job").click()
    expect(page.get_by_role("link", name="Watch this job")).to_be_visible()

    [listed] = client.jobs(label="a sample").jobs
    report = client.report(client.wait(listed.id).id)
    assert report["outcome"] == "improved"
    assert report["inputs"]["reference"]["validity"]["watertight"]


def test_chosen_jobs_are_canceled_sent_again_and_deleted_together(
    page: Page, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    client.submit(hold.mesh(rough_ball), ball)  # keeps the one worker from what comes here
    for _ in range(2):
        client.submit(rough_ball, ball, {"mode": "measure"}, labels=["many at once"])
    page.goto("/?label=many+at+once")
    rows = page.locator("#rows tr[data-id]")
    expect(rows).to_have_count(2)

    rows.first.get_by_role("checkbox").focus()
    page.keyboard.press("Shift+ArrowDown")
    expect(page.get_by_text("2 jobs chosen")).to_be_visible()
    expect(page.get_by_role("button", name="Delete")).to_be_disabled()
    page.get_by_role("button", name="Cancel", exact=True).click()
    expect(page.get_by_text("2 jobs canceled.")).to_be_visible()
    expect(rows.locator(".chip.canceled")).to_have_count(2)

    page.get_by_label("Choose all").check()
    page.get_by_role("button", name="Run again").click()
    expect(rows).to_have_count(4)
    again, *_, first = client.jobs(label="many at once").jobs
    assert again.source == first.source.model_copy(update={"link": again.source.link})
    assert client.job(again.id).options == {"mode": "measure"}

    page.get_by_label("Choose all").check()
    page.keyboard.press("Escape")
    expect(page.locator("#selected")).to_be_hidden()
    page.get_by_label("Choose all").check()
    page.get_by_role("button", name="Cancel 2").click()
    expect(rows.locator(".chip.canceled")).to_have_count(4)
    page.get_by_label("Choose all").check()
    page.on("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name="Delete").click()
    expect(page.get_by_text("No job is like that")).to_be_visible()
    assert client.jobs(label="many at once").jobs == []


def test_older_jobs_are_shown_on_demand_and_chosen_with_the_others(
    page: Page, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    client.submit(hold.mesh(rough_ball), ball)  # keeps the one worker from what comes here
    corner = MeshFile("corner.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    for _ in range(51):
        client.submit(corner, None, {"mode": "audit"}, labels=["more than fit"])
    page.goto("/?label=more+than+fit")
    rows = page.locator("#rows tr[data-id]")
    expect(rows).to_have_count(50)

    page.get_by_role("button", name="Show more").click()
    expect(rows).to_have_count(51)
    expect(page.get_by_role("button", name="Show more")).to_be_hidden()
    page.get_by_label("Choose all").check()
    page.get_by_role("button", name="Cancel", exact=True).click()
    expect(page.get_by_text("51 jobs canceled.")).to_be_visible()
    expect(rows.locator(".chip.canceled")).to_have_count(51)

    assert client.delete_all("more than fit").deleted == 51


def test_options_are_asked_for_as_the_schema_describes_them(
    page: Page, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    page.goto("/")
    drop(page, "#drop", {rough_ball.name: rough_ball.data, ball.name: ball.data})
    page.get_by_text("all at their defaults").click()
    page.get_by_label("effort").select_option("fast")
    page.get_by_text("Constraints every answer").click()
    page.get_by_label("max displacement").fill("0.25")
    page.locator(".field", has=page.get_by_label("max displacement")).get_by_label(
        "unit"
    ).select_option("model")
    expect(page.locator("#options-count")).to_have_text("2 changed")
    keep_picture(page, "options")
    page.get_by_label("Label").first.fill("chosen options")
    page.get_by_role("button", name="Start the job").click()
    expect(page.get_by_role("link", name="Watch this job")).to_be_visible()

    [listed] = client.jobs(label="chosen options").jobs
    job = client.job(listed.id)
    assert job.options["effort"] == "fast"
    assert job.options["cones"]["max_displacement"] == {"model": 0.25}
    assert "solver" not in job.options  # as sent: what was left alone is not in it


def test_a_file_alone_is_audited(page: Page, client: Client, ball: MeshFile) -> None:
    page.goto("/")
    page.get_by_role("button", name="New job").click()
    expect(page.get_by_role("button", name="Start the job")).to_be_disabled()
    page.get_by_test_id("source-input").set_input_files(
        {"name": "alone.obj", "mimeType": "", "buffer": ball.data}
    )
    page.get_by_label("Label").first.fill("audited alone")
    page.get_by_role("button", name="Audit the source alone").click()
    expect(page.get_by_role("link", name="Watch this job")).to_be_visible()

    [listed] = client.jobs(label="audited alone").jobs
    assert (listed.mode, listed.reference) == ("audit", None)


def test_a_file_that_is_no_mesh_is_refused_in_words(
    browser: Browser, stack: Stack, ball: MeshFile
) -> None:
    with watched_page(browser, stack.url) as (page, _):  # a refusal is an error on the console
        page.goto("/")
        for slot, name, data in (
            ("source", "broken.obj", b"v 0 0 0\nv 1 0 0\nv nan 0 0\nf 1 2 3\n"),
            ("reference", ball.name, ball.data),
        ):
            page.get_by_test_id(f"{slot}-input").set_input_files(
                {"name": name, "mimeType": "", "buffer": data}
            )
        page.get_by_role("button", name="Start the job").click()

        expect(page.locator("#submit-state .error")).to_contain_text("broken.obj")
        expect(page.get_by_role("button", name="Start the job")).to_be_enabled()


@pytest.mark.usefixtures("refined")
def test_the_page_of_jobs_is_light_until_a_mesh_is_opened(page: Page) -> None:
    session = page.context.new_cdp_session(page)
    session.send("Network.enable")
    sent: list[float] = []
    session.on("Network.loadingFinished", lambda event: sent.append(event["encodedDataLength"]))
    # The stream of the table does not finish, and goes on for as long as the page is open: what
    # counts is the list it begins with.
    streams: set[str] = set()
    begun: dict[str, float] = {}
    session.on(
        "Network.requestWillBeSent",
        lambda event: "/events" in event["request"]["url"] and streams.add(event["requestId"]),
    )
    session.on(
        "Network.dataReceived",
        lambda event: (
            event["requestId"] in streams
            and begun.setdefault(event["requestId"], event["dataLength"])
        ),
    )
    page.goto("/")
    expect(page.locator("#rows tr[data-id]").first).to_be_visible()
    page.get_by_role("button", name="New job").click()
    page.get_by_text("all at their defaults").click()
    expect(page.get_by_label("effort")).to_be_visible()

    assert begun
    assert sum(sent) + sum(begun.values()) < 240_000
    assert not page.evaluate("'THREE' in globalThis")
    page.get_by_role("button", name="Close").click()
    keep_picture(page, "jobs")
