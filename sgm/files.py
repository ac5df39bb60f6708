"""Files that are read or written whole or not at all, their checksums, and JSON in them."""

from __future__ import annotations

import csv
import errno
import hashlib
import json
import math
import os
import stat
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from itertools import accumulate, count
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NoReturn

from sgm.messages import shorten, shorten_text

if TYPE_CHECKING:  # only what locks loads it
    from filelock import FileLock

try:
    import fcntl
except ModuleNotFoundError:  # Windows
    fcntl = None  # type: ignore[assignment]

VERSION = 1  # of every kind of file that is written
LOCK = ".lock"  # name of the file by which a folder is locked
MOST_BYTES = 1 << 30  # of a file that is read at once
MOST_LEVELS = 100  # of lists and objects in each other, in JSON and YAML
_NO_PATH = (errno.EISDIR, errno.EINVAL, errno.ELOOP, errno.ENOTDIR, errno.ENAMETOOLONG)
_NO_BRACKETS = bytes(set(range(256)) - set(b'[]{}"'))
_KEPT = "finished files are kept"
_NO_FILE = "a pipe, socket or device instead of a file"


class MissingFileError(FileNotFoundError, ValueError):
    """There is no file where one is to be read.

    A `FileNotFoundError`, as users of Python expect, and a `ValueError`, as every other fault of a
    file is.
    """

    def __init__(self, message: str) -> None:
        """Say which rule is broken, and what to do."""
        super().__init__(message)
        self.strerror = message


class VersionError(ValueError):
    """A file is of another version than the one that is read."""


def make_read_error(error: OSError, rule: str, where: str) -> ValueError:
    """Return the error of a file that cannot be read: a rule, what the system says, and where."""
    message = f"{rule}, got {shorten(error.strerror)} {where}"
    is_missing = isinstance(error, FileNotFoundError)
    return MissingFileError(message) if is_missing else ValueError(message)


def make_write_error(error: OSError, path: str | Path, size: int) -> OSError:
    """Return the error of a file that cannot be written: which rule it breaks, and what to do."""
    got = f"got {shorten(error.strerror)} for {path}."
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        line = f"folder must be writable, {got} Choose another one, or change its permissions."
    elif error.errno == errno.ENOENT:
        line = f"folder of a file must exist, {got} Make it, or check the path."
    elif error.errno in _NO_PATH:
        line = f"path must be one of a file, {got} Choose another one."
    else:
        line = f"disk must take {size} bytes, {got} Free some space and try again: {_KEPT}."
    return OSError(error.errno, line)


@contextmanager
def telling_write_errors(path: str | Path) -> Iterator[None]:
    """Raise what goes wrong with a file that is written by `make_write_error`, if it is not yet."""
    try:
        yield
    except OSError as error:
        if " must " in str(error):
            raise
        raise make_write_error(error, path, 1) from error


def open_file(path: str | Path) -> BinaryIO:
    """Open a file for reading, in bytes; a pipe is not waited for.

    Raises:
        OSError: if it cannot be read, or is no regular file.
    """
    _check_regular(os.stat(path), path)
    at_once = getattr(os, "O_NONBLOCK", 0)
    file = open(path, "rb", opener=lambda name, flags: os.open(name, flags | at_once))
    try:
        _check_regular(os.fstat(file.fileno()), path)  # it may be another one by now
    except OSError:
        file.close()
        raise
    return file


def read_file(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """Read a file at once.

    Raises:
        OSError: if it cannot be read, is no regular file, or has more than `most` bytes.
    """
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > most:
            raise OSError(errno.EFBIG, f"a file of {size} bytes, more than {most}", str(path))
        return file.read()


def read_table(package: str, name: str) -> list[dict[str, str]]:
    """Read the rows of a file in the folder `data` of a package, such as "household.csv"."""
    path = resources.files(package).joinpath("data", name)
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def compute_checksum(path: Path) -> str:
    """Return the SHA-256 of a file.

    Raises:
        OSError: if it cannot be read, or is no regular file.
    """
    checksum = hashlib.sha256()
    with open_file(path) as file:
        while block := file.read(1 << 20):
            checksum.update(block)
    return checksum.hexdigest()


def write_whole(path: str | Path, content: bytes) -> None:
    """Write a file under a temporary name beside it, then rename it.

    Of a symbolic link, the file that it names is written. What a killed process left under a
    temporary name is removed; the names in use are locked, so that any number of threads and
    processes may write a file at the same time.

    Raises:
        OSError: if the disk is full, the folder is not writable, or the path names a folder, pipe
            or device; the old file, if any, is untouched.
    """
    try:
        target = find_target(path)
        partial, file = open_partial(target)
        try:
            with file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
                if fcntl is not None:  # while it is locked
                    partial.replace(target)
            if fcntl is None:  # Windows renames no open file
                partial.replace(target)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise make_write_error(error, path, len(content)) from error


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Have a folder for oneself, on this machine and where the file system tells others of locks.

    Nothing of the lock is left afterwards; what a killed process leaves locks no other out.

    Raises:
        ValueError: if another process has it.
        OSError: if it cannot be written to, or does not exist.
    """
    path = folder / LOCK
    lock = take_lock(
        path,
        f"output folder must be in use by one command at a time, got another one at work in "
        f"{folder}. Wait for it to end, or choose another folder.",
    )
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        lock.release()


def take_lock(path: Path, refusal: str) -> FileLock:
    """Lock a file for this process, not the thread; ValueError, a refusal, if another one has it.

    Raises:
        OSError: if it cannot be written.
    """
    from filelock import FileLock, Timeout  # here, as reading needs no lock

    lock = FileLock(path, thread_local=False)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise ValueError(refusal) from None
    except OSError as error:
        raise make_write_error(error, path, 1) from error
    return lock


def read_json(path: str | Path, *, allow_nan: bool = False) -> Any:
    """Read a JSON file; `allow_nan` as in `parse_json`.

    Raises:
        OSError: if it cannot be read, or is no regular file.
        ValueError: as `parse_json` does; the caller names the file and what to do.
    """
    return parse_json(read_file(path), allow_nan=allow_nan)


def parse_json(content: str | bytes, *, allow_nan: bool = False) -> Any:
    """Parse JSON, in UTF-8 with or without a byte order mark.

    NaN and infinities, which are no JSON, may stand in it if `allow_nan`.

    Raises:
        ValueError: if it is no JSON or no UTF-8 (the place is named), is nested too deeply, has a
            key twice in one object, or a number that no computer counts with.
    """
    text = content.decode("utf-8-sig") if isinstance(content, bytes) else content
    if _is_deep(content if isinstance(content, bytes) else text.encode(errors="replace")):
        raise ValueError("lists or objects that are nested too deeply")
    return json.loads(
        text,
        object_pairs_hook=_check_keys,
        parse_float=None if allow_nan else _read_float,
        parse_constant=None if allow_nan else _refuse_constant,
    )


def check_version(what: str, found: object, where: str | Path) -> None:
    """Raise VersionError unless a file is of the one version that there is."""
    if type(found) is not int or found != VERSION:
        raise VersionError(
            f"{what} version must be {VERSION}, got {shorten(found)} in {where}. Make it again, or "
            "use the version of the package that wrote it."
        )


def _check_regular(status: os.stat_result, path: str | Path) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, "a folder instead of a file", str(path))
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, _NO_FILE, str(path))


def find_target(path: str | Path) -> Path:
    """Return the file that is to be written, or was: of a symbolic link, the file that it names.

    Raises:
        OSError: if the path names a folder, pipe, socket or device, or a circle of links.
    """
    target = Path(os.path.realpath(path))
    try:
        _check_regular(os.stat(target), path)
    except FileNotFoundError:
        if not target.name:
            raise
    return target


def open_partial(target: Path) -> tuple[Path, BinaryIO]:
    """Make a file under a temporary name, lock it, and remove those that were left over."""
    for number in count():
        partial = _name_partial(target, number)
        if not _remove_left_over(partial):
            continue
        try:
            file = partial.open("xb")
        except FileExistsError:  # of another thread or process, since
            continue
        if lock_file(file) is not False and os.fstat(file.fileno()).st_nlink:
            break
        file.close()  # another one took it for left over
    for later in count(number + 1):
        if not _name_partial(target, later).exists():
            break
        _remove_left_over(_name_partial(target, later))
    return partial, file


def _name_partial(target: Path, number: int) -> Path:
    return target.with_name(f"{target.name}{f'.{number}' if number else ''}.part")


def _remove_left_over(partial: Path) -> bool:
    """Remove what a killed process left under a temporary name; tell whether the name is free."""
    try:
        with open_file(partial) as file:
            if not lock_file(file):
                return False
            # Its writer may have renamed it before the lock, and another one taken the name.
            if os.path.samestat(os.fstat(file.fileno()), os.stat(partial)):
                partial.unlink()
    except FileNotFoundError:
        return True
    except OSError:  # it is of another user, or no file
        return False
    return True


def lock_file(file: BinaryIO) -> bool | None:
    """Lock a file until it is closed; False if another one has it, None where no one can say."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a disk without locks
        return None
    return True


def _is_deep(text: bytes) -> bool:
    """Tell whether lists and objects lie in each other more than `MOST_LEVELS` times."""
    if text.count(b"[") + text.count(b"{") <= MOST_LEVELS:
        return False
    if b"\\" in text:
        text = text.replace(b"\\\\", b"").replace(b'\\"', b"")
    text = text.translate(None, _NO_BRACKETS)
    if b'"' in text:  # every second part lies between quotation marks
        text = b"".join(text.split(b'"')[::2])
    steps = {letter: 1 if letter in b"[{" else -1 for letter in b"[]{}"}
    return max(accumulate(map(steps.__getitem__, text)), default=0) > MOST_LEVELS


def _read_float(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"the number {shorten_text(text, 50)}, which is too large")
    return value


def _check_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        counts = Counter(key for key, _ in pairs)
        twice = next(key for key, number in counts.items() if number > 1)
        raise ValueError(f"the key {shorten(twice[:50])} twice in one object")
    return found


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name}, which is no JSON")
