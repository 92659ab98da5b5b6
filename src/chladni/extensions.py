"""Load optional packages, and the effects and commands that installed packages offer."""

from collections.abc import Callable, Container
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from types import ModuleType
from typing import Any

from .errors import ExtensionError, FileError


def optional_package(name: str, install: str) -> ModuleType:
    """An optional package.

    Parameters
    ----------
    install : what pip installs to have it

    Raises
    ------
    FileError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise FileError(f"{name} cannot be imported ({error}); pip install {install}") from None


def installed(
    group: str,
    noun: str,
    wanted: str,
    fits: Callable[[Any], bool],
    taken: Container[str],
    name_of: Callable[[EntryPoint, Any], str] = lambda entry, _: entry.name,
    but: Container[EntryPoint] = (),
) -> dict[str, Any]:
    """Load what the installed packages offer in a group of entry points.

    Parameters
    ----------
    group : of entry points, ``chladni.effects``
    noun : an object of the group in a message, ``effect``
    wanted : a valid object of the group in a message
    fits : whether an object is one
    taken : names that no package may use
    name_of : an entry point and its object
    but : entry points that are passed over

    Returns
    -------
    Objects by name, in the order of the entry points.

    Raises
    ------
    ExtensionError
        If an object cannot be loaded or used, or two have one name.
    """
    out: dict[str, Any] = {}
    for entry in sorted(entry_points(group=group), key=lambda e: (e.name, e.value)):
        if entry in but:
            continue
        package = f"the package {entry.dist.name}" if entry.dist is not None else "a package"
        offer = f"{package} offers the {noun}"
        try:
            found = entry.load()
        except Exception as error:
            raise ExtensionError(
                f"{offer} {entry.name!r}, but {entry.value} cannot be loaded "
                f"({type(error).__name__}: {' '.join(str(error).split())}); repair or uninstall it"
            ) from error
        if not fits(found):
            raise ExtensionError(
                f"{offer} {entry.name!r}, but {entry.value} is a {type(found).__name__}, "
                f"not {wanted}; repair or uninstall it"
            )
        name = name_of(entry, found)
        if name in out or name in taken:
            raise ExtensionError(
                f"{offer} {name!r}, but another {noun} has this name; rename or uninstall one of "
                "them"
            )
        out[name] = found
    return out
