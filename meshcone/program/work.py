"""Work that solving may take, counted where a clock would not repeat."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Allowance:
    """What a solve may still do; it falls as it is used.

    Attributes:
        systems: linear systems that the dual method may still begin.
        products: products with a program's matrix that it may still take in them.
    """

    systems: int
    products: int

    @property
    def is_spent(self) -> bool:
        """Whether nothing more may be begun."""
        return self.systems <= 0 or self.products <= 0
