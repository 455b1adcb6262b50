"""The page that a live run is looked at in: opened, waited for, and closed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from typing import TYPE_CHECKING

from coop_drake.cli.reporter import Reporter
from coop_drake.cli.task import Task

if TYPE_CHECKING:
    from coop_drake.answers import Plan
    from coop_drake.viz import LivePage

_WAIT_FOR_VIEWER = 30.0
"""How long a live run waits for somebody to open its address [s]; a person needs a few seconds."""


@contextmanager
def live_page(
    task: Task, plan: Plan, reporter: Reporter, *, live: bool, wait: bool
) -> Iterator[LivePage | None]:
    """Serve the page of a live view within a ``with`` block, from when a browser shows it; None if not asked.

    On a terminal the run waits half a minute for a browser, with ``wait`` everywhere until there is one.
    """
    if not (live or wait):
        yield None
        return
    from coop_drake.viz import LivePage
    from coop_drake.viz.server import silent_meshcat

    with LivePage(task.scenario, plan, silent_meshcat(), facts=lambda: reporter.facts) as page:
        reporter.facts["live_url"] = page.url
        reporter.say(f"[bold]Live view: open {page.url} in a browser[/]")
        if wait or sys.stdout.isatty():
            with reporter.stage("waiting for a browser"):
                page.wait_for_viewer(inf if wait else _WAIT_FOR_VIEWER)
        yield page
