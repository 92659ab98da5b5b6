"""All commands, and what becomes of an error: one sentence and an exit code, never a traceback."""

import functools
from collections.abc import Callable
from importlib import import_module
from typing import Annotated, Any

import typer

from ..errors import AccuracyError, ChladniError

COMMANDS = (  # each a module here with a function ``run``
    "diagnose",
    "init",
    "check",
    "demo",
    "calibrate",
    "correlate",
    "test",
    "identify",
    "modes",
    "frf",
    "render",
    "plan",
    "study",
    "specimen",
    "blind",
    "report",
)
DONE, AT_FAULT, NOT_TRUSTED, INTERRUPTED = 0, 2, 3, 130


def application() -> typer.Typer:
    """The application with every command; a command's docstring is its help."""
    app = typer.Typer(
        name="chladni",
        help="Find, name and repair the physics a finite element model left out.",
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    app.callback()(_version)
    for name in COMMANDS:
        app.command(name)(guarded(import_module(f".{name}", __package__).run))
    return app


def guarded(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command whose errors end in one sentence on standard error and an exit code."""

    @functools.wraps(command)
    def inner(*args: object, **options: object) -> None:
        try:
            code = command(*args, **options)
        except AccuracyError as error:
            code = _said(error, NOT_TRUSTED)
        except ChladniError as error:
            code = _said(error, AT_FAULT)
        except OSError as error:
            name = f"{error.filename}: " if error.filename else ""
            code = _said(f"{name}{error.strerror or error}", AT_FAULT)
        except KeyboardInterrupt as error:
            said = str(error) or "interrupted; nothing was written"
            code = _said(said, INTERRUPTED)
        raise typer.Exit(code or DONE)

    return inner


def _said(error: object, code: int) -> int:
    typer.echo(f"chladni: {' '.join(str(error).split())}", err=True)
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
