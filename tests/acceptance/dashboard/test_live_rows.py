"""The table of jobs while it changes under the hands of somebody who works with it."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from service.stack import Stack
from tests.acceptance.dashboard.browsing import watched_page
from tests.acceptance.dashboard.made_rows import Held, MadeFeed, batch, job, running


@pytest.fixture
def feed(page: Page) -> MadeFeed:
    return MadeFeed(page)


def row(page: Page, number: int) -> Locator:
    return page.locator(f"tr[data-id='j{number}']")


def down_on(page: Page, element: Locator) -> None:
    """Press on an element without letting go."""
    element.hover()
    page.mouse.down()


def numbers(page: Page) -> list[int]:
    """Of the jobs that are shown, from the top."""
    ids = page.locator("tr[data-id]").evaluate_all("rows => rows.map(row => row.dataset.id)")
    return [int(each[1:]) for each in ids]


def ids(jobs: range) -> list[str]:
    return [f"j{number}" for number in jobs]


@pytest.mark.parametrize("pressed", [1, 2], ids=["of another job", "of the job that runs"])
def test_a_press_on_a_checkbox_counts_though_a_job_goes_on_meanwhile(
    page: Page, feed: MadeFeed, pressed: int
) -> None:
    page.goto("/")
    feed.tell([running(2, 0.1), job(1)])
    box = row(page, pressed).get_by_role("checkbox")
    down_on(page, box)

    feed.tell([running(2, 0.5)], ["j2", "j1"])
    expect(row(page, 2).get_by_role("progressbar")).to_have_attribute("value", "0.5")
    page.mouse.up()

    expect(box).to_be_checked()


def test_rows_that_stay_are_not_touched_when_one_comes_and_another_moves(
    page: Page, feed: MadeFeed
) -> None:
    page.goto("/")
    feed.tell([job(number) for number in (3, 2, 1)])
    page.evaluate(
        "() => { window.changes = [];"
        "new MutationObserver((all) => window.changes.push(...all.flatMap("
        "(each) => [...each.addedNodes, ...each.removedNodes].map((row) => row.dataset.id))))"
        ".observe(document.getElementById('rows'), { childList: true }); }"
    )

    feed.tell([job(4)], ["j4", "j2", "j1", "j3"])

    expect(page.locator("tr[data-id]").last).to_have_attribute("data-id", "j3")
    assert numbers(page) == [4, 2, 1, 3]
    assert set(page.evaluate("window.changes")) == {"j4", "j3"}


def test_the_focus_stays_on_what_can_be_done_with_chosen_jobs(page: Page, feed: MadeFeed) -> None:
    page.goto("/")
    feed.tell([running(2, 0.1), job(1)])
    row(page, 1).get_by_role("checkbox").check()
    delete = page.get_by_role("button", name="Delete")
    delete.focus()

    feed.tell([running(2, 0.5)], ["j2", "j1"])
    expect(row(page, 2).get_by_role("progressbar")).to_have_attribute("value", "0.5")

    expect(delete).to_be_focused()


def test_the_focus_stays_on_a_job_whose_name_is_drawn_anew(page: Page, feed: MadeFeed) -> None:
    page.goto("/")
    feed.tell([job(1)])
    row(page, 1).get_by_role("checkbox").focus()

    feed.tell([job(1, labels=["kept"])])
    expect(row(page, 1)).to_contain_text("kept")

    expect(row(page, 1).get_by_role("checkbox")).to_be_focused()


def test_what_is_under_way_with_chosen_jobs_cannot_be_started_again(
    page: Page, feed: MadeFeed
) -> None:
    cancels = Held().on(page, "**/v1/jobs/*/cancel")
    page.goto("/")
    feed.tell([running(2, 0.1), job(1, "queued")])
    for number in (1, 2):
        row(page, number).get_by_role("checkbox").check()
    cancel = page.get_by_role("button", name="Cancel", exact=True)
    cancel.click()

    feed.tell([job(2)], ["j2", "j1"])
    expect(row(page, 2).locator(".chip.pass")).to_be_visible()

    expect(cancel).to_be_disabled()
    cancels.wait(page, 2)
    for route in cancels.routes:
        route.fulfill(json={})
    expect(page.get_by_text("2 jobs canceled.")).to_be_visible()
    assert len(cancels.requests) == 2


def test_a_batch_that_goes_on_is_canceled_once_and_a_refusal_is_told(
    browser: Browser, stack: Stack
) -> None:
    with watched_page(browser, stack.url) as (page, _):  # a refusal is an error on the console
        feed = MadeFeed(page)
        cancels = Held().on(page, "**/v1/batches/b1/cancel")
        page.goto("/")
        feed.tell([batch(1)])
        page.get_by_role("button", name="nightly").click()
        feed.tell([job(5)], stream=1)
        cancel = page.get_by_role("button", name="Cancel batch")
        cancel.click()

        feed.tell([batch(2)], stream=0)
        expect(page.get_by_text("2 of 10 ended")).to_be_visible()
        expect(cancel).to_be_disabled()
        cancels.wait(page)
        cancels.routes[0].fulfill(status=503, json={"detail": "the broker cannot be reached"})

        expect(page.locator(".batch-tools")).to_contain_text("the broker cannot be reached")
        expect(cancel).to_be_enabled()


def test_a_refusal_to_cancel_a_batch_that_was_closed_is_told_above_the_table(
    browser: Browser, stack: Stack
) -> None:
    with watched_page(browser, stack.url) as (page, _):  # a refusal is an error on the console
        feed = MadeFeed(page)
        cancels = Held().on(page, "**/v1/batches/b1/cancel")
        page.goto("/")
        feed.tell([batch(1)])
        page.get_by_role("button", name="nightly").click()
        page.get_by_role("button", name="Cancel batch").click()
        page.get_by_role("button", name="nightly").click()
        cancels.wait(page)
        cancels.routes[0].fulfill(status=503, json={"detail": "the broker cannot be reached"})

        expect(page.locator("#sent")).to_contain_text(
            "Cancel batch, nightly: the broker cannot be reached"
        )


def shown_with_older(page: Page, feed: MadeFeed) -> None:
    """Open the page with the jobs 60 to 11, and those after them on demand."""
    page.goto("/")
    feed.tell([job(number) for number in range(60, 10, -1)], more="after 11")
    page.get_by_role("button", name="Show more").click()
    expect(page.locator("tr[data-id]")).to_have_count(60)


def test_new_jobs_push_none_out_between_the_first_and_the_older_ones(
    page: Page, feed: MadeFeed
) -> None:
    rows = [job(number) for number in range(10, 0, -1)]
    page.route(
        "**/dashboard/rows?*", lambda route: route.fulfill(json={"rows": rows, "more": None})
    )
    shown_with_older(page, feed)

    for new in (61, 62, 63):
        feed.tell([job(new)], ids(range(new, new - 50, -1)), more=f"after {new - 49}")
        expect(row(page, new)).to_be_visible()

    assert numbers(page) == list(range(63, 0, -1))


def test_no_job_is_missing_that_was_pushed_off_while_older_ones_were_fetched(
    page: Page, feed: MadeFeed
) -> None:
    older = Held().on(page, "**/dashboard/rows?*")
    page.goto("/")
    feed.tell([job(number) for number in range(60, 10, -1)], more="after 11")
    page.get_by_role("button", name="Show more").click()
    older.wait(page)
    feed.tell([job(61)], ids(range(61, 11, -1)), more="after 12")
    expect(row(page, 61)).to_be_visible()

    older.routes[0].fulfill(
        json={"rows": [job(number) for number in range(10, 0, -1)], "more": None}
    )

    expect(row(page, 1)).to_be_visible()
    assert numbers(page) == list(range(61, 0, -1))


def test_a_job_that_is_deleted_among_the_first_does_not_come_back_among_the_older(
    page: Page, feed: MadeFeed
) -> None:
    rows = [job(number) for number in range(10, 0, -1)]
    page.route(
        "**/dashboard/rows?*", lambda route: route.fulfill(json={"rows": rows, "more": None})
    )
    shown_with_older(page, feed)

    feed.tell([job(10)], [*ids(range(60, 11, -1)), "j10"], more="after 10")

    expect(row(page, 11)).to_have_count(0)
    assert numbers(page) == [*range(60, 11, -1), *range(10, 0, -1)]


def test_an_older_job_that_runs_is_looked_at_until_it_has_ended(page: Page, feed: MadeFeed) -> None:
    page.clock.install()
    answers = [[running(10, 0.1)], [running(10, 0.9)], [job(10)]]
    page.route(
        "**/dashboard/rows?*",
        lambda route: route.fulfill(json={"rows": answers.pop(0), "more": None}),
    )
    page.goto("/")
    feed.tell([job(number) for number in range(60, 10, -1)], more="after 11")
    page.get_by_role("button", name="Show more").click()
    expect(row(page, 10).locator(".chip.running")).to_be_visible()

    page.clock.fast_forward(10_000)
    expect(row(page, 10).get_by_role("progressbar")).to_have_attribute("value", "0.9")
    page.clock.fast_forward(10_000)
    expect(row(page, 10).locator(".chip.pass")).to_be_visible()
    page.clock.fast_forward(10_000)
    page.clock.fast_forward(10_000)

    assert answers == []  # what has ended is asked for no more: there is no answer to it


def test_older_jobs_that_are_looked_at_again_stay_away_from_a_table_of_others(
    page: Page, feed: MadeFeed
) -> None:
    page.clock.install()
    older = Held().on(page, "**/dashboard/rows?*")
    page.goto("/")
    feed.tell([job(number) for number in range(60, 10, -1)], more="after 11")
    page.get_by_role("button", name="Show more").click()
    older.wait(page)
    older.routes[0].fulfill(json={"rows": [running(10, 0.1)], "more": None})
    expect(row(page, 10)).to_be_visible()
    page.clock.fast_forward(10_000)
    older.wait(page, 2)

    page.locator("#tally [data-kind=fail]").click()
    feed.tell([job(500, verdict="fail")], stream=1)
    expect(row(page, 500)).to_be_visible()
    with page.expect_response("**/dashboard/rows?*"):
        older.routes[1].fulfill(json={"rows": [job(10)], "more": None})
    feed.tell([job(500, verdict="fail"), job(400, verdict="fail")], stream=1)

    expect(row(page, 400)).to_be_visible()
    assert numbers(page) == [500, 400]
