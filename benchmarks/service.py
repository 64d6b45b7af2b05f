"""The service under load (service_benchmark.py) or, with ``accepting``, its 202 alone."""

from __future__ import annotations

import sys

if __name__ == "__main__":
    # This file has the name of the package it measures, which is to be found first.
    here = sys.path.pop(0)
    import service.stack  # noqa: F401

    sys.path.append(here)
    if sys.argv[1:2] == ["accepting"]:
        from service_accepting import main

        sys.exit(main(sys.argv[2:]))
    from service_benchmark import main

    sys.exit(main())
