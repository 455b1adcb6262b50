"""Links of pages that are read in two places: beside the sources, and in the site."""

from __future__ import annotations

import re
from pathlib import PurePosixPath

__all__ = ["for_site"]

_ROOM = re.compile(r"\]\((?:\.\./)+coop_drake/(\w+)\)")


def for_site(text: str, page: PurePosixPath) -> str:
    """Let links to a room's folder lead to the room's page of the API, for the site has no sources.

    Args:
        text: The page.
        page: Where it stands below ``docs``.
    """
    up = "../" * (len(page.parts) - 1)
    return _ROOM.sub(lambda link: f"]({up}reference/api/{link[1]}.md)", text)
