"""The RQ side: broker, blobs, ledger, queue and the task."""
