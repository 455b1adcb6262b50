"""The recording of a run: a page that any browser opens, without a server."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.files import write_atomically
from coop_drake.progress import Progress
from coop_drake.scenario import Scenario
from coop_drake.viz.overlay import page_content, with_overlay
from coop_drake.viz.replay import animation_of
from coop_drake.viz.scene import TransportScene
from coop_drake.viz.server import silent_meshcat

_MOST_FRAMES = 4000
"""Largest number of frames; longer runs get fewer frames per second, so that the file stays small."""


def write_recording(
    scenario: Scenario, plan: Plan, log: SimulationLog, path: Path, *, progress: Progress | None = None
) -> None:
    """Write the run as one self-contained HTML page; an interrupted write leaves no file behind."""
    Recording(scenario, plan).write(log, path, progress)


def recording_html(
    scenario: Scenario, plan: Plan, log: SimulationLog, *, progress: Progress | None = None
) -> str:
    """Return a run as a page: the scene, an animation of what was logged, and a player."""
    return Recording(scenario, plan).html(log, progress)


class Recording:
    """The scene of a plan, which becomes a page with the log of one run."""

    def __init__(self, scenario: Scenario, plan: Plan) -> None:
        self._scenario, self._plan = scenario, plan
        self._scene = TransportScene(scenario, plan, silent_meshcat())
        self._scene.place_camera()

    def write(self, log: SimulationLog, path: Path, progress: Progress | None = None) -> None:
        """Write the page as `write_recording` does."""
        write_atomically(path, self.html(log, progress).encode())

    def html(self, log: SimulationLog, progress: Progress | None = None) -> str:
        """Return the page as `recording_html` does."""
        scenario, scene, duration = self._scenario, self._scene, float(log.times[-1])
        rate = min(scenario.visualization.frames_per_second, _MOST_FRAMES / max(duration, 1e-9))
        times = np.arange(0.0, duration + 0.5 / rate, 1.0 / rate)
        scene.meshcat.SetAnimation(animation_of(scene, log, times, progress))
        content = page_content(
            scenario,
            self._plan,
            log,
            duration=float(times[-1]),
            colours=scene.team.colours,
            of_a_metre=scene.of_a_metre,
        )
        return with_overlay(scene.meshcat.StaticHtml(), content)


def inline_frame(page: str, *, height: int = 600) -> str:
    """Return HTML that shows a page inside a notebook's cell, ``height`` pixels tall."""
    escaped = page.replace("&", "&amp;").replace('"', "&quot;")
    frame = f'<iframe srcdoc="{escaped}" width="100%" height="{height}" style="border: 0"></iframe>'
    return f"<div>{frame}</div>"
