"""Where compiled kernels are kept: beside the sources, in the user's cache, or in a temporary folder."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from platformdirs import user_cache_path

import coop_drake

_NUMBA = "NUMBA_CACHE_DIR"


def keep_kernels_somewhere() -> None:
    """Name a folder of our own in the environment where numba would find none that it may write to.

    Numba keeps machine code beside the sources, or in the user's cache where they are read-only, and
    gives up where there is neither, as in a container without a home. To be called before numba is loaded.
    """
    if os.environ.get(_NUMBA):
        return
    beside, mine = Path(coop_drake.__file__).parent, user_cache_path("numba")
    if not os.access(beside, os.W_OK) and not _can_be_made(mine):
        os.environ[_NUMBA] = str(_temporary())


def _can_be_made(folder: Path) -> bool:
    """Whether a folder is there, or can be made, and may be written to."""
    there = next(path for path in (folder, *folder.parents) if path.exists())
    return there.is_dir() and os.access(there, os.W_OK)


def _temporary() -> Path:
    """A folder that lasts from one command to the next, if nobody else can have written to it."""
    folder = Path(tempfile.gettempdir()) / f"coop_drake-kernels-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    status = folder.lstat()
    if folder.is_symlink() or status.st_uid != os.getuid() or status.st_mode & 0o077:
        return Path(tempfile.mkdtemp(prefix="coop_drake-kernels-"))
    return folder
