"""Every sentence with which the program refuses something, found in its source, and its cure."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from chladni import errors

SOURCES = tuple(Path(__file__).parents[1] / name for name in ("src", "evidence"))
GAP = "…"  # stands for what the sentence fills in: a file, a line, a name, a number
_ROOMS = {  # what a sentence without its own cure is about, by the room that says it
    "io.nastran": "correct the deck at the named line; [Nastran cards](cards.md) says how",
    "io": "correct the file at the named line, or export it again: [From your lab]"
    "(../guide/from_your_lab.md)",
    "case": "correct the named word of `case.toml`; [A case, word by word](../case.md) lists all",
    "ema": "compare the recording with [From your lab](../guide/from_your_lab.md)",
    "cli": "`chladni COMMAND --help` states the form of each option; [commands](commands.md)",
    "chladni_planning": "[Planning a test](../tutorials/planning.md) shows a valid call",
    "chladni_studies": "[Parameter studies](../studies.md) list the forms",
    "chladni_bench": "[The virtual bench](../bench.md) lists excitations and settings",
    "chladni_contract": "[Extending](../extending.md) states the rules that every effect keeps",
    "chladni_evidence": "[The blind benchmark](../blind.md) states what each step needs",
    "chladni_specimens": "[Generated structures](../specimens.md) lists sizes and options",
    "effects": "[Effects](effects.md) lists what each needs",
    "fem": "correct the named part or card of the deck; `chladni check` shows all findings",
    "model": "correct the named part or card of the deck; `chladni check` shows all findings",
    "reduced": "[Troubleshooting](../guide/troubleshooting.md) leads to the cause",
    "inference": "[Troubleshooting](../guide/troubleshooting.md) leads to the cause",
    "search": "[Troubleshooting](../guide/troubleshooting.md) leads to the cause",
    "workflows": "`chladni check CASE` states what the command can use",
}
_REST = "pass arrays, labels and names as the [Python interface](python.md) states them"


@dataclass(frozen=True)
class Sentence:
    """One refusal.

    Attributes
    ----------
    room : package that raises it, or module of ``chladni``, with the format for those of ``io``
    kind : name of the exception
    text : the sentence, ``GAP`` where it fills something in
    """

    room: str
    kind: str
    text: str

    @property
    def cure(self) -> str:
        """The sentence's own advice after its last semicolon, else where to look."""
        advice = self.text.rpartition("; ")[2]
        if re.match("there (is|are) |the (same )?folder has ", advice):
            return "use one of those that it lists"
        if advice not in (self.text, GAP):
            return advice
        return _ROOMS.get(self.room) or _ROOMS.get(self.room.split(".")[0], _REST)


@cache
def sentences(*sources: Path) -> list[Sentence]:
    """Every refusal of the sources (default: ours), by room and text, equal ones once."""
    found = {
        Sentence(_room(path.relative_to(source)), kind, text)
        for source in sources or SOURCES
        for path in source.rglob("*.py")
        for kind, text in _made(ast.parse(path.read_text(encoding="utf-8")))
    }
    return sorted(found, key=lambda s: (s.room, s.text))


def _room(path: Path) -> str:
    package, room, *rest = path.with_suffix("").parts
    if package != "chladni":
        return package
    return f"{room}.{rest[0]}" if room == "io" and rest else room


def _made(tree: ast.AST) -> Iterator[tuple[str, str]]:
    """Kind and text of every exception of ``chladni.errors`` with a sentence."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args:
            if not isinstance(kind := vars(errors).get(node.func.id), type):
                continue
            text = re.sub(rf"{GAP}(\s*{GAP})+", GAP, _text(node.args[0])).strip()
            if issubclass(kind, BaseException) and re.search(r"[A-Za-z]{2}", text):
                yield node.func.id, text


def _text(node: ast.AST) -> str:
    """A string with gaps for what is not known before it is raised."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(map(_text, node.values))
    if isinstance(node, ast.BinOp):
        return _text(node.left) + _text(node.right)
    return GAP
