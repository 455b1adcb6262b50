"""Stills of recordings, taken by a browser without a window."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")

_PATIENCE = 120.0
"""How long a browser may take to draw a page [s]; without a graphics card it takes a few seconds."""

_PAGE_TIME = 20_000
"""How long the page may run by its own clock before the picture is taken [ms]: it unpacks its scene first."""


class BrowserError(Exception):
    """No browser is there, or it took no picture."""


def browser() -> str:
    """Return the path of a browser that takes pictures without a window.

    Raises:
        BrowserError: There is none.
    """
    for name in _BROWSERS:
        if path := shutil.which(name):
            return path
    raise BrowserError(f"stills are taken by a browser; install one of {', '.join(_BROWSERS)}")


def take_still(page: Path, picture: Path, time: float) -> None:
    """Take a picture of a recording at a time [s].

    Raises:
        BrowserError: The browser took none.
    """
    command = [
        browser(), "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
        "--window-size=1000,700", f"--virtual-time-budget={_PAGE_TIME}", f"--screenshot={picture}",
        f"{page.absolute().as_uri()}#t={time:.2f}",
    ]  # fmt: skip
    picture.unlink(missing_ok=True)
    subprocess.run(command, check=False, capture_output=True, timeout=_PATIENCE)
    if not picture.exists():
        raise BrowserError(f"{command[0]} took no picture of {page}")
