"""Results of all functions of the package: in words, drawn, saved, shown in a notebook."""

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, fields, is_dataclass
from html import escape
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from .arguments import checked
from .errors import LabelError, ModelError, did_you_mean, named, plain_line
from .output import atomic, run_folder

_WIDEST = 72  # characters of one value


class ShownBriefly:
    """Data that show themselves briefly: each field with its number, its size or its type."""

    def __repr__(self) -> str:
        said = ", ".join(f"{name}={text}" for name, text in self._in_brief().items())
        return f"{type(self).__name__}({said})"

    def _repr_html_(self) -> str:
        """Return the fields as a table for a notebook."""
        rows = "".join(
            f'<tr><th style="text-align:left">{escape(name)}</th>'
            f'<td style="text-align:left">{escape(text)}</td></tr>'
            for name, text in self._in_brief().items()
        )
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"

    def _in_brief(self) -> dict[str, str]:
        values = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        return {name: in_brief(value) for name, value in values.items()}


def in_brief(value: object) -> str:
    """Text of a value in at most 72 characters: what is long by its size or its type.

    >>> in_brief((20.0, 200.0)), in_brief(range(1000)), in_brief(["a" * 100])
    ('(20.0, 200.0)', '1000 x int', '1 x str')
    """
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return f"{value.shape} {value.dtype}"
    if isinstance(value, Path):
        value = str(value)
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if isinstance(value, str):
        text = repr(value)
        return text if len(text) <= _WIDEST else f"{text[: _WIDEST - 4]}...{text[0]}"
    if value is None or isinstance(value, int | float | complex):
        return repr(value)
    if isinstance(value, Mapping | Sequence | Set):
        plain = all(x is None or isinstance(x, int | float | complex | str) for x in value)
        if not isinstance(value, Mapping) and plain and len(value) <= 8:
            if len(text := repr(value)) <= _WIDEST:
                return text
        kinds = dict.fromkeys(type(x).__name__ for x in _held(value))
        return f"{len(value)} x {' or '.join([*kinds][:3])}" if value else repr(value)
    return f"{type(value).__name__}(...)" if is_dataclass(value) else type(value).__name__


def _held(value: Mapping[Any, Any] | Sequence[Any] | Set[Any]) -> Iterable[Any]:
    return value.values() if isinstance(value, Mapping) else value


@dataclass(frozen=True, repr=False)
class DrawnPicture:
    """A picture as PNG, which a notebook shows and a script saves."""

    png: bytes

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: a PNG of {in_brief(self.png)}>"

    def _repr_png_(self) -> bytes:
        """The PNG for a notebook (IPython's rich display protocol)."""
        return self.png

    def save(self, path: Path | str) -> Path:
        """Write the PNG; return its path."""
        return atomic(path, lambda part: part.write_bytes(self.png))


@dataclass(frozen=True)
class View:
    """How results of one type are shown; the room ``report`` provides one for each type.

    Attributes
    ----------
    summary : result -> text
    html : result -> a whole page without pictures
    pictures : result -> what draws each picture at a path, by name, the main one first
    save : (result, folder, home, pictures): writes all files of the command into a folder, which
        is moved to its home afterwards; with ``pictures`` every drawing as PNG
    command : that returns such a result
    inputs : files that were read, which nothing may replace
    needs_origin : whether pictures and files need the model or the case of the result
    json : result -> plain data, which the command writes as JSON
    """

    command: str
    summary: Callable[[Any], str]
    html: Callable[[Any], str]
    pictures: Callable[[Any], Mapping[str, Callable[[Path], object]]]
    save: Callable[[Any, Path, Path, bool], None]
    inputs: Callable[[Any], Iterable[Path]] = lambda _: ()
    needs_origin: bool = True
    json: Callable[[Any], dict[str, Any]] = lambda _: {}


_FRAME = (
    '<iframe srcdoc="{}" sandbox="" title="{}" '
    'style="width:100%;height:{}rem;border:1px solid #ccc;border-radius:8px"></iframe>'
)
_views: dict[str, Callable[[], View]] = {}  # by the full name of the type
_later: list[str] = []  # modules that fill it


def full_name(kind: type) -> str:
    """Module and name of a type, by which it is known before it is loaded."""
    return f"{kind.__module__}.{kind.__qualname__}"


def show_by(kind: type | str, view: Callable[[], View]) -> None:
    """Let results of a type, or of its full name, be shown by what the call returns."""
    _views[kind if isinstance(kind, str) else full_name(kind)] = view


def show_later(module: str) -> None:
    """Name a module that is loaded, and fills in views, when a result without one is shown."""
    _later.append(module)


def view_of(found: object) -> View:
    """How a result is shown, by the nearest of its types that is known."""
    names = [full_name(kind) for kind in type(found).__mro__]
    while not any(name in _views for name in names):
        import_module(_later.pop())
    return next(_views[name] for name in names if name in _views)()


def to_json(found: object) -> dict[str, Any]:
    """Convert a result to the JSON that its command writes."""
    return view_of(found).json(found)


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """A result that explains itself.

    Attributes
    ----------
    origin : the case or model that it was computed from; None if it was read from a file
    """

    origin: Any = field(default=None, kw_only=True)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary().partition(chr(10))[0]}>"

    def summary(self) -> str:
        """Return the result in words: one sentence, then the main tables as text."""
        return plain_line(view_of(self).summary(self))

    @checked
    def plot(self, name: str = "") -> DrawnPicture:
        """Draw a picture of the page of the command.

        Parameters
        ----------
        name : of the picture; the main one without it

        Raises
        ------
        LabelError
            If there is no such picture; the sentence lists the names.
        ModelError
            If the result was read from a file, which does not hold the structure.
        """
        drawn = self._pictures()
        if name and name not in drawn:
            hint = did_you_mean(name, tuple(drawn))
            raise LabelError(f"no picture {name!r}; {hint}there are {named(drawn, 20)}")
        if not drawn:
            raise LabelError("this result has nothing to draw")
        with TemporaryDirectory(prefix="chladni-") as folder:
            path = Path(folder) / "picture.png"
            drawn[name or next(iter(drawn))](path)
            return DrawnPicture(path.read_bytes())

    def _pictures(self) -> Mapping[str, Callable[[Path], object]]:
        """Functions that draw the pictures, found once."""
        self._check_origin()
        if "_stills" not in self.__dict__:
            object.__setattr__(self, "_stills", view_of(self).pictures(self))
        stills: Mapping[str, Callable[[Path], object]] = self.__dict__["_stills"]
        return stills

    @checked
    def save(self, folder: Path | str, pictures: bool = False) -> Path:
        """Write the files that the command writes: JSON, tables, ``report.html``.

        The folder holds the results of one command, as with ``--out``. Returns its path.

        Parameters
        ----------
        pictures : True: every drawing of the page as PNG too, as with ``--pictures``

        Raises
        ------
        FileError
            If the folder holds results of another command, or cannot be written to.
        ModelError
            If the result was read from a file, which does not hold the structure.
        """
        self._check_origin()
        place, view = Path(folder), view_of(self)
        with run_folder(place, view.command, view.inputs(self)) as scratch:
            view.save(self, scratch, place, pictures)
        return place

    def _check_origin(self) -> None:
        if self.origin is None and view_of(self).needs_origin:
            raise ModelError(
                f"this {type(self).__name__} was read from a file, which holds no structure to draw"
            )

    def _repr_html_(self) -> str:
        """Return the page in a frame for a notebook: its sandbox runs no scripts."""
        page = view_of(self).html(self)
        return _FRAME.format(escape(page), type(self).__name__, 36)
