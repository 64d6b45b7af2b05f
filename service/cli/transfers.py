"""``meshcone transfers``: files from where pipelines keep them."""

from __future__ import annotations


def command() -> None:
    """Fetch the files that jobs name by URL, and put results where jobs want them.

    Broker and file store come from MESHCONE_* variables.
    """
    from worker.transfers.main import main

    main()
