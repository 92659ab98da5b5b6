"""What the screening of a recording finds: sentences with their channels, size and repair."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Severity = Literal["fault", "warning"]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a recording, or looks it.

    Attributes
    ----------
    kind : what it is, in a few words (duplicated channels, reversed sign, delay, ...)
    text : one sentence with the numbers
    severity : a fault is to be mended before anything is fitted; a warning is to be looked at
    channels : labels of the outputs (or inputs) it concerns; none: the whole chain
    repair : a line of case.toml or sensors.csv that would mend it, or what to do
    value : its size (a gain, a delay [s], a ratio, ...), nan where it has none
    """

    kind: str
    text: str
    severity: Severity = "fault"
    channels: tuple[str, ...] = ()
    repair: str = ""
    value: float = float("nan")


@dataclass(frozen=True)
class Check:
    """One thing that was looked at: what came out, in words; ``passed`` None: it could not be."""

    name: str
    result: str
    passed: bool | None = True


@dataclass(frozen=True)
class Screening:
    """What was looked at in a recording, and what was found."""

    name: str
    findings: tuple[Finding, ...] = ()
    checks: tuple[Check, ...] = ()

    @property
    def faults(self) -> tuple[Finding, ...]:
        """What is to be mended before anything is fitted."""
        return tuple(f for f in self.findings if f.severity == "fault")

    @property
    def sentence(self) -> str:
        """All of it in one sentence."""
        done = [c for c in self.checks if c.passed is not None]
        if not self.findings:
            return f"{self.name}: nothing found in {len(done)} checks"
        count = Counter(f.kind + _of(f.channels) for f in self.findings)
        kinds = ", ".join(f"{n} times {what}" if n > 1 else what for what, n in count.items())
        word = "at fault" if self.faults else "to be looked at"
        return f"{self.name} is {word}: {kinds}"

    @property
    def notes(self) -> tuple[str, ...]:
        """One sentence a finding, with its repair."""
        return tuple(
            f"{'Measurement fault' if f.severity == 'fault' else 'Look at this'}: {f.text}"
            + (f" Repair: {f.repair}." if f.repair else "")
            for f in self.findings
        )

    def with_more(self, findings: Sequence[Finding], checks: Sequence[Check]) -> "Screening":
        """The same with more of both; a channel that is known as bad is not named again."""
        known = {(f.kind, f.channels) for f in self.findings}
        fresh = tuple(f for f in findings if (f.kind, f.channels) not in known)
        return Screening(self.name, (*self.findings, *fresh), (*self.checks, *checks))


def _of(channels: Sequence[str]) -> str:
    return f" ({', '.join(channels)})" if channels else ""
