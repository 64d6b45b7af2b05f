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


class Share:
    """What one answer takes of a budget: its bytes as they come or unpacked, whichever are more.

    Args:
        budget: of the whole job.
    """

    def __init__(self, budget: Budget) -> None:
        self._budget = budget
        self._spent = self._received = self._unpacked = 0

    def receive(self, size: int) -> None:
        """Count bytes as they have come; raises as :meth:`Budget.require` does."""
        self._received += size
        self._settle(self._received)

    def unpack(self, size: int) -> None:
        """Count bytes that were unpacked of those; raises as :meth:`Budget.require` does."""
        self._unpacked += size
        self._settle(self._unpacked)

    def _settle(self, size: int) -> None:
        if size > self._spent:
            self._budget.spend(size - self._spent)
            self._spent = size
