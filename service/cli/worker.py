"""``meshcone worker``: one worker process."""

from __future__ import annotations


def command() -> None:
    """Run a worker; broker and data directory come from MESHCONE_* variables."""
    from worker.main import main

    main()
