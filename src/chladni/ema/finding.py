"""Findings of the screening of a recording: sentences with channels, size and repair."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ..errors import named

Severity = Literal["fault", "warning", "mended"]
_BEGINS = {"fault": "Measurement fault", "warning": "Look at this", "mended": "Mended"}
TINY = 1e-12  # a smaller probability is a word, not a number


def probability(p: float) -> str:
    """A probability in a sentence, however small.

    >>> probability(0.03), probability(0.0)
    ('p = 0.03', 'p < 1e-12')
    """
    return f"p = {p:.1g}" if p >= TINY else f"p < {TINY:g}"


@dataclass(frozen=True)
class Finding:
    """One fault, or possible fault, of a recording."""

    kind: str  # what it is, in a few words (duplicated channels, reversed sign, delay, ...)
    text: str  # one sentence with the numbers
    # a fault is to be mended before anything is fitted; a warning is to be checked; what was a
    # fault is mended where the diagnosis applied ``mend``
    severity: Severity = "fault"
    # labels of the outputs (or inputs) it concerns; none: the whole chain
    channels: tuple[str, ...] = ()
    repair: str = ""  # a line of case.toml or sensors.csv that would mend it, or what to do
    # its size (a gain, a delay [s], a ratio, ...), nan where it has none
    value: float = float("nan")
    # name and arguments of the map of the FRFs (:mod:`.frf_maps`) that undoes it exactly; none
    # where no map does, or the cause is not beyond doubt
    mend: tuple[str, ...] = ()
    # Q that it leaves and the average over outputs in it, where physics may leave less; such a
    # finding is a warning until a diagnosis compares both
    left: tuple[float, Literal["median", "mean"]] | None = None


@dataclass(frozen=True)
class Check:
    """One check and its result."""

    # name, result: in words
    name: str
    result: str
    passed: bool | None = True  # None if the check was not possible


@dataclass(frozen=True)
class Screening:
    """Checks of a recording and their findings.

    Attributes
    ----------
    name : of the recording
    findings, checks : what was found, and what was looked at
    sentence : the summary
    """

    name: str
    findings: tuple[Finding, ...] = ()
    checks: tuple[Check, ...] = ()

    @property
    def faults(self) -> tuple[Finding, ...]:
        """Findings to repair before any fit."""
        return tuple(f for f in self.findings if f.severity == "fault")

    @property
    def sentence(self) -> str:
        """Summary of the findings in one sentence."""
        done = [c for c in self.checks if c.passed is not None]
        if not self.findings:
            return f"{self.name}: no fault found in {len(done)} checks"
        count = Counter(f.kind + _of(f.channels) for f in self.findings)
        kinds = ", ".join(f"{n} times {what}" if n > 1 else what for what, n in count.items())
        word = "at fault" if self.faults else "to be checked"
        if all(f.severity == "mended" for f in self.findings):
            word = "mended"
        return f"{self.name} is {word}: {kinds}"

    @property
    def notes(self) -> tuple[str, ...]:
        """One sentence a finding, with its repair."""
        return tuple(
            f"{_BEGINS[f.severity]}: {f.text}" + (f" Repair: {f.repair}." if f.repair else "")
            for f in sorted(self.findings, key=lambda f: f.severity != "mended")
        )

    @property
    def mended(self) -> tuple[str, ...]:
        """Sentence on each fault that was undone before the fit."""
        return tuple(f.text for f in self.findings if f.severity == "mended")

    def with_more(self, findings: Sequence[Finding], checks: Sequence[Check]) -> "Screening":
        """Add findings and checks; a fault already known for a channel is not repeated."""
        known = {(f.kind, f.channels) for f in self.findings}
        fresh = tuple(f for f in findings if (f.kind, f.channels) not in known)
        return Screening(self.name, (*self.findings, *fresh), (*self.checks, *checks))


def of_all(screenings: Sequence[Screening]) -> str:
    """Summarise the findings of several recordings in one sentence, each kind once; "" if none.

    >>> turned, late = Finding("reversed sign", "..."), Finding("delay", "...", "warning")
    >>> of_all([Screening("a", (turned,)), Screening("b", (turned, late)), Screening("c")])
    'at fault: reversed sign in a, b; to be checked: delay in b'
    """
    said = []
    words = (("fault", "at fault"), ("warning", "to be checked"), ("mended", "mended"))
    for severity, word in words:
        where: dict[str, list[str]] = {}
        for s in screenings:
            for f in s.findings:
                if f.severity == severity:
                    where.setdefault(f.kind + _of(f.channels), []).append(s.name)
        kinds = [f"{what} in {which(names, screenings)}" for what, names in where.items()]
        said += [f"{word}: {', '.join(kinds)}"] if kinds else []
    return "; ".join(said)


def notes_of_all(screenings: Sequence[Screening]) -> list[str]:
    """Return one sentence per finding, with the recordings that have it if there are several."""
    where: dict[str, list[str]] = {}
    for s in screenings:
        for note in s.notes:
            where.setdefault(note, []).append(s.name)
    several = len(screenings) > 1
    return [
        f"{note} ({which(names, screenings)})" if several else note for note, names in where.items()
    ]


def which(names: Sequence[str], every: Sequence[object]) -> str:
    """Name the recordings, or return "all n recordings" if they are all of three or more."""
    each = list(dict.fromkeys(names))
    if len(each) == len(every) > 2:
        return f"all {len(every)} recordings"
    return named(each, 3)


def _of(channels: Sequence[str]) -> str:
    return f" ({', '.join(channels)})" if channels else ""
