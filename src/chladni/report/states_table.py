"""An object in several states: findings in each state, and shared parameters."""

import re

from ..effects.estimate import Estimate
from ..inference.result import Agreement
from ..workflows.diagnosis_result import DiagnosisResult, StateResult
from .blocks import Block, Table
from .words import interval, number, quantity


def state_folder(result: DiagnosisResult, k: int) -> str:
    """Folder of the k-th state within that of the run; the first state's is the run's own."""
    word = re.sub(r"[^A-Za-z0-9]+", "-", result.states[k].name).strip("-").lower()
    return f"state-{k + 1}-{word}".rstrip("-") if k else "."


def states_table(result: DiagnosisResult) -> list[Block]:
    """Tabulate each state with its effect, Q and folder, then the shared parameters."""
    if not result.states:
        return []
    rows = [_row(s, state_folder(result, k)) for k, s in enumerate(result.states)]
    heads = ("state", "verdict", "effect", "where", "size", "Q before", "Q after", "folder")
    words = ("state", "verdict", "effect", "where", "size", "folder")
    note = "Each state has its own decks and page; an effect belongs to one state."
    out: list[Block] = [Table(heads, rows, words, note)]
    if result.shared:
        shared = [
            (p.where, quantity(p.deck_value, p.estimate.unit), of_estimate(p.estimate))
            for p in result.shared
        ]
        said = "Shared by all states and fitted to all their recordings together."
        out.append(Table(("parameter", "deck", "all states"), shared, ("parameter",), said))
    return out


def _row(s: StateResult, folder: str) -> tuple[str, ...]:
    effects = s.result.effects
    fit = (s.result.agreement or Agreement()).fitted
    return (
        s.name or "(no name)",
        s.result.verdict,
        "; ".join(e.name for e in effects) or "–",
        "; ".join(e.where.text for e in effects) or "–",
        "; ".join(", ".join(f"{p.name} = {of_estimate(p)}" for p in e.parameters) for e in effects)
        or "–",
        number(fit.nominal),
        number(fit.after),
        folder,
    )


def of_estimate(p: Estimate) -> str:
    """A value with its interval."""
    return interval(p.value, p.low, p.high, p.unit)
