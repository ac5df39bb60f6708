"""Opens a memory file, which may come from anyone, with SQLite; its errors are said in one line."""

from __future__ import annotations

import errno
import os
import sqlite3
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from urllib.parse import quote

from sgm.files import MissingFileError, VersionError, find_target, make_write_error
from sgm.messages import shorten
from sgm.store.schema import VERSION, find_fault

BUSY_SECONDS = 5.0  # that another program may keep the file
MOST_BYTES = 1 << 30  # of one text or blob; SQLite also refuses one longer than its file
_MOST_SQL, _MOST_DEPTH = 100_000, 100
_LIMITS = {
    "SQLITE_LIMIT_LENGTH": MOST_BYTES,
    "SQLITE_LIMIT_SQL_LENGTH": _MOST_SQL,
    "SQLITE_LIMIT_EXPR_DEPTH": _MOST_DEPTH,
    "SQLITE_LIMIT_TRIGGER_DEPTH": 1,
    "SQLITE_LIMIT_ATTACHED": 0,
}
# File systems over a network, on which SQLite's shared memory and locks do not hold.
_NETWORK = ("nfs", "nfs4", "cifs", "smb", "smb3", "smbfs", "ncpfs", "afs", "ceph", "lustre", "gfs2")
_NETWORK_FUSE = ("fuse.sshfs", "fuse.glusterfs", "fuse.s3fs", "fuse.rclone", "fuse.davfs")
_MOUNTS = Path("/proc/self/mountinfo")


def connect(path: Path, *, writes: bool) -> sqlite3.Connection:
    """Open a file that there is; nothing in it is used before its tables are known to be ours.

    Raises:
        FileNotFoundError: if there is no such file; it is a `ValueError`, too.
        ValueError: if it is no memory file, is damaged, or comes from another version.
        OSError: if another program keeps it.
    """
    check_file(path)
    with translated(path):
        connection = _open(path, "rw" if writes else "ro")
        try:
            fault = _begin(connection, path)
        except sqlite3.OperationalError:
            connection.close()
            if writes or has_wal(path) or os.access(path.parent, os.W_OK):
                raise
            # A medium that cannot be written to: nothing changes, and nothing can lie beside it.
            connection = _open(path, "ro&immutable=1")
            fault = _begin(connection, path)
        except BaseException:
            connection.close()
            raise
    if fault.startswith("version"):
        connection.close()
        raise VersionError(
            f"memory file's version must be {VERSION}, got {fault.split()[-1]} in {path}. Make it "
            "again, or use the version of the package that wrote it."
        )
    if fault:
        connection.close()
        raise ValueError(
            f"memory file must be one that SceneGraphMemory wrote, got {fault} at {path}. Check "
            "the path."
        )
    return connection


def create(path: Path) -> sqlite3.Connection:
    """Open a new, empty database for writing."""
    connection = _open(path, "rwc")
    connection.execute("PRAGMA page_size = 2048")
    _set(connection)
    return connection


def _open(path: Path, mode: str) -> sqlite3.Connection:
    name = f"file:{quote(str(path.absolute()))}?mode={mode}"
    return sqlite3.connect(
        name, uri=True, timeout=BUSY_SECONDS, isolation_level=None, check_same_thread=False
    )


def _begin(connection: sqlite3.Connection, path: Path) -> str:
    _set(connection)
    fault = find_fault(connection)
    (page_bytes,) = connection.execute("PRAGMA page_size").fetchone()
    if not fault and os.stat(path).st_size % page_bytes:
        raise sqlite3.DatabaseError("a file that was cut short")
    return fault


def _set(connection: sqlite3.Connection) -> None:
    """Have nothing of a file executed, and its damage found where it is read."""
    connection.text_factory = _read_text
    connection.execute("PRAGMA trusted_schema = OFF")
    connection.execute("PRAGMA cell_size_check = ON")
    connection.execute("PRAGMA mmap_size = 0")  # a damaged disk is an error, not a signal
    if hasattr(connection, "setlimit"):  # from Python 3.11 on
        for name, most in _LIMITS.items():
            connection.setlimit(getattr(sqlite3, name), most)
    if hasattr(connection, "setconfig"):  # from Python 3.12 on
        connection.setconfig(sqlite3.SQLITE_DBCONFIG_DEFENSIVE, True)  # type: ignore[attr-defined]
        connection.setconfig(sqlite3.SQLITE_DBCONFIG_ENABLE_TRIGGER, False)  # type: ignore[attr-defined]


def _read_text(text: bytes) -> str:
    return text.decode("utf-8", "backslashreplace")  # altered text has another checksum


def check_file(path: Path) -> None:
    """Check that there is a regular file, without opening it.

    Raises:
        FileNotFoundError: if there is none; it is a `ValueError`, too.
        ValueError: if it is a folder, pipe, socket or device.
    """
    rule = "memory file must be one that can be read"
    try:
        find_target(path)
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise OSError(errno.EINVAL, "no file")
        if not os.access(path, os.R_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except FileNotFoundError as error:
        raise MissingFileError(
            f"{rule}, got {shorten(error.strerror)} for {path}. Check the path, or begin one "
            "there: SceneGraphMemory(path=...) in Python, --new of a server."
        ) from None
    except OSError as error:
        line = f"{rule}, got {shorten(error.strerror)} for {path}. Check the path."
        raise ValueError(line) from None


def check_folder(path: Path) -> None:
    """Check that a memory may be written in a folder.

    Raises:
        FileNotFoundError: if the path has no name, or there is no such folder.
        OSError: if it lies on a network drive.
    """
    if not path.name:
        raise FileNotFoundError(f"memory file must have a name, got {path}. Name it home.sgm.")
    if not path.parent.is_dir():
        raise FileNotFoundError(
            f"folder of a memory file must exist, got {shorten(str(path.parent))} for {path}. Make "
            "it."
        )
    network = find_network(path)
    if network:
        raise OSError(
            errno.EOPNOTSUPP,
            f"memory file must lie on a disk of this machine, got a network drive ({network}) for "
            f"{path}. Keep it on a disk, and copy it with python -m sgm.backup.",
        )


def find_network(path: Path, mounts: Path = _MOUNTS) -> str:
    """Return the type of the network drive on which a file lies; empty for a disk, or unknown."""
    try:
        lines = mounts.read_text("utf-8", "replace").splitlines()
    except OSError:  # not on Linux
        return ""
    real, found = os.path.realpath(path.parent), ("", "")
    for line in lines:
        before, _, after = line.partition(" - ")
        fields, types = before.split(), after.split()
        if len(fields) > 4 and types:
            point = fields[4].replace("\\040", " ")
            is_above = point == "/" or real == point or real.startswith(f"{point}/")
            if is_above and len(point) >= len(found[0]):
                found = point, types[0]
    is_network = found[1] in _NETWORK or found[1].startswith(_NETWORK_FUSE)
    return found[1] if is_network else ""


def has_wal(path: Path) -> bool:
    """Tell whether changes lie beside a file that are not in it yet."""
    with suppress(OSError):
        return os.stat(name_wal(path)).st_size > 0
    return False


def name_wal(path: Path) -> Path:
    """Return the file beside a memory file in which the latest changes are."""
    return path.with_name(f"{path.name}-wal")


@contextmanager
def translated(path: Path) -> Iterator[None]:
    """Raise errors of SQLite as a ValueError of the file or an OSError of the disk, in one line."""
    try:
        yield
    except sqlite3.Error as error:
        raise translate(error, path) from error


def translate(error: sqlite3.Error, path: Path) -> Exception:
    """Return an error of SQLite as a ValueError of the file or an OSError of the disk."""
    text = str(error)
    if "full" in text:
        return make_write_error(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), path, 1)
    if "disk I/O" in text:
        return make_write_error(OSError(errno.EIO, text), path, 1)
    if "readonly" in text or "unable to open" in text:
        return make_write_error(OSError(errno.EROFS, text), path, 1)
    if "locked" in text:
        return OSError(
            errno.EBUSY,
            f"memory file must be left by other programs within {BUSY_SECONDS:g} s, got one that "
            f"keeps it at {path}. End its transaction, and try again.",
        )
    if "not a database" in text:
        return ValueError(
            f"memory file must be one that SceneGraphMemory wrote, got another file at {path}. "
            "Check the path."
        )
    return ValueError(
        f"memory file must be as it was written, got {shorten(text)} in {path}. It was damaged: "
        "see python -m sgm.check, and use a copy."
    )
