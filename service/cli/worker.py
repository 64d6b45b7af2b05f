"""``meshcone worker``: one worker process."""

from __future__ import annotations


def command() -> None:
    """Run one worker.

    Broker and data directory come from MESHCONE_* variables.
    """
    from worker.main import main

    main()
