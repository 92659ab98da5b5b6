"""Drawings of the page of a diagnosis."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..case import Case
from ..effects.estimate import Location
from ..fem.modelled import Modelled
from ..inference.result import Agreement, LeftPlace
from ..workflows.diagnosis_result import DiagnosisResult
from . import live_curves, live_mesh, live_panels
from .drawings import Drawing, Drawings
from .figures import q_steps
from .level_blocks import moving
from .shown import Shown

MOST_MODES = 60  # of a matrix that can be read
_FRF = (
    "Drag to zoom, double-click to see all, click a name to hide its curve. White: fitted; grey: "
    "not fitted. Each mode of a deck has the damping identified for its partner in the test; "
    "without a partner, the damping of the case. Q belongs to the channel, over all lines."
)
_CAPTIONS = {
    "where": "Drag to turn, scroll to zoom, point at anything for its name.",
    "left": "Gain of a small local change of stiffness or mass, with the named effects in place. "
    "Grey: the test is blind there; half of the stiffness or mass could be missing.",
    "shapes": "The test shows motion at its sensors; the decks show the whole structure. Colour: "
    "share of the largest motion.",
    "mac": "Modal assurance criterion, test against model; framed: the pairs of the table.",
    "ladder": "Deviation of each frequency from the test.",
    "steps": "Deviation Q, step by step; dashed: the noise of the recording alone.",
    "odds": "2 ln Bayes factor of the best explanation against each; up to 2 is no evidence, "
    "more than 10 is very strong (Kass and Raftery, 1995). Point at a bar for its reason.",
}


def drawings(case: Case, result: DiagnosisResult, shown: Shown) -> Drawings:
    """Return all drawings that the result allows."""
    made = _modes(case, result, shown) | _scores(result) | _levels(result)
    if "test" in shown.curves:
        made["frf"] = Drawing(
            "responses", "frf", live_curves.frf(shown),
            ("frf_fitted", "frf_held_out", "frf", "frf_grid"), _FRF,
        )  # fmt: skip
    shared: dict[str, Any] = {}
    if len(shown.seen.faces) <= live_mesh.MOST_FACES:
        shared = {"mesh": live_mesh.mesh(shown)}
        found = {"spots": live_mesh.spots(_places(result), shown), "setup": live_mesh.setup(shown)}
        made["where"] = Drawing("structure", "first", found, ("where",), _CAPTIONS["where"])
        if result.residual_localisation is not None and len(result.residual_localisation.gain):
            left = live_mesh.left(result.residual_localisation.gain, shown)
            made["left"] = Drawing("remainder", "scores", left, ("left",), _CAPTIONS["left"])
    return Drawings(made, shared)


def _levels(result: DiagnosisResult) -> dict[str, Drawing]:
    """Modes that depend on the level, over it."""
    tables = result.levels
    names = {k: f"levels_{k + 1}" for k in moving(tables)}
    return {
        name: Drawing("panels", "levels", live_panels.over_levels(tables[k]), (name,))
        for k, name in names.items()
    }


def _places(result: DiagnosisResult) -> list[tuple[str, Location | LeftPlace]]:
    """Mark the places of named effects; without one, the place where the fit fails."""
    named = [(": ".join(t for t in (e.name, e.where.text) if t), e.where) for e in result.effects]
    if named or result.adequate is None:
        return list(named)
    return [(f"not explained: {place.text}", place) for place in result.adequate.where]


def _scores(result: DiagnosisResult) -> dict[str, Drawing]:
    made, rows = {}, [r for r in result.frequencies if r.test_hz]
    q = result.agreement or Agreement()
    sides = {name: q_steps(scores, bool(result.effects))
             for name, scores in (("fitted", q.fitted), ("held out", q.held_out))}  # fmt: skip
    if any(len(side) > 1 for side in sides.values()):
        data = live_curves.steps(sides, live_curves.floors(q.fitted, q.held_out))
        stills = ("waterfall", "held_out")
        made["steps"] = Drawing("steps", "scores", data, stills, _CAPTIONS["steps"])
    odds = live_curves.odds(result.effects, result.alternatives)
    if len(odds) > 1:
        made["odds"] = Drawing("odds", "why", {"bars": odds}, ("evidence",), _CAPTIONS["odds"])
    if rows:
        data = live_curves.ladder(rows)
        made["ladder"] = Drawing("ladder", "modes", data, ("frequencies",), _CAPTIONS["ladder"])
    return made


def stages(result: DiagnosisResult) -> dict[str, Modelled]:
    """Return the deck before and, if there is another, after."""
    if (models := result.models) is None:
        return {}
    found = {"before": models.nominal}
    return found | ({"after": models.final.model} if result.deck_changed else {})


def mac_of(
    case: Case, result: DiagnosisResult
) -> Mapping[str, tuple[np.ndarray, np.ndarray, list[tuple[int, int]]]]:
    """MAC (test, model) of each deck, the model's frequencies up to the test's, the pairs."""
    made = {}
    for name, model in stages(result).items():
        assert result.models is not None
        test = result.models.test
        if test.shapes is None or not len(test.frequency):
            return {}
        modes, every = test.near(model), [getattr(r, f"{name}_hz") for r in result.frequencies]
        modes = modes.sel(modes.frequency <= 1.1 * max([*filter(None, every), *test.frequency]))
        value = test.mac(case.outputs, model, modes)
        pairs = [(k, int(np.abs(modes.frequency - f).argmin())) for k, f in enumerate(every) if f]
        if value is not None and max(value.shape) <= MOST_MODES:
            made[name] = (value.T, modes.frequency, pairs)
    return made


def _modes(case: Case, result: DiagnosisResult, shown: Shown) -> dict[str, Drawing]:
    if result.models is None or not result.frequencies:
        return {}
    made, test = {}, result.models.test
    if len(shown.seen.faces) <= live_mesh.MOST_FACES:
        rows, decks = result.frequencies, stages(result)
        data = live_mesh.shapes(test, rows, decks, case.outputs, shown)
        if data["modes"]:
            made["shapes"] = Drawing("shapes", "modes", data, ("modes",), _CAPTIONS["shapes"])
    if found := mac_of(case, result):
        data = live_curves.mac_map(test.frequency, found)
        made["mac"] = Drawing("assurance", "modes", data, ("mac",), _CAPTIONS["mac"])
    return made
