"""The sections of a scenario file as frozen dataclasses. Types hold the limits, docstrings the meanings."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from shapely import Polygon

from coop_drake.answers.problem import PlannerSettings
from coop_drake.floor_plans.settings import Scale, Tolerance, Unit
from coop_drake.harmonic_maps import TOLERANCE
from coop_drake.laws.gains import FixedGains, GainSet, ScheduledGains
from coop_drake.scenario.deployment import Deployment, with_preset
from coop_drake.tree.component_tree import PlanarPose
from coop_drake.typed_data import HIDDEN, Codec, Limits, NotNegative, Positive, Real

if TYPE_CHECKING:
    from pydrake.multibody.parsing import ModelDirective

PREDICTED_SHARE = 0.75
"""Share of a delay that a predictor makes up for [-]: with models that are up to 20 % wrong, and without the
other robots' noise, the rest of the motion is not known."""

MapTolerance = Annotated[float, Limits(above=0.0, below=0.01)]
"""Error of a harmonic map [-]; a larger one would turn the direction of motion."""

PlantStep = Annotated[float, Limits(above=0.0, at_most=0.01)]
"""Time step of a plant [s]; forces that are held for longer do not model a continuous controller."""


@dataclass(frozen=True)
class Workspace:
    """The floor W on which bodies may be: rings in the scenario, or a floor plan in a file of its own.

    Loading a scenario reads the floor plan; a loaded workspace always has rings and no file.

    Attributes:
        outer: Corners (x, y) of the outer ring in W; the last is joined to the first [m].
        holes: Rings of obstacles inside, each like ``outer``.
        file: Instead of rings a drawing (``.svg``, ``.dxf``, ``.geojson``, ``.wkt``) or a ROS map
            (``.yaml``), relative to the scenario or ``package://``. The floor is the room in which the object
            starts.
        unit: Unit of the drawing's coordinates; null for the file's own.
        scale: Factor on all lengths of the file, 50 for a drawing at 1:50 [-].
        layers: Layers of the drawing that hold walls; empty for all visible ones.
        tolerance: How far walls may grow to save corners; null for 1 cm, or one and a half cells of a map
            [m].
        gap: Gaps of a drawing up to this size are closed [m].
        unknown_is_free: Whether the unknown cells of a map count as floor.
        notes: Of a loaded workspace, what the reader of its file left out or assumed, each with the file.
    """

    outer: tuple[tuple[Real, Real], ...] = ()
    holes: tuple[tuple[tuple[Real, Real], ...], ...] = ()
    file: str | None = None
    unit: Unit | None = None
    scale: Scale = 1.0
    layers: tuple[str, ...] = ()
    tolerance: Tolerance | None = None
    gap: Tolerance = 0.01
    unknown_is_free: bool = False
    notes: Annotated[tuple[str, ...], HIDDEN] = ()

    @property
    def polygon(self) -> Polygon:
        """The floor as a polygon with holes."""
        return Polygon(self.outer, self.holes)


@dataclass(frozen=True)
class ObjectPose:
    """Pose X_WL of the object.

    Attributes:
        x: First coordinate [m].
        y: Second coordinate [m].
        theta: Rotation, counter-clockwise [rad].
    """

    x: Real
    y: Real
    theta: Real

    @property
    def pose(self) -> PlanarPose:
        """The pose as a rigid motion of the plane."""
        return PlanarPose(self.x, self.y, self.theta)


@dataclass(frozen=True)
class Start:
    """Configuration in which the team starts, at rest.

    Attributes:
        object: The object's pose.
        joints: For each robot its joints from the base to the end effector; circles may be in any turn [rad
            or m].
    """

    object: ObjectPose
    joints: dict[str, tuple[Real, ...]]


@dataclass(frozen=True)
class Tolerances:
    """Largest errors with which the goal counts as reached.

    Attributes:
        position: Largest distance of the object from its goal [m].
        angle: Largest error of the object's angle [rad].
        joint: Largest error of every joint that has a goal [rad or m].
    """

    position: Positive = 0.01
    angle: Positive = 0.02
    joint: Positive = 0.02


@dataclass(frozen=True)
class Goal:
    """Configuration in which the transport ends, at rest.

    Attributes:
        object: The object's pose; theta is taken modulo 2 pi.
        joints: For each robot that has a goal of its own its joints, null for a free one. Joints of other
            robots are free. Circles are taken modulo 2 pi [rad or m].
        tolerances: Largest errors with which the goal counts as reached.
    """

    object: ObjectPose
    joints: dict[str, tuple[Real | None, ...]] = field(default_factory=dict)
    tolerances: Tolerances = field(default_factory=Tolerances)


SCHEDULED = "scheduled"
"""The gain set that is derived from each cell."""


@dataclass(frozen=True)
class Gains:
    """The gain sets of teams that rest in every cell, and which of them the run uses.

    Attributes:
        selected: Name of the set of a team that rests in every cell before it enters the next one, as the
            paper's does. Null for a team that passes from cell to cell without a stop: its motion has gains
            of its own.
        sets: Sets by name; ``scheduled`` and ``table_2`` (the paper's) are always defined.
    """

    selected: str | None = None
    sets: dict[str, GainSet] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Add the sets that are always defined."""
        shipped = {SCHEDULED: ScheduledGains(), "table_2": FixedGains()}
        object.__setattr__(self, "sets", shipped | self.sets)


@dataclass(frozen=True)
class MapSettings:
    """Accuracy of the harmonic maps of the cells.

    Attributes:
        tolerance: Largest estimated error of a map onto the disk of radius 1. Cells that cannot be mapped so
            well are refused [-].
    """

    tolerance: MapTolerance = TOLERANCE


@dataclass(frozen=True)
class PlantSettings:
    """Model of the grasps in the simulated plant; controllers are the same for all.

    Attributes:
        grasps: ``joints``: one tree rooted at the object, rigid grasps, continuous time; ``constraints``: one
            tree per robot, welded to the object, discrete time.
        time_step: Time step of the plant in discrete time [s].
    """

    grasps: Literal["joints", "constraints"] = "joints"
    time_step: PlantStep = 0.001

    @property
    def ideal(self) -> bool:
        """Whether grasps are exactly rigid."""
        return self.grasps == "joints"


@dataclass(frozen=True)
class SimulatorSettings:
    """Numerical integration of the closed loop.

    Attributes:
        max_time: The run fails if the goal is not reached by then [s].
        integration_scheme: Drake's integrator; sampled controllers use ``bogacki_shampine3`` instead of
            ``runge_kutta5``.
        max_step_size: Longest step [s].
        accuracy: Relative accuracy of the error-controlled step.
    """

    max_time: Positive = 300.0
    integration_scheme: Literal[
        "runge_kutta3", "runge_kutta5", "runge_kutta2", "bogacki_shampine3", "explicit_euler"
    ] = "runge_kutta3"
    max_step_size: Positive = 0.02
    accuracy: Annotated[float, Limits(above=0.0, below=1.0)] = 1e-3


@dataclass(frozen=True)
class VisualizationSettings:
    """Appearance of recordings.

    Attributes:
        frames_per_second: Frames per second of simulated time [1/s].
        wall_height: Height of the walls around the workspace [m].
        show_collision: Whether collision geometry is shown, too.
    """

    frames_per_second: Positive = 25.0
    wall_height: Positive = 0.5
    show_collision: bool = False


OBJECT = "object"
"""Name under which the limits of the object stand."""


@dataclass(frozen=True)
class RobotLimits:
    """Limits of one robot; each replaces what the robot's model says, null keeps that.

    Attributes:
        base_speed: Largest speed of the base's frame Bk in W [m/s].
        base_turn_rate: Largest rate of the base's angle in W [rad/s].
        joint_rates: Largest rates of the joints, from the base to the end effector; a single one counts for
            all [rad/s or m/s].
        joint_accelerations: Largest accelerations of the joints, likewise [rad/s^2 or m/s^2].
        base_acceleration: Largest acceleration of the base's frame [m/s^2]. This key and the next two are
            used only by a team that passes from cell to cell. Null means 1 m/s^2, 2 rad/s^2 and 10 m/s^3;
            then, unknown speeds of bases are 1 m/s and 1.5 rad/s, unknown limits of joints 1 rad/s and
            2 rad/s^2.
        base_turn_acceleration: Largest acceleration of the base's angle [rad/s^2].
        base_jerk: Largest jerk of the base's frame [m/s^3].
        friction: Largest force of the base over the weight of base, arm and its share of the load, used as
            these; null means 0.5 [-].
        acceleration: Largest acceleration of the object, in the entry ``object`` alone, used as these; null
            means 1.5 m/s^2 [m/s^2].
    """

    base_speed: Positive | None = None
    base_turn_rate: Positive | None = None
    joint_rates: tuple[Positive | None, ...] = ()
    joint_accelerations: tuple[Positive | None, ...] = ()
    base_acceleration: Positive | None = None
    base_turn_acceleration: Positive | None = None
    base_jerk: Positive | None = None
    friction: Positive | None = None
    acceleration: Positive | None = None


EnergyShare = Annotated[float, Limits(at_least=1.0)]
"""A multiple of the energy with which a cell may be entered; below 1 every entry would ask for a hold [-]."""


@dataclass(frozen=True)
class Hold:
    """When the team comes to rest inside its cell, and stays there until the cause is gone.

    Attributes:
        at: Times at which the team is told to hold [s].
        duration: How long it is told so each time [s].
        energy: A robot asks for a hold when the energy of an axis is above so many times the bound with which
            its cell may be entered, or its Delta E is negative; null for never [-].
        silence: The team is held when a robot was not heard for so long; a robot that has heard nothing of
            the supervisor for so long holds by itself. Null to wait for ever [s].
    """

    at: tuple[NotNegative, ...] = ()
    duration: Positive = 3.0
    energy: EnergyShare | None = None
    silence: Positive | None = None


@dataclass(frozen=True)
class Control:
    """Additions to the controllers, from what each robot measures and commands itself; no message is needed.

    Attributes:
        predictor: Whether robots predict the present from late measurements and their commands since.
        observer: Whether robots estimate slow disturbances, such as friction or a push, and compensate them.
        hold: When the team is held; null for never.
    """

    predictor: bool = False
    observer: bool = False
    hold: Hold | None = None


@dataclass(frozen=True)
class DirectiveEntry:
    """One entry of a list of model directives. To hold it does not import Drake, to read it does.

    Attributes:
        data: Plain data of the YAML file.
    """

    data: object

    @cached_property
    def drake(self) -> ModelDirective:
        """The directive as Drake's type.

        Raises:
            DataError: The first departure of the data from that type, with its key in the directive.
        """
        from coop_drake.scenario.directives import read_directive

        return read_directive(self.data, "")

    @cached_property
    def plain(self) -> object:
        """Plain data of Drake's type with all its defaults, which the many runs of one scenario share."""
        from coop_drake.scenario.directives import write_directive

        return write_directive(self.drake)

    def __reduce__(self) -> tuple[type[DirectiveEntry], tuple[object]]:
        """Pickle without Drake's type, which cannot be."""
        return type(self), (self.data,)


def _write(entry: DirectiveEntry) -> object:
    return deepcopy(entry.plain)


Directive = Annotated[DirectiveEntry, Codec(Any, DirectiveEntry, _write)]


@dataclass(frozen=True)
class Scenario:
    """One transport: the floor, the team, start, goal and settings.

    Attributes:
        workspace: The floor.
        directives: Drake's model directives: the object, two or more robots, a weld for every grasp.
        start: Configuration at the beginning.
        goal: Pose of the object, and positions of joints if any, at the end.
        object: Name of the object's model.
        fixed_joints: By robot, positions of joints that never move, by name or by a pattern such as
            ``*wheel*``; null excludes a joint from a pattern. A joint that moves bodies out of the plane must
            be fixed [rad or m].
        load_shares: Fraction of the object's wrench that each robot applies; they add up to 1. Empty for
            equal ones [-].
        planner: Effort and resolution of the planner.
        gains: The gain sets.
        maps: Accuracy of the harmonic maps.
        plant: Model of the grasps in the simulated plant.
        simulator: Numerical integration of the closed loop.
        limits: Largest speeds and accelerations, by robot; ``"*"`` for all robots without an entry. Plans and
            controllers keep these and those of the models.
        deployment: Departures of the real team from the ideal one.
        control: Additions to the controllers.
        visualization: Appearance of recordings.
        path: The file it was read from.
    """

    workspace: Workspace
    directives: tuple[Directive, ...]
    start: Start
    goal: Goal
    object: str = "object"
    fixed_joints: dict[str, dict[str, Real | None]] = field(default_factory=dict)
    load_shares: dict[str, Annotated[float, Limits(at_least=0.0, at_most=1.0)]] = field(default_factory=dict)
    planner: PlannerSettings = field(default_factory=PlannerSettings)
    gains: Gains = field(default_factory=Gains)
    maps: MapSettings = field(default_factory=MapSettings)
    plant: PlantSettings = field(default_factory=PlantSettings)
    simulator: SimulatorSettings = field(default_factory=SimulatorSettings)
    limits: dict[str, RobotLimits] = field(default_factory=dict)
    deployment: Deployment = field(default_factory=Deployment)
    control: Control = field(default_factory=Control)
    visualization: VisualizationSettings = field(default_factory=VisualizationSettings)
    path: Annotated[Path, HIDDEN] = Path("scenario.yaml")

    @staticmethod
    def completed(data: dict[str, Any]) -> dict[str, Any]:
        """Return the data of a file with the departures of its preset."""
        deployment = data.get("deployment")
        return data | {"deployment": with_preset(deployment)} if isinstance(deployment, dict) else data

    @property
    def name(self) -> str:
        """The file's name without ``.scenario.yaml``."""
        return self.path.name.removesuffix(".yaml").removesuffix(".yml").removesuffix(".scenario")

    def load_share(self, robot: str, robots: int) -> float:
        """Fraction of the object's wrench that a robot applies, in a team of ``robots`` [-]."""
        return self.load_shares.get(robot, 1.0 / robots)

    @property
    def ideal(self) -> bool:
        """Whether the equations of the control law hold exactly in simulation."""
        return self.plant.ideal and self.deployment.ideal

    @property
    def command_age(self) -> float:
        """Mean age of the measurements on which an effort rests, less what a predictor makes up for [s]."""
        predicted = PREDICTED_SHARE * self.deployment.whole_delay if self.control.predictor else 0.0
        return self.deployment.command_age - predicted

    @property
    def gain_sets(self) -> dict[str, GainSet]:
        """The gain sets by name; rules without a ``command_age`` of their own get the scenario's."""
        age = self.command_age
        return {
            name: gains.for_age(age) if isinstance(gains, ScheduledGains) else gains
            for name, gains in self.gains.sets.items()
        }

    @property
    def selected_gains(self) -> str:
        """Name of the gain set by which a plan is made."""
        return self.gains.selected or SCHEDULED

    @property
    def passes(self) -> bool:
        """Whether the team passes from cell to cell without a stop."""
        return self.gains.selected is None
