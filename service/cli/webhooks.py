"""``meshcone webhooks``: the delivery of webhooks."""

from __future__ import annotations


def command() -> None:
    """Deliver webhooks.

    The broker comes from MESHCONE_* variables.
    """
    from worker.webhooks.main import main

    main()
