"""The service under load; see service_benchmark.py."""

from __future__ import annotations

import sys

if __name__ == "__main__":
    # This file has the name of the package it measures, which is to be found first.
    here = sys.path.pop(0)
    import service.stack  # noqa: F401

    sys.path.append(here)
    from service_benchmark import main

    sys.exit(main())
