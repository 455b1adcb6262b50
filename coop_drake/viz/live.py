"""The live view: a run shown while it is simulated."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock, Thread
from time import monotonic, sleep
from types import TracebackType
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.scenario import Scenario
from coop_drake.simulation import Sample
from coop_drake.viz import scene
from coop_drake.viz.recording import scene_content, verdict_of, with_overlay

# The live view: shows a run in a browser while it is simulated, no faster than in reality.

_FRAMES_PER_SECOND = 25.0
"""Steps shown per simulated second [1/s]: motion looks smooth."""


class LiveView:
    """An observer of ``simulate``: it shows accepted steps and changes nothing.

    Args:
        scenario: What is simulated.
        plan: What is executed.
        meshcat: Where it is shown; ``meshcat.web_url()`` is its address.
        rate: Greatest ratio of simulated time to real time; infinite not to wait at all.

    Attributes:
        scene: What is shown.
    """

    def __init__(self, scenario: Scenario, plan: Plan, meshcat: Meshcat, *, rate: float = 1.0) -> None:
        self.scene = scene.TransportScene(scenario, plan, meshcat)
        self.scene.place_camera()
        self._rate = rate
        self._began: float | None = None
        self._next, self._cell, self._pieces = 0.0, 0, 0
        self._trail = [plan.start[:2].copy()]

    def wait_for_viewer(self, seconds: float) -> bool:
        """Wait for a browser to connect, perhaps for ever; return whether one did."""
        until = monotonic() + seconds
        while self.scene.meshcat.GetNumActiveConnections() == 0 and monotonic() < until:
            sleep(0.1)
        self.scene.meshcat.Flush()
        return bool(self.scene.meshcat.GetNumActiveConnections())

    def __call__(self, sample: Sample) -> None:
        """Show one step, unless another one was shown less than a frame before."""
        if sample.time < self._next and not sample.arrived:
            return
        self._next = sample.time + 1.0 / _FRAMES_PER_SECOND
        self._keep_pace(sample.time)
        self.scene.team.show(sample.z)
        self._show_cell(sample.cell)
        self._show_forces(sample)
        self._show_trail(sample.z[:2])

    def _keep_pace(self, time: float) -> None:
        if self._began is None:
            self._began = monotonic() - time / self._rate
        ahead = time / self._rate - (monotonic() - self._began)
        if ahead > 0.0:
            sleep(ahead)

    def _show_cell(self, cell: int) -> None:
        if cell == self._cell:  # Hiding and showing it again would make it flicker.
            return
        for index, visible in ((self._cell, False), (cell, True)):
            for path in scene.cell_paths(index):
                self.scene.meshcat.SetProperty(path, "visible", visible)
        self._cell = cell

    def _show_forces(self, sample: Sample) -> None:
        meshcat, grasps = self.scene.meshcat, self.scene.team.grasp_points(sample.z)
        for index, wrench in enumerate(sample.measured_wrenches):
            path = scene.arrow_path(index)
            sizes = scene.arrow_sizes(wrench[None, :2], self.scene.of_a_metre)
            direction, scales = (value[0] for value in sizes)
            R_WA = RotationMatrix.MakeZRotation(direction)
            meshcat.SetTransform(path, RigidTransform(R_WA, grasps[index] + scene.ABOVE))
            meshcat.SetProperty(path, "scale", scales.tolist())

    def _show_trail(self, position: np.ndarray) -> None:
        if np.linalg.norm(position - self._trail[-1]) < scene.STEP:
            return
        self._trail.append(position.copy())
        scene.set_trail(self.scene.meshcat, f"/motion/trail/{self._pieces:05d}", np.array(self._trail[-2:]))
        self._pieces += 1


# The page of a live view: scene, key and verdict while a run is simulated, then its recording.
#
# A small server of its own hands the page out; the scene itself comes from Meshcat's server.

_ABSENT = 2.0
"""A browser that has not asked for news for so long has been closed [s]; it asks four times a second."""

_LONGEST_HANDOVER = 15.0
"""How long the server waits for browsers that load the recording [s]: a few megabytes on a slow network."""


class LivePage:
    """Serves the page of a live view, and is the run's observer; within a ``with`` block.

    Args:
        scenario: What is simulated.
        plan: What is executed.
        meshcat: Where it is shown; nothing has been drawn there yet.
        rate: Greatest ratio of simulated time to real time.
        facts: Returns what is known about a run apart: its ``processes`` and ``stops``.
    """

    def __init__(
        self,
        scenario: Scenario,
        plan: Plan,
        meshcat: Meshcat,
        *,
        rate: float = 1.0,
        facts: Callable[[], Mapping[str, Any]] = dict,
    ) -> None:
        empty = meshcat.StaticHtml()  # Before the view draws: the page gets the scene from Meshcat's server.
        self._view = LiveView(scenario, plan, meshcat, rate=rate)
        team, of_a_metre = self._view.scene.team, self._view.scene.of_a_metre
        robots = dict(zip((robot.name for robot in team.team.robots), team.colours, strict=True))
        content = scene_content(scenario, robots, of_a_metre) | {
            "port": meshcat.port(),
            "field_of_view": scene.FIELD_OF_VIEW,
        }
        self._page = with_overlay(empty, content, "live.html").encode()
        self._news: dict[str, Any] = {"details": "the run has not begun", "verdict": "", "recording": False}
        self._cells, self._facts = len(plan.cells), facts
        self._recording: Path | None = None
        self._asked, self._loading, self._lock = -_ABSENT, 0, Lock()
        self._server = ThreadingHTTPServer(("localhost", 0), _handler(self))
        self._server.daemon_threads = True

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://localhost:{self._server.server_port}"

    def __enter__(self) -> LivePage:
        Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._server.shutdown()
        self._server.server_close()

    def wait_for_viewer(self, seconds: float) -> bool:
        """Wait for a browser to show the scene; return whether one does."""
        return self._view.wait_for_viewer(seconds)

    def __call__(self, sample: Sample) -> None:
        """Show one accepted step of the run."""
        self._view(sample)
        speed = float(np.hypot(*sample.rates[:2]))
        self._news["details"] = (
            f"{sample.time:.1f} s, cell {sample.cell + 1} of {self._cells}, object at {speed:.2f} m/s"
        )

    def show_verdict(self, log: SimulationLog) -> None:
        """Show how the run ended."""
        self._news |= {"verdict": verdict_of(log), "reached": log.reached and not log.violation}

    def hand_over(self, recording: Path) -> None:
        """Let every browser that shows the page load the recording in its place, which needs no server."""
        self._recording = recording
        self._news["recording"] = True
        until = monotonic() + _LONGEST_HANDOVER
        while monotonic() < until and (self._loading or monotonic() - self._asked < _ABSENT):
            sleep(0.05)

    def answer(self, path: str) -> tuple[str, bytes] | None:
        """Return kind and content of what a browser asks for; None if there is no such thing."""
        if path == "/":
            return "text/html; charset=utf-8", self._page
        if path == "/news":
            self._asked = monotonic()
            facts = self._facts()
            rows = [process_row(process) for process in facts.get("processes", ())]
            news = self._news | {"processes": rows, "stop": stop_words(facts.get("stops", ()))}
            return "application/json", json.dumps(news).encode()
        if path == "/transport.html" and self._recording is not None:
            return "text/html; charset=utf-8", self._recording.read_bytes()
        return None

    def count(self, change: int) -> None:
        """Count the answers that are on their way."""
        with self._lock:
            self._loading += change


def stop_words(stops: Sequence[Mapping[str, Any]]) -> str:
    """Return why all drives brake now; empty where they do not."""
    if not stops or stops[-1]["resumed"] is not None:
        return ""
    cause, since, rested = (stops[-1][key] for key in ("cause", "since", "rested"))
    rest = "" if rested is None else f"; the team rests since {rested:.2f} s"
    return f"All drives brake since {since:.2f} s because of {cause}{rest}"


def process_row(process: Mapping[str, Any]) -> dict[str, str]:
    """Return a row of the table of processes: its cells by column."""
    state, since, age = process["state"], process["missing_since"], process["age"]
    return {
        "process": process["name"],
        "state": state if since is None else f"{state} since {since:.2f} s",
        "age of answer": "" if age is None or since is not None else f"{1e3 * age:.1f} ms",
        "messages to the team": f"{process['team_messages']}",
        "refused": f"{process['refused']}",
    }


def _handler(page: LivePage) -> type[BaseHTTPRequestHandler]:
    """Return the class that answers requests for a page."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            page.count(1)
            try:
                found = page.answer(self.path)
                if found is None:
                    self.send_error(404)
                    return
                kind, content = found
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(content)))
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                self.wfile.write(content)
            except ConnectionError:
                pass  # The browser has left.
            finally:
                page.count(-1)

        def log_message(self, format: str, *args: object) -> None:
            """Write no line for every request."""

    return Handler
