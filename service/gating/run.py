"""Many jobs at a time, in the order they were given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

from meshcone.gates.results import AssetResult, GateRun
from service.gating.job import GateJob, Gatekeeper


def run_jobs(
    jobs: Sequence[GateJob],
    keeper: Gatekeeper,
    at_once: int,
    on_result: Callable[[AssetResult], None],
) -> GateRun:
    """Do all jobs, ``at_once`` at a time; ``on_result`` sees each result as it comes."""
    with ThreadPoolExecutor(max_workers=at_once) as threads:
        futures = [threads.submit(keeper.judge, job) for job in jobs]
        try:
            for future in as_completed(futures):
                on_result(future.result())
        except BaseException:  # also Ctrl-C: nothing may go on behind the caller's back
            threads.shutdown(wait=False, cancel_futures=True)
            keeper.stop()
            raise
        return GateRun.of([future.result() for future in futures])
