"""Reads the models of a scenario once, however many plants are built from them.

Drake's reader prepares itself anew for every SDF file, which takes about 28 ms, many times as long as to copy
a finished plant.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar
from weakref import finalize

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from coop_drake.scenario import Scenario

P = ParamSpec("P")
T = TypeVar("T")


def read_once(read: Callable[Concatenate[Scenario, P], T]) -> Callable[Concatenate[Scenario, P], T]:
    """Keep what a function reads from a scenario for as long as the scenario is in use.

    A scenario that is loaded again, or changed by ``dataclasses.replace``, is another one: its files are read
    anew. The function takes a scenario and hashable positional arguments; what it returns must not refer to
    the scenario, and callers must not change it.
    """
    kept: dict[int, dict[Hashable, T]] = {}

    @wraps(read)
    def reading(scenario: Scenario, /, *args: P.args, **kwargs: P.kwargs) -> T:
        if id(scenario) not in kept:
            kept[id(scenario)] = {}
            finalize(scenario, kept.pop, id(scenario))
        results = kept[id(scenario)]
        if args not in results:
            results[args] = read(scenario, *args, **kwargs)
        return results[args]

    return reading


def add_copy(
    builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph
) -> tuple[MultibodyPlant, SceneGraph]:
    """Add copies of a finalized plant and its scene graph to a diagram, connected to each other.

    Elements of the copy have the same indices as those of the original.
    """
    plant = builder.AddNamedSystem("plant", plant.Clone())
    scene_graph = builder.AddNamedSystem("scene_graph", scene_graph.Clone())
    for output, entry in (
        ("geometry_pose", "plant_pose"),
        ("deformable_body_configuration", "plant_configuration"),
    ):
        builder.Connect(plant.GetOutputPort(output), scene_graph.GetInputPort(entry))
    builder.Connect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
    return plant, scene_graph
