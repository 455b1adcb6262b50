"""Opens the live view of a run, and lets a person find it before the run begins."""

from __future__ import annotations

import sys

from coop_drake.answers import Plan
from coop_drake.cli.reporter import Reporter
from coop_drake.scenario import Scenario
from coop_drake.viz import LiveView
from coop_drake.viz.server import silent_meshcat

__all__ = ["open_live_view"]

_PATIENCE = 30.0  # How long a run waits for somebody to look [s].


def open_live_view(scenario: Scenario, plan: Plan, reporter: Reporter) -> LiveView:
    """Serve the scene and say where; on a terminal, wait a little for a browser to open it."""
    meshcat = silent_meshcat()
    view = LiveView(scenario, plan, meshcat)
    reporter.facts["live_url"] = meshcat.web_url()
    reporter.say(f"[bold]Live view: open {meshcat.web_url()} in a browser[/]")
    if sys.stdout.isatty():
        with reporter.stage("waiting"):
            view.wait_for_viewer(_PATIENCE)
    return view
