"""Exceptions: misuse and failed self-checks raise; a fit that did not converge is a status.

Every message is one sentence for the user: it names the file, the line, the offender and the
alternatives. The command line prints it and exits with 2 (:class:`ChladniError`) or 3
(:class:`AccuracyError`: ran, but the result is not to be trusted).
"""

import difflib
import re
import unicodedata
from collections.abc import Iterable

LONGEST = 120  # characters of a value of a file that a sentence repeats
_WHOLE = 4000  # characters of a sentence
_QUOTED = re.compile(r"""(?<!\w)(?:'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")(?!\w)""", re.DOTALL)
_WORD = re.compile(r"[^\s/\\]{400,}")


def shortened(text: str, most: int = LONGEST) -> str:
    """The beginning of a long text, for a sentence; a quotation stays one.

    >>> shortened("abc"), shortened("'aaaaaaaaaaaaa'", 6)
    ('abc', "'aaaaa ...'")
    """
    if len(text) <= most + 5:
        return text
    end = text[0] if text[0] in "'\"" and text[-1] == text[0] else ""
    return f"{text[:most].rstrip(chr(92))} ...{end}"


def plain_line(text: str) -> str:
    """Text without what would steer a terminal: names in files may hold anything.

    >>> plain_line("a" + chr(27) + "[31mb")
    'a?[31mb'
    """
    return "".join("?" if _steers(c) else c for c in text)


def _steers(c: str) -> bool:
    return c not in "\n\t" and unicodedata.category(c) in ("Cc", "Cf", "Cs")


def _sentence(text: str) -> str:
    """A message for the user: what it quotes of a file is shortened, and steers no terminal."""
    if len(text) > LONGEST:
        for long in (_QUOTED, _WORD):
            text = long.sub(lambda found: shortened(found[0]), text)
        if len(text) > _WHOLE:
            text = f"{text[: _WHOLE // 2]} ... {text[-_WHOLE // 2 :]}"
    return text if text.isascii() and text.isprintable() else plain_line(text)


class ChladniError(Exception):
    """Root of every exception raised on purpose by this package."""

    def __init__(self, *words: object) -> None:
        super().__init__(*(_sentence(w) if isinstance(w, str) else w for w in words))


class ShapeError(ChladniError, ValueError):
    """Arrays or label lists that do not fit together."""


class LabelError(ChladniError, LookupError):
    """A degree of freedom, part, grid or parameter that does not exist."""


class ArgumentError(ChladniError, TypeError):
    """An argument of another type than the function takes, or one that it does not have."""


class FileError(ChladniError, ValueError):
    """A deck, recording or case file that cannot be used as it stands."""


def named(items: Iterable[object], most: int = 6) -> str:
    """The first of some things for a sentence, and how many more there are.

    >>> named(["a", 2, 0.25]), named(range(9), 3), named([])
    ('a, 2, 0.25', '0, 1, 2 and 6 more', 'none')
    """
    every = [f"{x:.6g}" if isinstance(x, float) else shortened(str(x)) for x in items]
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return (", ".join(every[:most]) or "none") + more


def nearest(word: str, known: Iterable[str], alike: float = 0.5) -> str:
    """The name that a word resembles most, "" where it resembles none.

    Parameters
    ----------
    alike : share of what two words have in common, from which on they are alike
    """
    return next(iter(difflib.get_close_matches(word[:LONGEST], list(known), 1, alike)), "")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """What was meant, as a question before the list of what there is; "" where that is not clear.

    >>> did_you_mean("bnad", ["band", "test"]), did_you_mean("x", ["band", "test"])
    ("did you mean 'band'? ", '')
    """
    near = nearest(word, known)
    return f"did you mean {near!r}? " if near else ""


def not_text(error: UnicodeDecodeError) -> str:
    """Where a file ceases to be UTF-8 text, in words."""
    line = error.object[: error.start].count(b"\n") + 1
    byte = f"byte {error.start + 1} (line {line}) is {error.object[error.start]:#04x}"
    return f"not UTF-8 text: {byte}; save it as UTF-8"


class ModelError(ChladniError, ValueError):
    """A model without physical sense: zero thickness, a part that hangs on nothing."""


class AccuracyError(ChladniError, ArithmeticError):
    """A computed result failed the check its own theory provides; each argument is one reason."""

    def __str__(self) -> str:
        return "\n".join(map(str, self.args))


class Interrupted(KeyboardInterrupt):
    """The user stopped a run that had something to keep; the sentence says what and where."""


class ExtensionError(ChladniError, ImportError):
    """A package that adds to this one and cannot be used as it stands."""
