"""Files of a run: written under a temporary name and moved, so that nobody sees half a run."""

import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from errno import ENOSPC
from importlib.metadata import PackageNotFoundError, version
from itertools import count
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from .errors import FileError, named
from .own_folder import OwnFolder, own_folder

try:
    import fcntl
except ImportError:  # not on Windows, whose open files are their own lock
    fcntl = None  # type: ignore[assignment]

LIST = "run.json"  # what a command wrote into a folder
_MARKS = {"study_begun.json": "study", "blind.json": "blind"}  # of what is written bit by bit
_SCRATCH = ".part-run-"


def plain(value: Any) -> Any:
    """A value as JSON knows it: arrays become lists, not-a-number becomes null.

    >>> plain({"f": np.array([1.0, np.nan]), "n": np.int64(2), 3: Path("a")})
    {'f': [1.0, None], 'n': 2, '3': 'a'}
    """
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)


def atomic(
    path: Path | str, write: Callable[[Path], object], within: OwnFolder | None = None
) -> Path:
    """Let ``write`` fill a temporary file next to ``path``, of the same suffix, then move it.

    Parameters
    ----------
    within : a folder above ``path``, below which no link is followed
    """
    path = Path(path)
    folder = path.parent if within is None else within.path
    folder.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(suffix=path.suffix, prefix=".part-", dir=folder)
    os.close(handle)
    part = Path(name)
    try:
        write(part)
        part.chmod(0o666 & ~_umask())
        if within is None:
            part.replace(path)
        else:
            within.move(part.name, path.relative_to(folder).as_posix())
    finally:
        part.unlink(missing_ok=True)
    return path


def write_text(path: Path | str, text: str) -> Path:
    """Write UTF-8 text."""
    data = text.encode("utf-8", "replace")  # a name of bytes that are no UTF-8 is shown with ?
    return atomic(path, lambda part: part.write_bytes(data))


def write_json(path: Path | str, data: Any) -> Path:
    """Write JSON, numpy values included."""
    return write_text(path, json.dumps(plain(data), indent=1, ensure_ascii=False) + "\n")


def write_npz(path: Path | str, **arrays: np.ndarray) -> Path:
    """Write compressed arrays; texts become fixed-width unicode, so no pickle is needed."""
    return write_arrays(path, arrays)


def write_arrays(
    path: Path | str, arrays: Mapping[str, np.ndarray], within: OwnFolder | None = None
) -> Path:
    """Write arrays by name as NPZ, as :func:`atomic` does."""
    held = {name: np.asarray(array) for name, array in arrays.items()}
    if objects := [name for name, array in held.items() if array.dtype.hasobject]:
        raise FileError(f"{path}: {named(objects)} contain Python objects, which need a pickle")
    return atomic(path, lambda part: np.savez_compressed(part, **held), within)  # type: ignore[arg-type]


@contextmanager
def run_folder(
    out: Path | str,
    command: str,
    inputs: Iterable[Path] = (),
    *,
    listed: bool = True,
    adds: bool = False,
) -> Iterator[Path]:
    """A scratch folder in ``out``; its files are moved into ``out`` only if the body succeeds.

    A folder holds the results of one command. Files that an earlier run of the same command wrote
    there are replaced or removed. No other file is touched, and none that a link below ``out``
    leads to. While it works a second process is refused, where the file system has locks.

    Parameters
    ----------
    inputs : files the command reads, which are replaced by nothing
    listed : write what was written into ``run.json``, so that a later run may replace it
    adds : what an earlier run of the command wrote under other names stays

    Raises
    ------
    FileError
        If ``out`` is a file, in use, or of another command; if the place cannot be written to; if
        a file is in the way, in which case all results are kept in a folder of their own.
    """
    out, inputs = Path(out), tuple(inputs)
    with _made(out), locked(out) as here:
        before = _earlier(here, command)
        for killed in out.glob(f"{_SCRATCH}*"):  # nobody else is at work here
            here.remove(killed.name)
        part = _scratch(out.resolve())  # a link in its place, later, is not followed
        try:
            yield part
            stays = before - _files(part) if adds else set()
            if listed:
                _list(part, command, stays, next(iter(inputs), None))
            _move(part, here, before - stays, {p.resolve() for p in inputs})
        except OSError as error:
            if error.errno != ENOSPC:
                raise
            raise FileError(f"{out}: {error.strerror}; no file was written") from error
        finally:
            here.remove(part.name)


@contextmanager
def _made(out: Path) -> Iterator[None]:
    """The folder; one that was made for nothing goes again, with those above it that were."""
    new = [p for p in (out, *out.parents) if not p.exists()]
    make_folder(out)
    try:
        yield
    finally:
        with suppress(OSError):  # it holds something, as it should
            for folder in new:
                folder.rmdir()


def name_of(folder: Path) -> str:
    """Name of the folder of a case; the bench calls every case ``case``, and its parent counts.

    >>> name_of(Path("lab/case")), name_of(Path("lab/bracket"))
    ('lab/case', 'bracket')
    """
    return "/".join(folder.parts[-2:]) if folder.name == "case" else folder.name


def make_folder(out: Path) -> None:
    """Make a folder for results, unless it is there.

    Raises
    ------
    FileError
        If it is a file, or cannot be made.
    """
    if out.exists() and not out.is_dir():
        raise FileError(f"{out} is a file, --out needs a folder")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{out}: no folder can be made there ({error.strerror})") from error


@contextmanager
def locked(out: Path) -> Iterator[OwnFolder]:
    """The folder, locked by the kernel, which frees it when this process ends however it ends.

    Raises
    ------
    FileError
        If another process holds it.
    """
    with own_folder(out) as here:
        if here.handle >= 0:
            lock(here.handle, out)
        yield here


def lock(handle: int, folder: Path) -> bool:
    """Lock an open file for this process; False where the file system of ``folder`` has no locks.

    Raises
    ------
    FileError
        If another process holds it.
    """
    if fcntl is None:
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise FileError(
            f"{folder} is in use by another process; wait for it, or give another --out"
        ) from None
    except OSError:
        return False
    return True


def _scratch(out: Path) -> Path:
    """A folder on the file system of ``out``, which may be a mount point."""
    try:
        return Path(tempfile.mkdtemp(prefix=_SCRATCH, dir=out))
    except OSError as error:
        raise FileError(f"{out}: no file can be written there ({error.strerror})") from error


def _earlier(here: OwnFolder, command: str) -> set[str]:
    """Names of the files an earlier run of this command wrote into the folder."""
    path = here.path / LIST
    for name, by in _MARKS.items():
        if by != command and here.status(name):
            raise FileError(f"{here.path} has the results of chladni {by}; give another --out")
    if not here.status(LIST):
        return set()
    try:
        if path.is_symlink():
            raise ValueError(LIST)
        held = json.loads(path.read_text(encoding="utf-8"))
        by, names = str(held["command"]), {str(name) for name in held["files"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(f"{path} is not a list of results; give another --out") from error
    if by != command:
        raise FileError(f"{here.path} has the results of chladni {by}; give another --out")
    return names


def _files(part: Path) -> set[str]:
    """Names of the files a run wrote."""
    return {p.relative_to(part).as_posix() for p in part.rglob("*") if p.is_file()}


def _list(part: Path, command: str, stays: set[str], source: Path | None) -> None:
    """Write which files are the command's, with those of earlier runs that stay."""
    now = datetime.now(UTC).isoformat(timespec="seconds")
    about = {"command": command, "version": own_version(), "written": now, "source": source}
    write_json(part / LIST, {**about, "files": sorted({*_files(part), *stays, LIST})})


def _move(part: Path, here: OwnFolder, before: set[str], inputs: set[Path]) -> None:
    """Files of a finished run into their folder: all of them or none."""
    names = sorted(_files(part))
    mine = {name for name in {*before, LIST} if here.has_file(name)}
    mine = {name for name in mine if (here.path / name).resolve() not in inputs}
    try:
        _refuse_blocked(here, names, mine, inputs)
        _swapped(part.name, here, names, mine)
    except (FileError, OSError) as error:
        why = error if isinstance(error, FileError) else f"{here.path}: {error.strerror}"
        kept = _kept(part, here)
        raise FileError(f"{why}; no file was replaced, and the results are in {kept}") from error


def _refuse_blocked(
    here: OwnFolder, names: Sequence[str], mine: set[str], inputs: set[Path]
) -> None:
    """Refuse to replace what an earlier run of the command did not write."""
    for name in names:
        target = here.path / name
        if target.resolve() in inputs:
            raise FileError(f"{target} is an input file of this run")
        if here.status(name) and name not in mine:
            raise FileError(
                f"{target} exists and no {LIST} shows that this command wrote it; move it away, "
                "or give another --out"
            )


def _swapped(part: str, here: OwnFolder, names: Sequence[str], mine: set[str]) -> None:
    """Move the new files in and the old ones away; back again where any of it fails."""
    moves = [(name, f"{part}/.old/{name}") for name in sorted(mine)]
    moves += [(f"{part}/{name}", name) for name in names]
    try:
        for source, target in moves:
            here.move(source, target)
    except BaseException:  # an interruption, too
        for source, target in reversed(moves):
            with suppress(FileError):  # a link has appeared: the old file is with what is kept
                if not here.status(source):  # it was moved
                    here.move(target, source)
        if not _files(here.path / part / ".old"):
            here.remove(f"{part}/.old")
        raise
    for folder in {str(PurePosixPath(name).parent) for name in mine} - {"."}:
        here.remove_empty(folder)  # unless the new run wrote there, too


def _kept(part: Path, here: OwnFolder) -> Path:
    """Results that could not be moved, under a name that lasts."""
    name = next(n for k in count(1) if not here.status(n := f"results-{k}"))
    part.chmod(0o777 & ~_umask())
    here.move(part.name, name)
    return here.path / name


def own_version() -> str:
    """Version of this package, where it is installed."""
    try:
        return version("chladni")
    except PackageNotFoundError:
        return "(not installed)"


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
