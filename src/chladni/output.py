"""Files of a run: written under a temporary name and moved, so that nobody sees half a run."""

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import ENOSPC
from importlib.metadata import PackageNotFoundError, version
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from .errors import FileError, named

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


def atomic(path: Path | str, write: Callable[[Path], object]) -> Path:
    """Let ``write`` fill a temporary file beside ``path``, of the same suffix, then move it."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(suffix=path.suffix, prefix=".part-", dir=path.parent)
    os.close(handle)
    part = Path(name)
    try:
        write(part)
        part.chmod(0o666 & ~_umask())
        part.replace(path)
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
    held = {name: np.asarray(array) for name, array in arrays.items()}
    if objects := [name for name, array in held.items() if array.dtype.hasobject]:
        raise FileError(f"{path}: {named(objects)} contain Python objects, which need a pickle")
    return atomic(path, lambda part: np.savez_compressed(part, **held))  # type: ignore[arg-type]


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

    A folder holds the results of one command. What an earlier run of the same command wrote there
    is replaced and what that run alone wrote goes; no other file is ever touched. While it works a
    second process is refused, where the file system has locks.

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
    out = Path(out)
    with _made(out), locked(out):
        before = _earlier(out, command)
        for killed in out.glob(f"{_SCRATCH}*"):  # nobody else is at work here
            shutil.rmtree(killed, ignore_errors=True)
        part = _scratch(out)
        try:
            yield part
            stays = before - _files(part) if adds else set()
            if listed:
                _list(part, command, stays)
            _move(part, out, before - stays, {p.resolve() for p in inputs})
        except OSError as error:
            if error.errno != ENOSPC:
                raise
            raise FileError(f"{out}: {error.strerror}; no file was written") from error
        finally:
            shutil.rmtree(part, ignore_errors=True)


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
def locked(out: Path) -> Iterator[None]:
    """The folder's lock, which the kernel frees when this process ends however it ends.

    Raises
    ------
    FileError
        If another process holds it.
    """
    if fcntl is None:
        yield
        return
    handle = os.open(out, os.O_RDONLY)
    try:
        lock(handle, out)
        yield
    finally:
        os.close(handle)


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


def _earlier(out: Path, command: str) -> set[str]:
    """Names of the files an earlier run of this command wrote into the folder."""
    path = out / LIST
    for name, by in _MARKS.items():
        if by != command and (out / name).exists():
            raise FileError(f"{out} has the results of chladni {by}; give another --out")
    if not path.exists():
        return set()
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        by, names = str(held["command"]), {str(name) for name in held["files"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(f"{path} is not a list of results; give another --out") from error
    if by != command:
        raise FileError(f"{out} has the results of chladni {by}; give another --out")
    return {name for name in names if not (Path(name).is_absolute() or ".." in Path(name).parts)}


def _files(part: Path) -> set[str]:
    """Names of the files a run wrote."""
    return {p.relative_to(part).as_posix() for p in part.rglob("*") if p.is_file()}


def _list(part: Path, command: str, stays: set[str]) -> None:
    """Write which files are the command's, with those of earlier runs that stay."""
    files = sorted({*_files(part), *stays, LIST})
    write_json(part / LIST, {"command": command, "version": own_version(), "files": files})


def _move(part: Path, out: Path, before: set[str], inputs: set[Path]) -> None:
    """Files of a finished run into their folder: all of them or none."""
    names = sorted(_files(part))
    mine = {name for name in {*before, LIST} if (out / name).is_file()}
    mine = {name for name in mine if (out / name).resolve() not in inputs}
    try:
        _refuse_blocked(out, names, mine, inputs)
        _swapped(part, out, names, mine)
    except (FileError, OSError) as error:
        why = error if isinstance(error, FileError) else f"{out}: {error.strerror}"
        kept = _kept(part, out)
        raise FileError(f"{why}; no file was replaced, and the results are in {kept}") from error


def _refuse_blocked(out: Path, names: Sequence[str], mine: set[str], inputs: set[Path]) -> None:
    """Refuse to replace what an earlier run of the command did not write."""
    for name in names:
        target = out / name
        if target.resolve() in inputs:
            raise FileError(f"{target} is an input file of this run")
        if name not in mine and os.path.lexists(target):
            raise FileError(
                f"{target} exists and no {LIST} shows that this command wrote it; move it away, "
                "or give another --out"
            )
        above = next((p for p in target.parents if p.exists()), out)
        if not above.is_dir():
            raise FileError(f"{above} exists and is not a folder")


def _swapped(part: Path, out: Path, names: Sequence[str], mine: set[str]) -> None:
    """Move the new files in and the old ones away; back again where any of it fails."""
    old = part / ".old"
    moves = [(out / name, old / name) for name in sorted(mine)]
    moves += [(part / name, out / name) for name in names]
    try:
        for source, target in moves:
            target.parent.mkdir(parents=True, exist_ok=True)
            source.rename(target)
    except BaseException:  # an interruption, too
        for source, target in reversed(moves):
            if not source.exists():  # it was moved
                target.rename(source)
        shutil.rmtree(old, ignore_errors=True)
        raise
    for folder in {(out / name).parent for name in mine} - {out}:
        with suppress(OSError):  # the new run wrote there, too
            folder.rmdir()


def _kept(part: Path, out: Path) -> Path:
    """Results that could not be moved, under a name that lasts."""
    place = next(p for k in count(1) if not (p := out / f"results-{k}").exists())
    part.rename(place)
    place.chmod(0o777 & ~_umask())
    return place


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
