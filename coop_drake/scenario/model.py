"""What a scenario file holds: plain frozen values, one class for each section of the file."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from shapely import Polygon

from coop_drake.answers.problem import PlannerSettings
from coop_drake.fields.tolerance import TOLERANCE
from coop_drake.laws.gains import FixedGains, GainSet, ScheduledGains
from coop_drake.scenario.deployment import Deployment
from coop_drake.scenario.drake_types import Directive
from coop_drake.tree.pose import PlanarPose
from coop_drake.typed_data import Limits, Positive

# No `from __future__ import annotations` here: `typed_data` reads the types of the fields.


@dataclass(frozen=True)
class Workspace:
    """The floor W that bodies may use: rings in the scenario, or a floor plan in a file of its own.

    Loading a scenario reads the file, so that a loaded workspace always has rings and no file.

    Attributes:
        outer: Corners of the outer ring, each (x, y) in W [m]; the last is joined to the first.
        holes: Rings of obstacles inside, each like ``outer``.
        file: In place of rings a drawing (``.svg``, ``.dxf``, ``.geojson``, ``.wkt``) or a ROS occupancy map
            (``.yaml``): a path relative to the scenario, or ``package://``. The room is the start's.
        unit: What one unit of the drawing is; null for what the file says.
        scale: Factor on all lengths of the file, 50 for a drawing at 1:50 [-].
        layers: Layers of the drawing that hold walls; empty for all that are shown.
        tolerance: How far walls may grow where that saves corners [m]; null for 1 cm, or for one and a half
            cells of a map.
        gap: Lines of a drawing that end this close to another line are joined to it [m].
        unknown_is_free: Whether the unknown cells of a map count as floor.
    """

    outer: tuple[tuple[float, float], ...] = ()
    holes: tuple[tuple[tuple[float, float], ...], ...] = ()
    file: str | None = None
    unit: Literal["mm", "cm", "dm", "m", "km", "in", "ft", "yd"] | None = None
    scale: float = 1.0
    layers: tuple[str, ...] = ()
    tolerance: float | None = None
    gap: float = 0.01
    unknown_is_free: bool = False

    @property
    def polygon(self) -> Polygon:
        """The same as a shapely polygon."""
        return Polygon(self.outer, self.holes)


@dataclass(frozen=True)
class ObjectPose:
    """Pose X_WL of the object.

    Attributes:
        x: First coordinate [m].
        y: Second coordinate [m].
        theta: Rotation, counter-clockwise [rad].
    """

    x: float
    y: float
    theta: float

    @property
    def pose(self) -> PlanarPose:
        """The same as a rigid motion of the plane."""
        return PlanarPose(self.x, self.y, self.theta)


@dataclass(frozen=True)
class Start:
    """Where everything stands at the beginning, at rest.

    Attributes:
        object: The object's pose.
        joints: For each robot the values of its joints from its base outwards [rad or m].
    """

    object: ObjectPose
    joints: dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Tolerances:
    """How close to the goal counts as arrived.

    Attributes:
        position: Distance of the object [m].
        angle: Angle of the object [rad].
        joint: Error of every joint that has a goal [rad or m].
    """

    position: Positive = 0.01
    angle: Positive = 0.02
    joint: Positive = 0.02


@dataclass(frozen=True)
class Goal:
    """Where the object shall be at the end, at rest.

    Attributes:
        object: The object's pose; theta counts modulo 2 pi.
        joints: For some robots the goal values of their joints, null for a free one; other robots are free.
        tolerances: How close counts as arrived.
    """

    object: ObjectPose
    joints: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    tolerances: Tolerances = field(default_factory=Tolerances)


def _shipped_gain_sets() -> dict[str, GainSet]:
    return {"scheduled": ScheduledGains(), "table_2": FixedGains()}


@dataclass(frozen=True)
class Gains:
    """The gain sets at hand, and which of them the run uses.

    Attributes:
        selected: Name of the set in use.
        sets: Sets by name; ``scheduled`` and ``table_2`` (the paper's) are always there.
    """

    selected: str = "scheduled"
    sets: dict[str, FixedGains | ScheduledGains] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Add the sets that are always there."""
        object.__setattr__(self, "sets", _shipped_gain_sets() | self.sets)


@dataclass(frozen=True)
class MapSettings:
    """How well the cells are mapped.

    Attributes:
        tolerance: Largest error of a harmonic map that is accepted, as certified; cells that cannot be mapped
            as well as that are refused. The disk they are mapped to has radius 1 [-].
    """

    tolerance: Annotated[float, Limits(above=0.0, below=0.01)] = TOLERANCE


@dataclass(frozen=True)
class PlantSettings:
    """How the team that is simulated hangs together; controllers know nothing of it.

    Attributes:
        grasps: ``joints`` for one tree rooted at the object, its grasps exactly rigid, in continuous time;
            ``constraints`` for a tree of every robot's own, held at the object by constraints, in steps.
        time_step: Of the discrete plant, in place of the simulator's steps; the other has none [s].
    """

    grasps: Literal["joints", "constraints"] = "joints"
    time_step: Annotated[float, Limits(above=0.0, at_most=0.01)] = 0.001

    @property
    def ideal(self) -> bool:
        """Whether grasps are exactly rigid."""
        return self.grasps == "joints"


@dataclass(frozen=True)
class SimulatorSettings:
    """How the closed loop is integrated.

    Attributes:
        max_time: The run fails when the goal is not reached by then [s].
        integration_scheme: Name of the integrator, as Drake spells it; where controllers are sampled,
            ``bogacki_shampine3`` stands in for ``runge_kutta5``.
        max_step_size: Longest step [s].
        accuracy: Relative accuracy of the error-controlled step [-]. What ``runge_kutta3`` does with 1e-3 is
            nearer to the truth, at its worst, than ``runge_kutta5`` with 1e-4: the laws have corners.
    """

    max_time: Positive = 300.0
    integration_scheme: Literal[
        "runge_kutta3", "runge_kutta5", "runge_kutta2", "bogacki_shampine3", "explicit_euler"
    ] = "runge_kutta3"
    max_step_size: Positive = 0.02
    accuracy: Annotated[float, Limits(above=0.0, below=1.0)] = 1e-3


@dataclass(frozen=True)
class VisualizationSettings:
    """How recordings look.

    Attributes:
        frames_per_second: Pictures a second of simulated time.
        wall_height: Height of the walls that stand round the workspace [m].
        show_collision: Whether collision geometry is shown over the pictures of the bodies.
    """

    frames_per_second: Positive = 25.0
    wall_height: Positive = 0.5
    show_collision: bool = False


@dataclass(frozen=True)
class Scenario:
    """One transport: the floor, the team, start, goal and settings.

    Attributes:
        workspace: The floor.
        directives: Drake's model directives: the object, two or more robots, a weld for every grasp.
        start: Pose and joints at the beginning.
        goal: Pose, and joints if any, at the end.
        object: Name of the object's model.
        fixed_joints: For some robots joints that stay as they are: values by names, or by patterns such as
            ``*wheel*``, as joints must that would leave the plane; null for what a pattern shall not fix
            [rad or m].
        load_shares: What part of the work each robot takes; they sum to one. Empty for equal parts.
        planner: How hard the planner tries.
        gains: The gain sets.
        maps: How well the cells are mapped.
        plant: How the simulated team hangs together.
        simulator: How the closed loop is integrated.
        deployment: What keeps the team from being ideal.
        visualization: How recordings look.
        path: The file it was read from.
    """

    workspace: Workspace
    directives: tuple[Directive, ...]
    start: Start
    goal: Goal
    object: str = "object"
    fixed_joints: dict[str, dict[str, float | None]] = field(default_factory=dict)
    load_shares: dict[str, Annotated[float, Limits(at_least=0.0, at_most=1.0)]] = field(default_factory=dict)
    planner: PlannerSettings = field(default_factory=PlannerSettings)
    gains: Gains = field(default_factory=Gains)
    maps: MapSettings = field(default_factory=MapSettings)
    plant: PlantSettings = field(default_factory=PlantSettings)
    simulator: SimulatorSettings = field(default_factory=SimulatorSettings)
    deployment: Deployment = field(default_factory=Deployment)
    visualization: VisualizationSettings = field(default_factory=VisualizationSettings)
    path: Path = field(default=Path("scenario.yaml"), metadata={"in_file": False})

    @property
    def name(self) -> str:
        """The file's name without ``.scenario.yaml``."""
        return self.path.name.removesuffix(".yaml").removesuffix(".yml").removesuffix(".scenario")

    def load_share(self, robot: str, robots: int) -> float:
        """What part of the work a robot takes, one of ``robots`` [-]."""
        return self.load_shares.get(robot, 1.0 / robots)

    @property
    def ideal(self) -> bool:
        """Whether the law's equations hold exactly in simulation."""
        return self.plant.ideal and self.deployment.ideal

    @property
    def gain_sets(self) -> dict[str, GainSet]:
        """The gain sets by name."""
        return self.gains.sets

    @property
    def selected_gains(self) -> str:
        """Name of the gain set in use."""
        return self.gains.selected
