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


# What it takes to call the refined file the optimum of a program that says something.
_OPTIMALITY = {
    *("refined file", "options", "settings", "alignment"),
    *("feasible", "stationary", "no gap", "complementary", "written"),
}
# What it takes besides, where faces of the source were divided.
_OF_DIVISION = {"division", "attributes"}


@dataclass(frozen=True, repr=False)
class Verification:
    """All checks of one refinement; true if every one holds."""

    checks: tuple[Check, ...]

    def __bool__(self) -> bool:
        return self.ok

    def __str__(self) -> str:
        lines = [
            f"{'ok' if check.ok else 'FAILED':<7}{check.name:<15} {check.words}"
            for check in self.checks
        ]
        return "\n".join([*lines, f"proven {self.proven}"])

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

    @property
    def proven(self) -> str:
        """What holds whatever else failed: closeness, optimality, the road."""
        held = {check.name: check.words for check in self.checks if check.ok}
        needed = _OPTIMALITY | (_OF_DIVISION & {check.name for check in self.checks})
        closeness = "how close the surfaces are: not proven"
        if "closeness" in held:
            closeness, _, _ = held["closeness"].rpartition(": ")  # how that was proven
        if "kept" in held:
            optimum = "the refined file is the source"
        elif held.keys() >= needed:
            optimum = "the refined file is the optimum of its last round"
        else:
            return f"{closeness}; that the refined file is an optimum: not proven"
        return "; ".join((closeness, optimum, held.get("road", "its rounds: not proven")))

    def with_checks(self, checks: Sequence[Check]) -> Verification:
        """Add checks; one of the same name takes the place of the earlier one."""
        later = {check.name: check for check in checks}
        kept = [later.pop(check.name, check) for check in self.checks]
        return Verification((*kept, *later.values()))


def bounded(name: str, value: float, bound: float, what: str) -> Check:
    """Hold a number against a bound."""
    return Check(name, value <= bound, f"{what} {value:.2g}, allowed {bound:.2g}")
