"""What a recording's page tells Meshcat, read back."""

from __future__ import annotations

import base64
import re
from typing import Any

import numpy as np
import umsgpack

_MESSAGE = re.compile(r'fetch\("data:application/octet-binary;base64,([A-Za-z0-9+/=]+)"\)')


def messages(page: str) -> list[dict[str, Any]]:
    """Every command of the page, in its order."""
    return [umsgpack.unpackb(base64.b64decode(packed)) for packed in _MESSAGE.findall(page)]


def paths(page: str) -> set[str]:
    """Where something stands."""
    return {message["path"] for message in messages(page) if message["type"] == "set_object"}


def track(page: str, path: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and values of the key frames of one property."""
    (told,) = [message for message in messages(page) if message["type"] == "set_animation"]
    (clip,) = [animation["clip"] for animation in told["animations"] if animation["path"] == path]
    (keys,) = [one["keys"] for one in clip["tracks"] if one["name"] == f".{name}"]
    times = np.array([key["time"] for key in keys]) / clip["fps"]
    return times, np.array([key["value"] for key in keys])


def played(page: str, path: str, name: str, times: np.ndarray) -> np.ndarray:
    """The property as a browser shows it, on straight lines from key frame to key frame."""
    keys, values = track(page, path, name)
    return np.column_stack([np.interp(times, keys, column) for column in values.reshape(len(keys), -1).T])
