"""Limits of the bases and joints of a team, what a plan states of speeds, and which limits refuse it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np

from coop_drake.tree.pose import FloatArray
from coop_drake.typed_data import EXACT, Bounds, Limits, NotNegative, Positive

SLOWEST_AGE = 7.0
"""Gains are for so many times the age of the gain set's commands at most [-]: accelerations fall by up to the
square of the factor, so that it allows for limits of a few tenths."""

Unit = Literal["m", "s", "rad/s^2", "m/s^2"]
"""Units of the limits that can refuse a plan."""


def _none() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True)
class TeamLimits:
    """What the robots' models and the scenario say about limits, N robots and n joints.

    Attributes:
        base_components: Of every robot the index of its base's component in the team's tree.
        base_points: Origin of the base's frame Bk in that component's frame [m].
        base_speeds: Largest speed of that origin in W, shape (N,) [m/s].
        turn_rates: Largest rate of the base's angle in W, shape (N,) [rad/s].
        joint_rates: Largest rate of every joint, shape (n,) [rad/s or m/s].
        joint_accelerations: Largest acceleration of every joint, shape (n,) [rad/s^2 or m/s^2].
        joint_efforts: Largest effort of every joint's motor, shape (n,) [N m or N].
    """

    base_components: tuple[int, ...] = ()
    base_points: tuple[tuple[float, float], ...] = ()
    base_speeds: Bounds = field(default_factory=_none)
    turn_rates: Bounds = field(default_factory=_none)
    joint_rates: Bounds = field(default_factory=_none)
    joint_accelerations: Bounds = field(default_factory=_none)
    joint_efforts: Bounds = field(default_factory=_none)

    @property
    def any(self) -> bool:
        """Whether there is a limit of a speed or rate."""
        return bool(np.isfinite(np.concatenate((self.base_speeds, self.turn_rates, self.joint_rates))).any())


@dataclass(frozen=True)
class SpeedStatement:
    """The limits that a plan keeps, and the largest speeds of the bases that follow from its gains.

    ``speed_limit`` and ``rate_limit`` of the gains bound the speed of the object and the rates of its angle
    and of the joints.

    Attributes:
        base_speed_limits: Limits of the bases' speeds, shape (N,) [m/s].
        turn_rate_limits: Limits of the bases' turn rates, shape (N,) [rad/s].
        joint_rate_limits: Limits of the joints' rates, shape (n,) [rad/s or m/s].
        base_speeds: Largest speed that each base can have, shape (N,) [m/s].
        turn_rates: Largest turn rate that each base can have, shape (N,) [rad/s].
    """

    base_speed_limits: Bounds
    turn_rate_limits: Bounds
    joint_rate_limits: Bounds
    base_speeds: Bounds
    turn_rates: Bounds


@dataclass(frozen=True)
class Refusal:
    """A limit of the scenario with which a plan cannot be carried out.

    Attributes:
        limit: Key of the limit in the scenario, such as ``planner.min_clearance``.
        cell: Index of the cell in which the plan breaks it most.
        value: What the plan has there, or needs, in ``unit``.
        allowed: The limit, in ``unit``.
        unit: Unit of both.
        joint: Name of the joint whose limit it is; empty for limits that concern no joint.
    """

    limit: str
    cell: Annotated[int, Limits(at_least=0), EXACT]
    value: Annotated[NotNegative, EXACT]
    allowed: Annotated[Positive, EXACT]
    unit: Unit
    joint: str = ""

    def describe(self) -> str:
        """Say which limit is broken where, and by how much."""
        what = {
            "planner.min_clearance": "the object's path or its target has a clearance of",
            "planner.max_transition_time": "the transition takes about",
        }.get(self.limit, f"{self.joint} is accelerated by")
        unit, scale = ("mm", 1e3) if self.unit == "m" else (self.unit, 1.0)
        value, allowed = f"{scale * self.value:.3g} {unit}", f"{scale * self.allowed:.3g} {unit}"
        return f"{self.limit}: in cell {self.cell} {what} {value}; the limit is {allowed}"
