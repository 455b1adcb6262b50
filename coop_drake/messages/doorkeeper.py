"""Lets only known keys connect, as ZeroMQ's authentication protocol (ZAP) asks for each connection."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import zmq
from zmq.auth.thread import ThreadAuthenticator


class Doorkeeper:
    """Answers, in a thread of its own, whether a key may connect to the sockets of a context.

    Args:
        context: Of the sockets; it can have one doorkeeper.
        keys: The public keys that may.
    """

    def __init__(self, context: zmq.Context[Any], keys: Iterable[str | None]) -> None:
        self._keys = {key.encode() for key in keys if key}
        self._authenticator = ThreadAuthenticator(context)
        self._authenticator.start()
        self._authenticator.configure_curve_callback("team", credentials_provider=self)

    def callback(self, domain: str, key: bytes) -> bool:
        """Whether a key may connect; the authenticator calls this.

        Args:
            domain: Not used; the context has one.
            key: The public key of a client that has proved to have its private key.
        """
        return key in self._keys

    def close(self) -> None:
        """End the thread."""
        self._authenticator.stop()
