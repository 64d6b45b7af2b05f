"""How many bytes the files of one job may still have."""

from __future__ import annotations

from meshcone.errors import LimitError


class Budget:
    """Bytes that may still be fetched.

    Args:
        most: in all.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._left = most

    def require(self, size: int) -> None:
        """Refuse what is too large before any of it is taken.

        Raises:
            LimitError: there is not that much left.
        """
        if size > self._left:
            raise LimitError(
                f"the files to fetch have more than the {self._most} bytes that this installation "
                "fetches for one job (MESHCONE_FETCH_BYTES)"
            )

    def spend(self, size: int) -> None:
        """Take a part of it; raises as :meth:`require` does."""
        self.require(size)
        self._left -= size
