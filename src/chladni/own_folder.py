"""A folder within which files are moved, written and removed: no link leads out of it.

Each level of a name is opened from the level above, and never through a link (POSIX.1-2008, openat
with O_NOFOLLOW). So a link that appears between a look and a use leads nowhere either. A system
without these calls (Windows) looks at every level right before the use. The folder itself may be a
link: that is the user's own wish.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from errno import ELOOP, EMLINK, ENOTDIR
from pathlib import Path, PurePosixPath
from stat import S_ISDIR, S_ISREG
from typing import IO, Literal

from .errors import FileError

_HELD_BY = {os.open, os.rename, os.mkdir, os.stat, os.unlink, os.rmdir}
_HOLDS = hasattr(os, "O_NOFOLLOW") and _HELD_BY <= os.supports_dir_fd
_FOLDER = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_NOFOLLOW", 0)
_MODES = {"ab": os.O_WRONLY | os.O_APPEND, "a+b": os.O_RDWR | os.O_APPEND}


@dataclass(frozen=True)
class OwnFolder:
    """A folder held open; names within it are relative, with ``/`` between their parts."""

    path: Path
    handle: int  # of the open folder; -1 where the system opens none

    @contextmanager
    def _above(self, name: str, make: bool = False) -> Iterator[tuple[int | None, str]]:
        """Handle of the folder of a name and its last part; without handles None and its path."""
        parts = PurePosixPath(name).parts
        if not parts or ".." in parts or Path(name).is_absolute():
            raise FileError(f"{name!r} is not a name within {self.path}")
        if self.handle < 0:
            self._look(parts[:-1], make)
            yield None, str(self.path.joinpath(*parts))
            return
        here = os.dup(self.handle)
        try:
            for k, part in enumerate(parts[:-1], 1):
                here = self._below(here, part, parts[:k], make)
            yield here, parts[-1]
        finally:
            os.close(here)

    def _below(self, above: int, part: str, parts: tuple[str, ...], make: bool) -> int:
        """Handle of a folder in another, whose handle is closed."""
        if make:
            with suppress(FileExistsError):
                os.mkdir(part, dir_fd=above)
        try:
            below = os.open(part, _FOLDER, dir_fd=above)
        except OSError as error:
            if error.errno not in (ELOOP, EMLINK, ENOTDIR):
                raise
            raise self._leads_out(parts) from error
        os.close(above)
        return below

    def _look(self, parts: tuple[str, ...], make: bool) -> None:
        """Refuse a link at any level of a name."""
        for k in range(1, len(parts) + 1):
            folder = self.path.joinpath(*parts[:k])
            if make and not os.path.lexists(folder):
                folder.mkdir()
            if os.path.lexists(folder) and (folder.is_symlink() or not folder.is_dir()):
                raise self._leads_out(parts[:k])

    def _leads_out(self, parts: tuple[str, ...]) -> FileError:
        return FileError(
            f"{self.path.joinpath(*parts)} is a link or no folder, and nothing outside of "
            f"{self.path} is touched; move it away, or give another --out"
        )

    def status(self, name: str) -> os.stat_result | None:
        """Status of a file, a folder or a link itself; None if the name is free.

        Raises
        ------
        FileError
            If a link stands above it.
        """
        try:
            with self._above(name) as (folder, last):
                return os.stat(last, dir_fd=folder, follow_symlinks=False)
        except FileNotFoundError:
            return None

    def has_file(self, name: str) -> bool:
        """True for a file in this folder that is no link and that no link leads to."""
        try:
            found = self.status(name)
        except FileError:
            return False
        return found is not None and S_ISREG(found.st_mode)

    def make(self, name: str) -> None:
        """Make a folder with those above it, unless they are there."""
        with self._above(f"{name}/in it", make=True):
            pass

    def move(self, source: str, target: str) -> None:
        """Rename within the folder; a file or a link of the target's name is replaced itself."""
        with (
            self._above(source) as (here, name),
            self._above(target, make=True) as (there, other),
        ):
            os.replace(name, other, src_dir_fd=here, dst_dir_fd=there)

    def remove(self, name: str) -> None:
        """Remove a file, a folder with all in it, or a link itself; a free name is passed over."""
        found = self.status(name)
        if found is None:
            return
        with self._above(name) as (folder, last):
            if S_ISDIR(found.st_mode):
                shutil.rmtree(last, ignore_errors=True, dir_fd=folder)
            else:
                os.unlink(last, dir_fd=folder)

    def remove_empty(self, name: str) -> None:
        """Remove a folder that holds nothing; others stay."""
        with suppress(OSError, FileError), self._above(name) as (folder, last):
            os.rmdir(last, dir_fd=folder)

    def open(self, name: str, mode: Literal["ab", "a+b"]) -> IO[bytes]:
        """Open a file to write at its end; a new one is made if the name is free.

        Raises
        ------
        FileError
            If it is a link, or has a second name elsewhere.
        """
        path = self.path / name
        flags = _MODES[mode] | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
        try:
            with self._above(name, make=True) as (folder, last):
                if folder is None and path.is_symlink():
                    raise OSError
                handle = os.open(last, flags | getattr(os, "O_BINARY", 0), 0o666, dir_fd=folder)
        except OSError as error:
            if path.is_symlink():
                raise FileError(f"{path} is a link, which is not written to") from error
            raise FileError(f"{path} cannot be written: {error.strerror}") from error
        file = os.fdopen(handle, mode)
        found = os.fstat(handle)
        if found.st_nlink > 1 or not S_ISREG(found.st_mode):
            file.close()
            raise FileError(f"{path} is no file of its own: {found.st_nlink} names lead to it")
        return file


@contextmanager
def own_folder(path: Path | str) -> Iterator[OwnFolder]:
    """Hold a folder open."""
    handle = os.open(path, os.O_RDONLY) if _HOLDS else -1
    try:
        yield OwnFolder(Path(path), handle)
    finally:
        if handle >= 0:
            os.close(handle)
