"""Loaded by each Python process of a held installation: some of its jobs wait for their test.

Python imports a module of this name at its start if its folder is in PYTHONPATH. A job whose
source's name begins as HELD_SOURCES says waits, as soon as it has a progress to report, until
the folder that HELD_JOBS names has a file of the source's name.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import time
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

MODULE = "worker.run.progress"


class Finder:
    """Changes one module as it is imported, so that no process imports it for this alone."""

    def find_spec(self, name: str, *_: object) -> ModuleSpec | None:
        if name != MODULE:
            return None
        sys.meta_path.remove(self)  # type: ignore[arg-type]
        spec = importlib.util.find_spec(name)
        assert spec is not None
        assert spec.loader is not None
        load = spec.loader.exec_module

        def load_and_change(module: ModuleType) -> None:
            load(module)
            change(module)

        spec.loader.exec_module = load_and_change  # type: ignore[method-assign]
        return spec


def change(module: Any) -> None:
    report = module.ProgressReporter.__call__

    def report_and_wait(reporter: Any, progress: Any) -> None:
        report(reporter, progress)
        name = reporter._ledger.get(reporter._job_id).source.name
        if name.startswith(os.environ["HELD_SOURCES"]):
            while not Path(os.environ["HELD_JOBS"], name).exists():
                time.sleep(0.01)

    module.ProgressReporter.__call__ = report_and_wait


sys.meta_path.insert(0, Finder())  # type: ignore[arg-type]
