"""Writes files so that no reader ever finds a part of one."""

from __future__ import annotations

import errno
import math
import os
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import IO, Any

_FOLDER_VARIABLE = "COOP_DRAKE_CACHE"
"""Environment variable that names another folder for what is kept from one command to the next."""


def cache_folder(kind: str) -> Path:
    """The folder for results of one kind in the user's cache, or in what ``COOP_DRAKE_CACHE`` names."""
    if named := os.environ.get(_FOLDER_VARIABLE):
        return Path(named) / kind
    from platformdirs import user_cache_path

    return user_cache_path("coop_drake") / kind


def check_readable(path: Path, most_megabytes: float) -> Path:
    """Return the path of a file that can be read in whole; devices and pipes may never end.

    Args:
        path: The file.
        most_megabytes: Its largest size [MB].

    Raises:
        OSError: It is missing, no ordinary file, or larger.
    """
    status = path.stat()
    if not S_ISREG(status.st_mode):
        kind = "a folder" if S_ISDIR(status.st_mode) else "a device or a pipe"
        raise OSError(errno.EINVAL, f"it is {kind}, no file", str(path))
    if status.st_size > 1e6 * most_megabytes:
        size = f"it has {status.st_size / 1e6:.0f} MB; at most {most_megabytes:g} MB are read"
        raise OSError(errno.EFBIG, size, str(path))
    return path


def write_atomically(path: Path | str, content: bytes | Callable[[IO[bytes]], object]) -> Path:
    """Write a file as a whole: neither a crash nor Ctrl-C leaves a part of it.

    The content, bytes or a function that writes them to the open binary file, goes to a temporary file beside
    the target, which then replaces the target. Missing folders are made. The path is returned.

    Raises:
        OSError: The folder cannot be written; no temporary file is left.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
    part = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            if callable(content):
                content(file)
            else:
                file.write(content)
        part.chmod(_permissions_of_new_files())
        part.replace(target)
    except BaseException as error:
        part.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(target)  # A full disk is reported without the name of the file.
        raise
    return target


def remove_unfinished(folder: Path, names: Iterable[str]) -> None:
    """Remove what `write_atomically` left of files of these names where it was killed."""
    wanted = set(names)
    for part in folder.glob(".*.*.part"):
        if part.name[1:].rsplit(".", 2)[0] in wanted:
            part.unlink(missing_ok=True)


def _permissions_of_new_files() -> int:
    """Return the permissions that ``open`` gives; those of temporary files exclude other users."""
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def plain_numbers(value: Any) -> Any:
    """Return nested mappings and lists with Python's numbers for numpy's, and null for what is not finite."""
    if isinstance(value, dict):
        return {key: plain_numbers(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain_numbers(entry) for entry in value]
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value
