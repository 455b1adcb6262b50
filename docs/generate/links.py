"""Adapts links for the site: pages are read in the repository and in the site."""

from __future__ import annotations

import re
from pathlib import PurePosixPath

__all__ = ["for_site"]

_PACKAGE = re.compile(r"\]\((?:\.\./)+coop_drake/(\w+)\)")


def for_site(text: str, page: PurePosixPath) -> str:
    """Replace links to a package's folder by links to its page of the API: the site has no source files.

    Args:
        text: The page.
        page: Its path below ``docs``.
    """
    up = "../" * (len(page.parts) - 1)
    return _PACKAGE.sub(lambda link: f"]({up}reference/api/{link[1]}.md)", text)
