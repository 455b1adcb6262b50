"""Adapts links for the site: pages and README are read in the repository and in the site."""

from __future__ import annotations

import re
from pathlib import PurePosixPath

_OUTSIDE = re.compile(r"(?<!!)\[([^\]]+)\]\((?!https?:|docs/)[^)]+\)")
_PACKAGE = re.compile(r"\]\((?:\.\./)+coop_drake/(\w+)\)")


def for_site(text: str, page: PurePosixPath) -> str:
    """Replace links to a package's folder by links to its page of the API: the site has no source files.

    Args:
        text: The page.
        page: Its path below ``docs``.
    """
    up = "../" * (len(page.parts) - 1)
    return _PACKAGE.sub(lambda link: f"]({up}reference/api/{link[1]}.md)", text)


def first_page(readme: str) -> str:
    """Return the README as the site's first page; links that the site cannot follow are text."""
    return _OUTSIDE.sub(r"\1", readme).replace("](docs/", "](")
