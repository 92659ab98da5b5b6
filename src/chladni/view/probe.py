"""Search for an off-screen window that VTK can open, in a child process because it may crash.

Without EGL and OSMesa, VTK ends the process with a segmentation fault instead of raising. So a
child process tries the windows once, and the result is kept in the user's cache.
The environment variable ``CHLADNI_GRAPHICS`` overrides it: ``egl``, ``osmesa`` or ``matplotlib``.
"""

import json
import os
import platform
import subprocess
import sys
import tempfile
from ctypes.util import find_library
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..address_space import address_space_left
from ..errors import FileError
from ..output import write_json

WINDOWS = {"osmesa": "vtkOSOpenGLRenderWindow", "egl": "vtkEGLRenderWindow"}
ADVICE = (
    "Pictures are drawn with matplotlib; for smoothly shaded ones install a graphics library "
    "(Debian, Ubuntu: apt-get install libosmesa6, or libegl1 libgl1-mesa-dri)."
)
ROOM = 1.5e9  # bytes of address space that VTK and its pictures take, with half as much in reserve
CRAMPED = (
    "Pictures are drawn with matplotlib: the limit on address space (ulimit -v) leaves too "
    "little for VTK."
)
_CHILD = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(None, return_img=True)
raise SystemExit(0 if image.std() > 1 else 1)
"""


@cache
def window() -> str | None:
    """Name of the VTK window class to use, or None where matplotlib draws the pictures."""
    if wish := os.environ.get("CHLADNI_GRAPHICS", "").lower():
        if wish not in (*WINDOWS, "matplotlib"):
            raise FileError(
                f"CHLADNI_GRAPHICS is {wish!r}; there are {', '.join(WINDOWS)}, matplotlib"
            )
        return WINDOWS.get(wish)
    if address_space_left() < ROOM:
        return None  # VTK ends the process where it gets no memory
    store = cache_folder() / "graphics.json"
    known, key = _read(store), _machine()
    if key not in known:
        try:
            known = {key: next(filter(opens, WINDOWS.values()), None)}
        except subprocess.TimeoutExpired:
            return None  # the machine may only be busy: do not remember the failure
        _keep(store, known)
    return known[key]


def opens(window_class: str, seconds: float = 60.0) -> bool:
    """True where a child process with this window class draws a sphere without a crash."""
    environment = {**os.environ, "VTK_DEFAULT_OPENGL_WINDOW": window_class}
    environment.pop("DISPLAY", None)
    command = [sys.executable, "-c", _CHILD]
    done = subprocess.run(command, env=environment, capture_output=True, timeout=seconds)
    return done.returncode == 0


def prepare() -> bool:
    """Set the working window class in VTK; False where matplotlib must draw."""
    found = window()
    if found is None:
        return False
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", found)
    return True


def advice() -> list[str]:
    """Advice for better pictures; empty where VTK works or the user chose matplotlib."""
    if os.environ.get("CHLADNI_GRAPHICS") or window():
        return []
    return [CRAMPED if address_space_left() < ROOM else ADVICE]


def cache_folder() -> Path:
    """The user's cache folder, or one in the temporary folder if that cannot be made."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    for folder in (base / "chladni", Path(tempfile.gettempdir()) / f"chladni-{_user()}"):
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.mkdtemp(prefix="chladni-"))


def _user() -> int:
    return os.getuid() if hasattr(os, "getuid") else 0


def _machine() -> str:
    """Key of the cached result: system and libraries, so that a new library repeats the search."""
    libraries = [find_library(name) or "-" for name in ("OSMesa", "EGL", "GL")]
    versions = [platform.python_version(), _version("vtk"), _version("pyvista")]
    return " ".join([platform.node(), *versions, *libraries])


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def _read(store: Path) -> dict[str, str | None]:
    try:
        found = json.loads(store.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _keep(store: Path, known: dict[str, str | None]) -> None:
    try:
        write_json(store, known)
    except OSError:
        return  # the search is repeated next time
