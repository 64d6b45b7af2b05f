"""``meshcone transfers``: files from where pipelines keep them."""

from __future__ import annotations


def command() -> None:
    """Fetch files by URL, and send results to URLs.

    Broker and file store come from MESHCONE_* variables.
    """
    from worker.transfers.main import main

    main()
