"""The claim of a run on its folder: one run at a time writes there.

A lock of the operating system on an open file of the folder, which ends with the process that holds it, however that ends.
The file says which process it is; it goes when the claim does, and one that a killed process left behind claims nothing.
"""

# pyright: strict

import os
import socket
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from wsph.errors import OutputError
from wsph.output.files import LOCK, RUN, Kind, check_content, check_writable

if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


class Claim:
    """Within it, `folder` is written by nobody else: a folder that is there is claimed at once, another when it is made."""

    def __init__(self, folder: Path, overwrite: bool, resume: bool = False, kind: Kind = RUN):
        """`kind`: of what is to be written there; what is of the same may be written over or gone on with."""
        self.folder, self._asked = folder, (overwrite, resume, kind)
        self._file: int | None = None
        self._is_new = False

    def __enter__(self) -> "Claim":
        """Raises OutputError where the folder cannot be used, or another process has claimed it."""
        check_writable(self.folder, *self._asked)
        if self.folder.exists():
            self._take()
        return self

    def make(self) -> None:
        """Make the folder, and claim it: it goes with the claim where nothing has been written there. Raises OutputError
        where another has been there since the claim began."""
        if self._file is not None:
            return
        self._is_new = not self.folder.exists()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"{self.folder}: cannot be made: {error.strerror or error}") from error
        self._take()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:  # fmt: skip
        if self._file is not None:
            with suppress(OSError):  # as where the folder has been taken away
                (self.folder / LOCK).unlink()
            os.close(self._file)
            self._file = None
            if self._is_new:
                with suppress(OSError):  # where something is there, as it should be
                    self.folder.rmdir()

    def _take(self) -> None:
        path = self.folder / LOCK
        while self._file is None:
            try:
                file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError as error:
                raise OutputError(f"{self.folder}: cannot be written: {error.strerror or error}") from error
            try:
                _lock(file)
            except (BlockingIOError, PermissionError):
                holder = _read(file)
                os.close(file)
                raise OutputError(
                    f"{self.folder}: is being written by {holder}: wait for its end, or choose another folder with -o"
                ) from None
            except OSError as error:
                warnings.warn(
                    f"{self.folder}: its file system has no locks ({error.strerror}): keep other runs out of it",
                    RuntimeWarning,
                    stacklevel=4,
                )
            if _same(file, path):
                self._file = file
            else:  # whoever had it has taken the file away meanwhile
                os.close(file)
        os.ftruncate(self._file, 0)
        os.write(self._file, f"{os.getpid()} {socket.gethostname()}\n".encode())
        try:
            check_content(self.folder, *self._asked)
        except OutputError:
            self.__exit__(None, None, None)
            raise


def _same(file: int, path: Path) -> bool:
    """Whether an open file is the one of that name."""
    try:
        return os.path.samestat(os.fstat(file), os.stat(path))
    except FileNotFoundError:
        return False


def _read(file: int) -> str:
    """Who has a lock, as its file says."""
    words = os.pread(file, 200, 0).decode(errors="replace").split() if sys.platform != "win32" else []
    if not words:
        return "another process"
    if words[0] == str(os.getpid()) and words[-1] == socket.gethostname():
        return f"this process ({words[0]}) already"
    return f"process {words[0]}" + (f" of {words[-1]}" if words[-1] != socket.gethostname() else "")
