"""Keys of processes: made, kept in files that only their owner may read, and read again.

Files are certificates of ZeroMQ's CURVE, as czmq and pyzmq write them.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path

import zmq
import zmq.auth

from coop_drake.errors import ScenarioError
from coop_drake.files import check_readable

PUBLIC_KEY = re.compile(r"[0-9A-Za-z.\-:+=^!/*?&<>()\[\]{}@%$#]{40}")
"""A key of CURVE: 32 bytes in the text form Z85."""

_LARGEST = 0.01
"""Largest file of a key [MB]."""

_OTHERS = 0o077
"""Permissions of everyone but the owner."""


@dataclass(frozen=True)
class KeyPair:
    """The keys of one process, each as text of 40 characters.

    Attributes:
        public: What others know it by; it stands in the address book.
        private: What it proves that by; it never leaves its file and this process, and is never shown.
    """

    public: str
    private: str = field(repr=False)


def make_keys() -> KeyPair:
    """Draw new keys."""
    public, private = zmq.curve_keypair()
    return KeyPair(public.decode(), private.decode())


def save_keys(path: Path, keys: KeyPair) -> None:
    """Write keys into a new file that nobody but its owner may read.

    Raises:
        OSError: The file exists, or cannot be written.
    """
    text = f'metadata\ncurve\n    public-key = "{keys.public}"\n    secret-key = "{keys.private}"\n'
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(text)


def load_keys(path: Path) -> KeyPair:
    """Read the keys of a process.

    Raises:
        ScenarioError: The file cannot be read, others may read it, or it holds no pair of keys.
    """
    try:
        mode = check_readable(path, _LARGEST).stat().st_mode
        if mode & _OTHERS:
            allowed = f"a file for its owner alone; run: chmod 600 {path}"
            raise ScenarioError(str(path), "permissions", f"{mode & 0o777:o}", allowed)
        public, private = zmq.auth.load_certificate(path)
        pair = KeyPair(public.decode(), (private or b"").decode())
        fits = PUBLIC_KEY.fullmatch(pair.private) and zmq.curve_public(pair.private.encode()) == public
    except (OSError, ValueError) as error:
        raise ScenarioError(str(path), "the file", str(error), "a file of coop-drake apart keys") from error
    if not fits:
        raise ScenarioError(
            str(path), "secret-key", "this text", "the private key that belongs to the public one"
        )
    return pair
