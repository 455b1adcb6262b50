"""A Meshcat window without server, socket or browser: it keeps what is sent and writes it into a page."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import meshcat
from meshcat.visualizer import ViewerWindow, Visualizer

from coop_drake.drawing.player import player_style
from coop_drake.templates import rendered

_VIEWER = Path(meshcat.__file__).parent / "viewer" / "dist" / "main.min.js"


class _Messages:
    """Stands in for the socket: keeps messages in the order in which they come."""

    def __init__(self) -> None:
        self.packed: list[bytes] = []

    def send_multipart(self, frames: list[bytes]) -> None:
        """Keep a message: its kind, its path, and the packed command that the viewer takes."""
        self.packed.append(frames[2])

    def recv(self) -> bytes:
        """Answer as a server does."""
        return b"ok"


class OfflineWindow(ViewerWindow):
    """Takes the place of Meshcat's window, which would start a server process and wait for ports.

    Args:
        title: Title of the page.
        content: What the page shows beside the scene; any value that JSON can represent.
    """

    def __init__(self, title: str, content: Mapping[str, Any]) -> None:
        self.zmq_socket = _Messages()
        self._title, self._content = title, content

    def get_scene(self) -> str:
        """Return the page: viewer, scene and player in one file that needs no network."""
        messages = self.zmq_socket.packed
        return rendered(
            "coop_drake.watching",
            "page.html",
            title=self._title,
            style=player_style(),
            viewer=_VIEWER.read_text(encoding="utf-8"),
            lengths=[len(message) for message in messages],
            commands=base64.b64encode(gzip.compress(b"".join(messages), mtime=0)).decode(),
            content=self._content,
        )


def offline_visualizer(title: str, content: Mapping[str, Any]) -> Any:
    """Return a Meshcat visualizer whose ``static_html()`` gives the page."""
    return Visualizer(window=OfflineWindow(title, content))
