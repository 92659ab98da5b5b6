"""All commands, and what becomes of an error: one sentence and an exit code, never a traceback."""

import ast
import functools
import inspect
import math
import os
import re
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from ..errors import AccuracyError, ChladniError, FileError
from ..extensions import installed
from .console import console, opened_console, say

GROUP = "chladni.commands"
BUILT_IN = (  # each a module here with a function ``run``, or ``STEPS`` of a command with several
    "diagnose",
    "init",
    "check",
    "convert",
    "demo",
    "calibrate",
    "correlate",
    "test",
    "identify",
    "modes",
    "frf",
    "map",
    "render",
    "report",
    "index",
    "compare",
    "next",
)
OF_CHECKOUT = {"blind": "chladni_evidence.blind_command"}  # evidence/: no wheel holds it
DONE, FAILED, AT_FAULT, NOT_TRUSTED, INTERRUPTED = 0, 1, 2, 3, 130
_EVERY = {  # options that every command takes
    "verbose": (
        bool, typer.Option("--verbose", help="Print every stage to standard error."), False
    ),
    "log": (
        Path | None,
        typer.Option("--log", help="Append all messages and steps to a file.", metavar="FILE"),
        None,
    ),
    "open_page": (bool, typer.Option("--open", help="Open the page in the browser."), False),
}  # fmt: skip
_UsageError: type[Any] = typer.BadParameter.__mro__[1]  # of the click that this typer brings

_TOO_MANY = re.compile(r"^Got unexpected extra arguments?(?:\(s\))? \((.*)\)$")  # as click says it


class OneSentenceGroup(TyperGroup):
    """Commands: a line that none of them takes is one sentence and exit code 2."""

    def main(self, *args: Any, **options: Any) -> Any:
        """Run what the words of a command line ask for, and end with its exit code."""
        if not options.get("standalone_mode", True):
            return super().main(*args, **options)
        options["standalone_mode"] = False
        try:
            code = super().main(*args, **options)
        except _UsageError as error:
            code = _misused(error)
        except typer.Abort:
            code = INTERRUPTED
        raise SystemExit(code or DONE)


def _misused(error: Any) -> int:
    """Report an error in a command line, and the command that lists the valid words."""
    text, at = error.format_message(), error.ctx
    if at is None or text == at.get_help():  # asked for nothing: the help itself
        error.show()
        return AT_FAULT
    known = at.command.list_commands(at) if isinstance(at.command, TyperGroup) else []
    there = f"; there are {', '.join(known)}" if known else ""
    words: list[str] = []
    while at.parent is not None:
        words, at = [at.info_name, *words], at.parent
    shown = " ".join(["chladni", *words, "--help"])
    text = _TOO_MANY.sub(r"too many words: \1", text)
    text = text[:1].lower() + text[1:].rstrip(".").replace(". Did you", "; did you")
    return _said(f"{text}{there}; see `{shown}`".replace("?;", "?"), AT_FAULT)


def application(only: str | None = None) -> typer.Typer:
    """The application with every command; a command's docstring is its help.

    Parameters
    ----------
    only : command whose module is loaded, while the others are listed by their first sentence; by
        default all are loaded
    """
    os.environ.pop("MPLBACKEND", None)  # pictures go to files, whatever window is asked for
    app = typer.Typer(
        name="chladni",
        cls=OneSentenceGroup,
        help="Find, name and add the physics that a finite element model lacks.",
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    app.callback()(_version)
    for name, command in commands().items():
        if only not in (None, name) and isinstance(command, str):
            if said := _said_by_source(command):
                app.command(name, short_help=said)(_version)
                continue
        module = import_module(command) if isinstance(command, str) else command
        if hasattr(module, "STEPS"):
            app.add_typer(_stepped(module), name=name, short_help=module.HELP)
        else:
            app.command(name, short_help=_first_sentence(module.run.__doc__))(guarded(module.run))
    return app


def commands() -> dict[str, str | ModuleType]:
    """Commands by name: of this distribution by module, which is not loaded; of others loaded.

    A package adds a command by an entry point, without any change of chladni::

        [project.entry-points."chladni.commands"]
        fatigue = "my_package.fatigue_command"
    """
    here = [e for e in entry_points(group=GROUP) if e.dist and e.dist.name == "chladni"]
    own: dict[str, str | ModuleType] = {name: f"{__package__}.{name}" for name in BUILT_IN}
    own |= {entry.name: entry.value for entry in sorted(here, key=lambda e: e.name)}
    own |= {name: module for name, module in OF_CHECKOUT.items() if _is_there(module)}
    return own | installed(
        GROUP,
        "command",
        "a module with a function run, or with STEPS and HELP",
        lambda module: callable(getattr(module, "run", None)) or hasattr(module, "STEPS"),
        own,
        but=here,
    )


def _is_there(module: str) -> bool:
    """True if the package of a module can be imported."""
    return find_spec(module.partition(".")[0]) is not None


def _said_by_source(name: str) -> str:
    """The first sentence of a command, from the source of its module; "" without one."""
    package, *inner = name.split(".")
    found = find_spec(package)
    for folder in (found and found.submodule_search_locations) or ():
        path = Path(folder, *inner).with_suffix(".py")
        said: dict[str, str | None] = {}
        for node in ast.parse(path.read_bytes()).body if path.is_file() else ():
            if isinstance(node, ast.FunctionDef):
                said[node.name] = ast.get_docstring(node)
            elif isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant):
                said[ast.unparse(node.targets[0])] = str(node.value.value)
        return _first_sentence(said.get("HELP") or said.get("run"))
    return ""


def main() -> None:
    """Run the command line; a package whose command cannot be used is one sentence."""
    first = next((word for word in sys.argv[1:] if not word.startswith("-")), "")
    try:
        if first in OF_CHECKOUT and not _is_there(OF_CHECKOUT[first]):
            raise FileError(
                f"the command {first} lives in evidence/ of the source, which the installed "
                "package leaves out; run it in a checkout (pip install --editable .)"
            )
        run = application(first)
    except ChladniError as error:
        raise SystemExit(_said(error, AT_FAULT)) from None
    run()


def _stepped(module: ModuleType) -> typer.Typer:
    """A command of several steps, each with options of its own."""
    group = typer.Typer(help=module.HELP, no_args_is_help=True, rich_markup_mode=None)
    for step in module.STEPS:
        group.command(step.__name__, short_help=_first_sentence(step.__doc__))(guarded(step))
    return group


def _first_sentence(docstring: str | None) -> str:
    """The first paragraph of a docstring, whole: the list of commands would cut what is long."""
    return " ".join(inspect.cleandoc(docstring or "").split("\n\n")[0].split())


def guarded(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command whose errors end in one sentence on standard error and an exit code."""

    @functools.wraps(command)
    def inner(
        *args: object, verbose: bool = False, log: Path | None = None, open_page: bool = False,
        **options: object,
    ) -> None:  # fmt: skip
        code = DONE
        try:
            with opened_console(verbose, log, open_page), _ending() as stopped:
                code = _run(lambda: _uninterrupted(command, stopped, *args, **_finite(options)))
        except ChladniError as error:  # the log itself
            code = _said(error, AT_FAULT)
        raise typer.Exit(code)

    own = inspect.signature(command)
    kind = inspect.Parameter.KEYWORD_ONLY
    more = {name: Annotated[hint, option] for name, (hint, option, _) in _EVERY.items()}
    inner.__signature__ = own.replace(  # type: ignore[attr-defined]
        parameters=[
            *own.parameters.values(),
            *(inspect.Parameter(n, kind, default=_EVERY[n][2], annotation=more[n]) for n in more),
        ]
    )
    inner.__annotations__ = {**command.__annotations__, **more}
    return inner


def _finite(options: dict[str, Any]) -> dict[str, Any]:
    """The options of a command, unchanged."""
    for name, value in options.items():
        numbers = value if isinstance(value, list) else [value]
        for x in (x for x in numbers if isinstance(x, float) and not math.isfinite(x)):
            raise FileError(f"--{name.replace('_', '-')} {x:g} is not a finite number")
    return options


def _uninterrupted(
    command: Callable[..., Any], stopped: list[int], *args: object, **options: object
) -> Any:
    """The command's result; an error after a signal is the interruption itself.

    A library that is being imported turns the KeyboardInterrupt into an error of its own.
    """
    try:
        return command(*args, **options)
    except Exception as error:
        if stopped:
            raise KeyboardInterrupt from error
        raise


def _run(command: Callable[[], Any]) -> int:
    """Exit code of a command; what went wrong is said in a sentence."""
    try:
        return command() or DONE
    except (typer.Exit, typer.Abort, typer.BadParameter):
        raise
    except AccuracyError as error:
        return _said(error, NOT_TRUSTED)
    except ChladniError as error:
        return _said(error, AT_FAULT)
    except OSError as error:
        name = f"{error.filename}: " if error.filename else ""
        return _said(FileError(f"{name}{error.strerror or error}"), AT_FAULT)
    except KeyboardInterrupt as error:
        return _said(str(error) or "interrupted; no file was written", INTERRUPTED)
    except Exception as error:  # noqa: BLE001  a fault of ours is said as one, too
        if _is_short_of_memory(error):
            return _said("there is not enough memory", AT_FAULT)
        for line in traceback.format_exception(error):
            console().aside(line.rstrip())
        at = traceback.extract_tb(error.__traceback__)[-1]
        return _said(
            f"an error in chladni, not in its input: {type(error).__name__}: {error} "
            f"({Path(at.filename).name}, line {at.lineno}); --verbose shows the full traceback",
            FAILED,
        )


def _is_short_of_memory(error: Exception) -> bool:
    """True also where a library could not be loaded for it."""
    unloaded = isinstance(error, ImportError) and re.search("failed to map|allocate", str(error))
    return isinstance(error, MemoryError) or bool(unloaded)


@contextmanager
def _ending() -> Iterator[list[int]]:
    """SIGTERM ends a command as Ctrl-C does, so that it clears up and says what is kept.

    Yields the signals that came. Where Ctrl-C is ignored (nohup) it stays so.
    """
    stopped: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield stopped
        return

    def ended(number: int, frame: object) -> None:
        stopped.append(number)
        raise KeyboardInterrupt

    before = {signal.SIGTERM: signal.signal(signal.SIGTERM, ended)}
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        before[signal.SIGINT] = signal.signal(signal.SIGINT, ended)
    try:
        yield stopped
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _said(error: object, code: int) -> int:
    for reason in error.args if isinstance(error, AccuracyError) else (error,):
        say(f"chladni: {' '.join(str(reason).split())}", error=True)
    return code


def _tell(wanted: bool) -> None:
    if wanted:
        from ..output import own_version

        typer.echo(f"chladni {own_version()}")
        raise typer.Exit(DONE)


def _version(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Find, name and repair the physics a finite element model left out."""
