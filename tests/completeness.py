"""A run that says it passed has run everything: nothing skipped in CI, nothing lost anywhere."""

from __future__ import annotations

import os
from collections.abc import Generator

import pytest

_ended: list[str] = []  # several tests may go by one name


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Turn a skip into a failure where ``CI`` is set; an expected failure is no skip."""
    report = yield
    if os.environ.get("CI") == "true" and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped, which CI does not allow: {report.longrepr}"
    return report


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Note which tests have come to their end, wherever they ran."""
    if report.when == "teardown":
        _ended.append(report.nodeid)


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Fail a run over several processes in which tests were collected and never ended."""
    one_of_several = hasattr(session.config, "workerinput")
    if exitstatus != 0 or one_of_several or session.config.option.collectonly:
        return
    lost = session.testscollected - len(_ended)
    if lost:
        print(f"\n{lost} of {session.testscollected} tests never ended")
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
