"""The reference, written from the program as it is: nothing on these pages is kept by hand.

``write`` fills a folder with one page each on exit codes, ``diagnosis.json``, the cards of a deck,
the effects, the environments, and each command and public object.
"""

import dataclasses
import inspect
import json
import re
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import command_pages
import effect_signatures
import error_sentences
import numpy as np
import object_pages
import tutorial_blocks
from page_parts import BY, plain, table

from chladni.search.candidates import UpdatingContext
from chladni_contract.effect_ground import GROUNDS, EffectGround, usual_grounds

ROOT = Path(__file__).parents[1]
SIGNATURES = "signatures"  # folder of the pictures of the effects
BLIND_SCORE = ROOT / "docs" / "blind_score.json"  # rows of the last blind report of each set


def pages() -> dict[str, Callable[[], str]]:
    """Name of every generated page, and the function that writes it."""
    return {
        "commands": command_pages.commands,
        "exit-codes": exit_codes,
        "error-sentences": refusals,
        "diagnosis-json": diagnosis_page,
        "cards": cards,
        "effects": effects,
        "decision-rules": decision_rules,
        "environments": environments,
        "python": object_pages.python_interface,
        **{
            f"commands/{name}": partial(command_pages.command_page, name)
            for name in command_pages.groups()
        },
        **{
            f"python/{name}": partial(object_pages.object_page, one)
            for name, one in object_pages.public_objects().items()
        },
    }


def write(folder: Path) -> None:
    """Write all pages, unless they are there and neither the program nor these scripts changed.

    A page that is as it was keeps its time, so that Sphinx passes it over.
    """
    kept, sources = folder / SIGNATURES / "key", [ROOT / n for n in ("src", "envs", "evidence")]
    pages_read = (BLIND_SCORE, command_pages.GALLERY, object_pages.EXAMPLES)
    key = tutorial_blocks.key_of("", *sources, *pages_read, *sorted((ROOT / "docs").glob("*.py")))
    made = {folder / f"{name}.md": page for name, page in pages().items()}
    there = {*folder.glob("commands/*.md"), *folder.glob("python/*.md")}
    if kept.is_file() and kept.read_text() == key and all(path.is_file() for path in made):
        return
    for gone in there - made.keys():
        gone.unlink()
    for path, page in made.items():
        text = page()
        path.parent.mkdir(exist_ok=True)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    kept.parent.mkdir(exist_ok=True)
    for name, one in signatures().items():
        effect_signatures.draw(folder / SIGNATURES / f"{name}.png", one)
    kept.write_text(key)


# --- exit codes ---------------------------------------------------------------------------------

_CODES = {
    "DONE": "The command did what was asked. A diagnosis that names nothing is also done.",
    "FAILED": "A fault of chladni itself. `--verbose` shows where it arose; report it.",
    "AT_FAULT": "The input is at fault. One sentence names the file, the line and the offender. "
    "Nothing is written.",
    "NOT_TRUSTED": "The command ran and its results are written, but they are not to be trusted. "
    "The sentence gives the reason; `distrust` in the JSON file holds it.",
    "INTERRUPTED": "The command was interrupted. The sentence says what is kept.",
}


_CURES = {  # what to do about each kind of error
    "ChladniError": "The sentence names what to change.",
    "ShapeError": "Give arrays and labels of the lengths that the sentence names.",
    "LabelError": "Choose one of the names in the sentence. `chladni check CASE` lists those of a "
    "case.",
    "FileError": "Correct the file at the named line, or name another file. `chladni check CASE` "
    "checks all files of a case in seconds.",
    "ModelError": "Correct the named part of the deck: thickness, material, tie or support. "
    "[Nastran cards](cards.md) lists what is read.",
    "AccuracyError": "Read the reason in `distrust`. "
    "[Troubleshooting](../guide/troubleshooting.md) leads from it to the cause.",
    "ArgumentError": "Give the argument the type or the range that the sentence names.",
    "Interrupted": "Run the command again. A study continues with the samples that are kept.",
    "ExtensionError": "Update the named package, or uninstall it.",
}


def exit_codes() -> str:
    """Exit codes, and the kinds of error behind them, from the program's own constants."""
    from chladni import errors
    from chladni.cli import app

    rows = [(f"`{getattr(app, name)}`", meaning) for name, meaning in _CODES.items()]
    kinds = [
        (f"`{name}`", plain(kind.__doc__).split("\n\n")[0], _code(kind, errors, app), _CURES[name])
        for name, kind in vars(errors).items()
        if inspect.isclass(kind) and issubclass(kind, BaseException)
        and kind.__module__ == errors.__name__
    ]  # fmt: skip
    return "\n".join(
        [
            "# Exit codes and errors\n",
            BY.format("`chladni.cli.app` and `chladni.errors`"),
            table(("code", "meaning"), rows),
            "An error is one sentence on standard error. It names the file, the line, what is "
            "wrong with it and what is possible there. In Python the same sentence is the message "
            "of an exception from `chladni.errors`:\n",
            table(("exception", "meaning", "exit code", "cure"), kinds),
            "[Error sentences](error-sentences.md) lists every sentence with its cure.\n",
        ]
    )


def refusals() -> str:
    """Every sentence that refuses something, by the room that says it."""
    from chladni import errors
    from chladni.cli import app

    out = [
        "# Error sentences\n",
        BY.format("the exceptions in its source"),
        f"`{error_sentences.GAP}` stands for a file, a line, a name or a number. The cure is the "
        "advice of the sentence itself, after its last semicolon. Where it has none, the cure is "
        "the place to look. Search this site for a few words of your message.\n",
    ]
    every = error_sentences.sentences()
    for room in dict.fromkeys(s.room for s in every):
        own = [s for s in every if s.room == room]
        rows = [(_code_text(s.text), _code(vars(errors)[s.kind], errors, app), s.cure)
                for s in own]  # fmt: skip
        out += [f"## {room}\n", table(("sentence", "exit code", "cure"), rows)]
    return "\n".join(out)


def _code_text(text: str) -> str:
    """A sentence as code, which Markdown leaves as it is."""
    fence = "``" if "`" in text else "`"
    return f"{fence}{text}{fence}"


def _code(kind: type, errors: Any, app: Any) -> str:
    if issubclass(kind, KeyboardInterrupt):
        return f"`{app.INTERRUPTED}`"
    return f"`{app.NOT_TRUSTED if issubclass(kind, errors.AccuracyError) else app.AT_FAULT}`"


# --- diagnosis.json -----------------------------------------------------------------------------


def diagnosis_page() -> str:
    """``diagnosis.json`` key by key: names from the writer, meanings from its dataclasses."""
    rows = [(f"`{path}`", kind, meaning) for path, kind, meaning in json_keys()]
    return "\n".join(
        [
            "# diagnosis.json\n",
            BY.format("`chladni.report.diagnosis_json` and the classes that it writes"),
            "`chladni diagnose` and `chladni calibrate` write it. All numbers are in SI unless the "
            "key names another unit. `[]` marks each element of a list. A key without a value is "
            "`null`. `chladni.report.diagnosis_json.read_diagnosis` reads it back.\n",
            table(("key", "type", "meaning"), rows),
        ]
    )


_CLASSES = {  # of the objects in the file, by their path; the first that knows a key explains it
    "": ("DiagnosisResult",),
    "effects[]": ("NamedEffect",),
    "effects[].where": ("Location",),
    "effects[].parameters[]": ("Estimate",),
    "alternatives[]": ("Alternative",),
    "alternatives[].where": ("Location",),
    "fit": ("Scores", "Agreement"),
    "fit.held_out": ("Scores", "Agreement"),
    "calibrated[]": ("CalibratedParameter", "Estimate"),
    "adequate": ("Adequacy",),
    "adequate.where[]": ("LeftPlace",),
    "adequate.statistics[]": ("FitStatistic",),
    "mass": ("MassComparison",),
    "frequencies[]": ("FrequencyRow",),
    "structured": ("Remainder",),
    "screening": ("Screening",),
    "screening.findings[]": ("Finding",),
    "screening.checks[]": ("Check",),
    "frequency_rms_percent": ("FrequencyError",),
    "recordings[]": ("RecordingScore",),
    "levels[]": ("LevelTable",),
    "levels[].rows[]": ("LevelRow",),
    "levels[].elements[]": ("TriedElement",),
    "levels[].elements[].numbers[]": ("ElementNumber",),
    "joints[]": ("LinearJoint",),
    "states[]": ("StateResult", "DiagnosisResult"),
    "shared[]": ("CalibratedParameter", "Estimate"),
}
_FIELDS = {  # key of the file: field of its class, where the two differ
    "fit": "agreement",
    "frequency_rms_percent": "frequency_error",
    "gain_over_calibration": "two_log_bayes_factor",
    "largest_gain": "largest_two_log_bayes_factor",
    "is": "structured",
    "state": "name",
}


def json_keys() -> list[tuple[str, str, str]]:
    """Path, type and meaning of every key that a diagnosis can write.

    Raises
    ------
    KeyError
        If the class of a key does not document it.
    """
    from chladni.report.diagnosis_json import _Q, diagnosis_json
    from chladni.workflows.diagnosis_result import DiagnosisResult

    classes = {kind.__name__: kind for kind in _classes(DiagnosisResult, set())}
    written = json.loads(json.dumps(diagnosis_json(_example(DiagnosisResult, frozenset()))))
    return [*_walk(written, "", classes, _Q)]


def _walk(
    value: Any, path: str, classes: Mapping[str, type], scores: Mapping[str, str]
) -> typing.Iterator[tuple[str, str, str]]:
    if path not in _CLASSES:
        return
    known: dict[str, str] = {}
    for name in reversed(_CLASSES[path]):
        known |= attributes(classes[name])
    for key, inner in value.items():
        if path == "states[]" and key != "state":
            continue  # all other keys of a state are those of the whole
        field = scores.get(key) or _FIELDS.get(key, key)
        below, rows = f"{path}.{key}".lstrip("."), inner
        while isinstance(rows, list) and rows and isinstance(rows[0], dict | list):
            below, rows = f"{below}[]", rows[0]
        if field not in known and below not in _CLASSES:
            raise KeyError(f"{below}: {_CLASSES[path]} do not document {field}")
        yield f"{path}.{key}".lstrip("."), _kind(inner), known.get(field, "")
        if isinstance(rows, dict):
            yield from _walk(rows, below, classes, scores)


def _kind(value: Any) -> str:
    if isinstance(value, list):
        return f"list of {_kind(value[0])}s" if value else "list"
    names = {
        bool: "true or false",
        str: "text",
        int: "whole number",
        float: "number",
        dict: "object",
    }
    return names.get(type(value), "number")


def _classes(kind: type, seen: set[type]) -> set[type]:
    """A dataclass and all that its fields hold."""
    if kind not in seen:
        seen.add(kind)
        for hint in typing.get_type_hints(kind).values():
            for inner in _within(hint):
                _classes(inner, seen)
    return seen


def _example(hint: Any, above: frozenset[type]) -> Any:
    """A value of a type in which no field is empty; a class within itself stays empty."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return _example(next(i for i in inner if i is not type(None)), above)
    if origin is tuple:
        one = _example(inner[0], above)
        return () if one is None else (one,) * (1 if inner[-1] is ... else len(inner))
    if origin is typing.Literal:
        return inner[0]
    if origin in (dict, Mapping):
        return {"deck": "updated.bdf"}
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        hints = typing.get_type_hints(hint)
        if hint in above:
            return hint()
        if hint.__name__ in ("UpdatedModels", "LeftWhere", "ResidualLocalisation"):
            return None
        own = {f.name: _example(hints[f.name], above | {hint}) for f in dataclasses.fields(hint)}
        return hint(**own)
    return {str: "text", float: 1.5, int: 1, bool: True}.get(hint)


def _within(hint: Any) -> list[type]:
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return [hint]
    return [k for inner in typing.get_args(hint) for k in _within(inner)]


def attributes(kind: type) -> dict[str, str]:
    """Meaning by name: the section Attributes of a docstring, or the comments at the fields.

    A comment stands behind its field or above it; ``# low, high: ends [m]`` is of both.
    """
    section = re.split(r"\nAttributes\n-+\n", inspect.cleandoc(kind.__doc__ or ""))
    rows = section[1].split("\n\n")[0].splitlines() if len(section) > 1 else []
    above: list[str] = []
    for line in inspect.getsource(kind).splitlines():
        comment = re.fullmatch(r"    # (.*)", line)
        field = re.match(r"    (\w+): ", line)
        if comment:
            above.append(comment[1])
        elif field:
            said = [*above, *re.findall(r"  # (.*)", line)]
            grouped = re.match(r"\w+(?:, \w+)+: ", said[0]) if said else None
            if grouped:
                rows += [said[0].replace(": ", " : ", 1), *(f"    {x}" for x in said[1:])]
            elif said:
                rows += [f"{field[1]} : {said[0]}", *(f"    {x}" for x in said[1:])]
            above = []
    out: dict[str, str] = {}
    names: list[str] = []
    for line in rows:
        head = re.match(r"(\w+(?:, \w+)*) : (.*)", line)
        if head:
            names = head[1].split(", ")
        for name in names:
            text = head[2] if head else line.strip()
            out[name] = f"{out.get(name, '')} {text}".strip()
    return out


# --- cards --------------------------------------------------------------------------------------


def cards() -> str:
    """The cards that are read, written, left out and refused, from the reader's own tables."""
    from chladni.io.nastran.read import analysis_requests
    from chladni.io.nastran.text import known_cards
    from chladni.io.nastran.text.cards import FIELDS, LEGACY

    left_out = analysis_requests.LEFT_OUT
    harmless = known_cards.HARMLESS.keys() - left_out.keys()
    on_sol = sorted(set(known_cards.FOLLOWS_TEMPERATURE))
    return "\n".join(
        [
            "# Nastran cards\n",
            BY.format("the tables of `chladni.io.nastran`"),
            "`chladni check DECK` says which of these a deck holds.\n",
            "## Read\n",
            table(("card", "fields that are known"), [(f"`{n}`", f"`{' '.join(f)}`")
                                                      for n, f in sorted(FIELDS.items())]),
            "`-` is a field that is always blank. Cards of the public-domain COSMIC release are "
            f"read as their kin of today: {_names(sorted(LEGACY))}.\n",
            "Parameters (`PARAM`) that are heeded: "
            f"{_names(sorted(analysis_requests._HEEDED))}.\n",
            "## Written\n",
            "An updated deck keeps every line of the given deck but those that change. These "
            "cards hold the effects:\n",
            table(("card", "effects that it holds"), _written()),
            "A whole deck (`chladni specimen`, `chladni.io.nastran.write_assembly`) writes: "
            f"{_names(_exported())}.\n",
            "## Left out, with a note\n",
            table(("card", "what is left out"), [(f"`{n}`", t) for n, t in sorted(left_out.items())
                                                 if n not in on_sol]),
            f"Materials that follow temperature: {_names(on_sol)}.\n",
            "## Passed over\n",
            "These cards change no linear model of stiffness, mass, damping and harmonic loads.\n",
            table(("cards", "meaning"), _grouped(known_cards.HARMLESS, harmless)),
            "## Refused\n",
            "These cards carry stiffness, mass or a tie and are not understood. A card with any "
            "other name is refused too, because it may change the structure.\n",
            table(("cards", "meaning"), _grouped(known_cards.REFUSED, known_cards.REFUSED)),
            "These are refused where the case control selects them, and in a deck without one.\n",
            table(("cards", "meaning"), _grouped(known_cards.SELECTED, known_cards.SELECTED)),
            "`--allow NAME`, or `allow = [\"NAME\"]` in `[model]` of a case, passes "
            "over a card although it is not understood.\n",
        ]
    )  # fmt: skip


def _grouped(meaning: Mapping[str, str], names: Iterable[str]) -> list[tuple[str, str]]:
    """(cards, their meaning) of these names."""
    wanted = sorted(names)
    groups = dict.fromkeys(meaning.values())
    return [(_names(n for n in wanted if meaning[n] == what), what) for what in groups]


def _names(names: Iterable[str]) -> str:
    return ", ".join(f"`{n}`" for n in names)


def _written() -> list[tuple[str, str]]:
    from chladni.effects.registry import BUILT_IN

    held: dict[str, list[str]] = {}
    for family in BUILT_IN:
        for card in family.cards:
            held.setdefault(card, []).append(family.name)
    return [(f"`{card}`", ", ".join(names)) for card, names in sorted(held.items())]


def _exported() -> list[str]:
    """Names of the cards that the modules of the export hold as text."""
    from chladni.io.nastran.text.cards import FIELDS

    folder = ROOT / "src/chladni/io/nastran/export"
    source = "".join(p.read_text(encoding="utf-8") for p in sorted(folder.glob("*.py")))
    return sorted(n for n in FIELDS if re.search(rf"[\"']{n}\b", source))


# --- effects ------------------------------------------------------------------------------------


def effects() -> str:
    """The catalogue of effects, from the registry."""
    from chladni.effects.registry import BUILT_IN

    grounds = _Grounds()
    rows = [(f"[{f.name}](#{f.name})", f.effect.claim) for f in BUILT_IN]
    return "\n".join(
        [
            "# Effects\n",
            BY.format("the registry `chladni.effects.registry`"),
            "An effect is physics that a deck may lack. A diagnosis tries every effect for which "
            "structure and test have what it needs. [How to add an effect](../extending.md) of "
            "your own.\n",
            table(("effect", "its claim"), rows),
            "Each table of values states what an effect would report before any data: its "
            "prior, with the interval of 95 %. Many of these scale with the structure. "
            "The values shown are those of a steel plate of 400 x 300 x 1.5 mm, or of two such "
            "plates that are joined. Where a scale comes from stands in "
            "[the table of scales](../method.md).\n",
            "Each picture shows a signature: one response and the frequencies of these plates, "
            "without and with the effect. The virtual bench drew its size and place. "
            f"Both have {100 * effect_signatures.DAMPING:.0f} % of damping. × marks a mode "
            "without a partner.\n",
            *(_effect(f, grounds) for f in BUILT_IN),
        ]
    )


def _effect(family: Any, grounds: "_Grounds") -> str:
    kind = family.effect
    needs = f"{family.needs}; " if family.needs else ""
    by_poles, example = grounds.proposed(family)
    compared = "frequency responses or natural frequencies" if by_poles else "frequency responses"
    on = "shells" if family.on_sheets else "shells or beams"
    held = _names(family.cards) if family.cards else f"none: {family.no_cards}"
    rows = [
        ("acts on", f"{needs}{on}"),
        ("data", compared),
        ("where it is sought", _first(family.candidates or family.placed)),
        ("easily mistaken for", ", ".join(f"[{n}](#{n})" for n in _kin(family.name)) or "–"),
        ("told apart", f"{family.settled_by}" if family.settled_by else "–"),
        ("cards", held),
        ("concealed by the bench", _first(family.conceal)),
        ("named right in the last blind report", _named_right(family.name)),
    ]
    params = [] if example is None else _prior(example)
    heads = ("reported value", "unit", "at the prior's centre", "95 % of the prior")
    body = re.sub(r"\nAttributes\n-+\n.*", "", plain(kind.__doc__), flags=re.DOTALL)
    return "\n".join(
        [
            f"## {family.name}\n",
            f"**{kind.claim[0].upper()}{kind.claim[1:]}.**\n",
            f"{body}\n",
            f"![Signature of {family.name}]({SIGNATURES}/{family.name}.png)\n",
            table(("", ""), rows),
            table(heads, params) if params else "",
        ]
    )


def signatures() -> dict[str, effect_signatures.Signature]:
    """Signature of every built-in effect by its name."""
    from chladni.effects.registry import BUILT_IN

    grounds = _Grounds()
    return {f.name: effect_signatures.signature(f, grounds.of(f).article) for f in BUILT_IN}


def _named_right(name: str) -> str:
    """Share of the cases with this effect that were named right, from the kept score."""
    if not BLIND_SCORE.is_file():
        return "not measured: no report is kept"
    rows = json.loads(BLIND_SCORE.read_text(encoding="utf-8"))
    outcomes = [row["outcome"] for row in rows if row["effect"] == name]
    right = sum(outcome == "right" for outcome in outcomes)
    return f"{right} of {len(outcomes)}" if outcomes else "not measured: in no case of it"


def _first(function: Any) -> str:
    """First paragraph of a docstring, without its full stop."""
    return plain(function.__doc__).split("\n\n")[0].rstrip(".") if function else "–"


def _kin(name: str) -> list[str]:
    """Effects that change the same operator, as the blind benchmark groups them."""
    from chladni.effects.registry import names
    from chladni_evidence import outcome_row

    there = names()
    return sorted({n for kin in outcome_row.KIN if name in kin for n in kin if n in there} - {name})


def _prior(effect: Any) -> list[tuple[str, ...]]:
    """The values that the effect would report before any data."""
    mean, sd = (np.array([getattr(p, of) for p in effect.parameters]) for of in ("mean", "sd"))
    return [
        (e.name, e.unit, f"{e.value:.3g}", "" if e.low is None else f"{e.low:.3g} to {e.high:.3g}")
        for e in effect.reported(mean, sd)
    ]


class _AtMean(UpdatingContext):
    """A search with natural frequencies that starts each effect at its mean: what is proposed."""

    def optima(self, effect: Any) -> list[np.ndarray]:
        """The mean of the prior alone."""
        return [np.array([p.mean for p in effect.parameters])]


class _Grounds:
    """The structures on which the contract of the effects is checked, each built when needed."""

    def __init__(self) -> None:
        self.built: dict[str, EffectGround] = {}

    def proposed(self, family: Any) -> tuple[bool, Any]:
        """True if natural frequencies alone suffice; and an example of the effect."""
        ground = self.of(family)
        given = ground.by_poles
        by_poles = family.proposed(_AtMean(given.problem, given.null_fit))
        found = [*family.proposed(ground.by_responses), *by_poles]
        return bool(by_poles), found[0].effect if found else None

    def of(self, family: Any) -> EffectGround:
        """The structure that has what an effect acts on."""
        name = usual_grounds(family)[0]
        if name not in self.built:
            self.built[name] = GROUNDS[name]()
        return self.built[name]


# --- decision -----------------------------------------------------------------------------------


def decision_rules() -> str:
    """Every rule of a decision with its number, from their dataclass."""
    from chladni.search.decision_rules import DecisionRules

    rows = [
        (f"`{f.name}`", f"`{f.default}`", f.metadata["why"])
        for f in dataclasses.fields(DecisionRules)
    ]
    return "\n".join(
        [
            "# Rules of the decision\n",
            BY.format("`chladni.search.decision_rules`"),
            "Gains are in -2 ln evidence. *Due* is the gain that a name needs. "
            "[Decision](../theory/decision.md) explains the road.\n",
            table(("rule", "value", "purpose"), rows),
        ]
    )


# --- environments -------------------------------------------------------------------------------


def environments() -> str:
    """The docstring of every environment, which is its specification."""
    from importlib import import_module

    from chladni_envs import IDS

    out = ["# Environments\n", BY.format("the docstrings of `chladni_envs`")]
    for name, entry in IDS.items():
        module, kind = entry.split(":")
        text = plain(getattr(import_module(module), kind).__doc__)
        out.append(f"## {name}\n\n{_sections(text)}\n")
    return "\n".join(out)


def _sections(text: str) -> str:
    """Headed paragraphs with their head in bold; the parameters as a block."""
    before, _, after = text.partition("\nParameters\n")
    before = re.sub(r"^([A-Z]\w+)\n((?:    .*\n?)+)", _definition, before, flags=re.MULTILINE)
    rows, _, rest = re.sub(r"^-+\n", "", after).partition("\n\n")
    return f"{before}\n\nParameters:\n\n```text\n{rows}\n```\n\n{rest}" if rows else before


def _definition(found: re.Match[str]) -> str:
    return f"**{found[1]}.** {' '.join(found[2].split())}\n\n"
