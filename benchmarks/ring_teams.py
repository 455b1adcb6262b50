"""Teams of any size round one object in a hall, made from the shipped robots."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import cos, pi, sin
from pathlib import Path
from tempfile import TemporaryDirectory

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers import Found, Plan
from coop_drake.errors import PlanError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.planning.planner import plan
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.plant.model_writing import polygon_body_files, write_polygon_body
from coop_drake.scenario import Scenario, load_scenario
from coop_drake.simulation import build_maps

_RADIUS = 1.0
_CORNERS = 16
_MODELS = ("long_blue", "long_orange", "short_green", "short_purple")
_SCENARIO = """
workspace: {{outer: [[0, 0], [7, 0], [7, 7.5], [16, 7.5], [16, 14.5], [0, 14.5]]}}
directives:
- add_model: {{name: object, file: object.sdf}}
{robots}
object: object
start:
  object: {{x: 3.5, y: 3.5, theta: 0}}
  joints: {{{joints}}}
goal:
  object: {{x: 12, y: 11, theta: 0.8}}
"""


@contextmanager
def ring_transport(robots: int) -> Iterator[tuple[Scenario, Plan, tuple[HarmonicMap, ...]]]:
    """Plan and map how a ring of robots carries a round table round the corner of a hall.

    The files of the models live as long as the context.

    Args:
        robots: How many there are.

    Raises:
        PlanError: No plan was found.
    """
    with TemporaryDirectory() as name:
        scenario = _ring(Path(name), robots)
        problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
        gains = scenario.selected_gains
        result = plan(problem, scenario.gain_sets[gains], gain_set_name=gains)
        if not isinstance(result, Found):
            raise PlanError(f"no plan for a ring of {robots} robots: {result.reason}")
        yield scenario, result.plan, build_maps(result.plan)


def _ring(folder: Path, robots: int) -> Scenario:
    angles = [2.0 * pi * k / robots for k in range(robots)]
    corners = [
        (_RADIUS * cos(a), _RADIUS * sin(a))
        for a in (2.0 * pi * (k + 0.5) / _CORNERS for k in range(_CORNERS))
    ]
    grasps = [(_RADIUS * cos(a), _RADIUS * sin(a), a) for a in angles]
    write_polygon_body(polygon_body_files(corners, 4.0, "object", grasps=grasps), folder)
    lines = []
    for k in range(robots):
        model = _MODELS[k % len(_MODELS)]
        lines.append(f"- add_model: {{name: robot_{k}, file: package://coop_drake_models/{model}.sdf}}")
        lines.append(f"- add_weld: {{parent: object::grasp_{k}, child: robot_{k}::gripper}}")
    path = folder / f"ring_of_{robots}.scenario.yaml"
    path.write_text(
        _SCENARIO.format(
            robots="\n".join(lines), joints=", ".join(f"robot_{k}: [0.0]" for k in range(robots))
        ),
        encoding="utf-8",
    )
    return load_scenario(path)
