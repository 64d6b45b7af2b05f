"""``meshcone submit``: one job, done by a service."""

from __future__ import annotations


def command() -> None:
    """Send SOURCE and REFERENCE to a service."""
