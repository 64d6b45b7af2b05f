"""Webhooks: telling somebody else's server that a job has ended."""
