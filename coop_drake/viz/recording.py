"""A recording of a run that opens in any browser, without a server."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams, Role
from pydrake.systems.framework import DiagramBuilder

from coop_drake.files import write_atomically
from coop_drake.geometry.pose import FloatArray
from coop_drake.planning.plan import Plan
from coop_drake.plant import build_team_plant, set_configuration
from coop_drake.scenario import Scenario
from coop_drake.simulation import SimulationLog
from coop_drake.viz.stage import place_camera, set_cells, set_floor, set_light, set_path, switch_cells

__all__ = ["inline_frame", "recording_html", "write_recording"]

Progress = Callable[[str, float], None]

_MOST_FRAMES = 4000  # Longer runs get fewer frames per second, so that the file stays small.


def write_recording(
    scenario: Scenario, plan: Plan, log: SimulationLog, path: Path, *, progress: Progress | None = None
) -> None:
    """Write the run as one self-contained HTML page; an interrupted write leaves no file behind.

    Args:
        scenario: Where it happened; its directives bring the models.
        plan: What was executed.
        log: What happened.
        path: Where to write.
        progress: Called with a text and the fraction done.
    """
    write_atomically(path, recording_html(scenario, plan, log, progress=progress).encode())


def recording_html(
    scenario: Scenario, plan: Plan, log: SimulationLog, *, progress: Progress | None = None
) -> str:
    """Replay the log through the team's plant into a fresh Meshcat and return it as a page.

    Args:
        scenario: Where it happened; its directives bring the models.
        plan: What was executed.
        log: What happened.
        progress: Called with a text and the fraction done.
    """
    look, floor = scenario.visualization, scenario.workspace.polygon
    meshcat = Meshcat()
    set_light(meshcat)
    set_floor(meshcat, floor, look.wall_height)
    set_path(meshcat, log.object_pose[:, :2])
    set_cells(meshcat, plan)
    rate = min(look.frames_per_second, _MOST_FRAMES / max(log.times[-1], 1e-9))
    times = np.arange(0.0, log.times[-1] + 0.5 / rate, 1.0 / rate)
    meshcat.StartRecording(frames_per_second=rate, set_visualizations_while_recording=False)
    _replay(scenario, log, times, meshcat, progress)
    rows = np.searchsorted(log.times, times, side="right") - 1
    switch_cells(meshcat, times, log.cell_index[rows])
    meshcat.StopRecording()
    meshcat.PublishRecording()
    place_camera(meshcat, floor, look.wall_height)
    page: str = meshcat.StaticHtml()
    return page


def inline_frame(page: str, *, height: int = 600) -> str:
    """Return HTML that shows a page inside a notebook's cell, ``height`` pixels tall."""
    escaped = page.replace("&", "&amp;").replace('"', "&quot;")
    return f'<iframe srcdoc="{escaped}" width="100%" height="{height}" style="border: 0"></iframe>'


def _replay(
    scenario: Scenario, log: SimulationLog, times: FloatArray, meshcat: Meshcat, progress: Progress | None
) -> None:
    """Publish the team's pose at every frame into a Meshcat that is recording."""
    builder = DiagramBuilder()
    team = build_team_plant(scenario, builder)
    roles = [Role.kIllustration] + ([Role.kProximity] if scenario.visualization.show_collision else [])
    for role in roles:
        look = MeshcatVisualizerParams(role=role, prefix=f"/team/{role.name[1:].lower()}")
        MeshcatVisualizer.AddToBuilder(builder, team.scene_graph, meshcat, look)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = team.plant.GetMyMutableContextFromRoot(context)
    configurations = _interpolate(log, times)
    for frame, (time, z) in enumerate(zip(times, configurations, strict=True)):
        context.SetTime(time)
        set_configuration(team, plant_context, z)
        diagram.ForcedPublish(context)
        if progress and frame % 50 == 0:
            progress("recording", frame / len(times))
    if progress:
        progress("recording", 1.0)


def _interpolate(log: SimulationLog, times: FloatArray) -> FloatArray:
    """Configurations z of the team at the given times, shape (F, 3 + n)."""
    states = np.hstack([log.object_pose, log.joints])
    return np.column_stack([np.interp(times, log.times, column) for column in states.T])
