"""What a verification says: one line for each thing it has checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes:
        name: short and stable.
        ok: whether it holds.
        words: what was found, and against what bound.
    """

    name: str
    ok: bool
    words: str


@dataclass(frozen=True, repr=False)
class Verification:
    """All checks of one refinement; true if every one holds."""

    checks: tuple[Check, ...]

    def __bool__(self) -> bool:
        return self.ok

    def __str__(self) -> str:
        return "\n".join(
            f"{'ok' if check.ok else 'FAILED':<7}{check.name:<15} {check.words}"
            for check in self.checks
        )

    def __repr__(self) -> str:
        failed = [check.name for check in self.checks if not check.ok]
        if not failed:
            return f"<Verification ok: {len(self.checks)} checks>"
        count = f"{len(failed)} of {len(self.checks)} checks"
        return f"<Verification FAILED: {count}: {', '.join(failed)}>"

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)

    def with_checks(self, checks: Sequence[Check]) -> Verification:
        """Add checks; one of the same name takes the place of the earlier one."""
        later = {check.name: check for check in checks}
        kept = [later.pop(check.name, check) for check in self.checks]
        return Verification((*kept, *later.values()))


def bounded(name: str, value: float, bound: float, what: str) -> Check:
    """Hold a number against a bound."""
    return Check(name, value <= bound, f"{what} {value:.2g}, allowed {bound:.2g}")
