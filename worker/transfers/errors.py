"""What can go wrong with a file on its way."""

from __future__ import annotations

from meshcone.errors import InputError


class PassingError(InputError):
    """The other side did not do its part this time; another try may succeed."""
