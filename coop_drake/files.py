"""Files are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

__all__ = ["write_atomically"]


def write_atomically(path: Path | str, content: bytes | Callable[[IO[bytes]], object]) -> Path:
    """Write a file so that a reader, a crash or Ctrl-C never meets half of it.

    The content goes to a temporary file beside the target, which is then renamed over it.

    Args:
        path: Where the file shall stand; missing directories are made.
        content: The bytes, or a function that writes them to the open binary file it is given.

    Returns:
        The path written.

    Raises:
        OSError: If the directory cannot be written; no temporary file is left behind.
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
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return target


def _permissions_of_new_files() -> int:
    """Permissions that ``open`` would give; temporary files are born private."""
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
