"""What a diagnostic can be: its code, its severity, what it is seen by and what it says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from snapbeam.core.findings import Diagnostic, Severity

__all__ = ["Kind", "table"]


@dataclass(frozen=True)
class Kind:
    """One kind of diagnostic.

    ``sees`` is what gives it away, for the table in the documentation; ``says`` its words, with the numbers in
    braces and the way out; ``options`` the arguments that are the way out, each also an option of the command
    line.
    """

    code: str
    severity: Severity
    sees: str
    says: str
    options: tuple[str, ...] = ()

    def found(self, severity: Severity | None = None, told: str = "", **numbers: float) -> Diagnostic:
        """The diagnostic with its numbers, in words; *told* stands for ``{told}`` in them."""
        words = self.says.format(told=told, **numbers)
        return Diagnostic(self.code, words, numbers, severity or self.severity)


def table(*kinds: Kind) -> Mapping[str, Kind]:
    """Kinds by the part of their code after the dot."""
    return {one.code.partition(".")[2]: one for one in kinds}
