"""The page of a live view: scene, key and verdict while a run is simulated, then its recording.

A small server of its own hands the page out; the scene itself comes from Meshcat's server.
"""

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

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.scenario import Scenario
from coop_drake.simulation import Sample
from coop_drake.viz.live import LiveView
from coop_drake.viz.overlay import scene_content, verdict_of, with_overlay
from coop_drake.viz.stage import FIELD_OF_VIEW

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
            "field_of_view": FIELD_OF_VIEW,
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
