"""What a robot whose drives give no effort does to others of a team that rests in every cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.departures import deployment_of, planned_transport
from benchmarks.one_process import DirectExchange, simulate_apart
from benchmarks.rejoining import KILLED, label_of
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Plan, load_scenario
from coop_drake.apart.membership import TOLERATED
from coop_drake.apart.messages import SUPERVISOR
from coop_drake.apart.node import Stillness
from coop_drake.diagram import brakes_of, build_station, control_period
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.laws.actuators import braking_effort
from coop_drake.scenario import Control, Floor, Hold, Scenario, with_gains
from coop_drake.tree.arrays import FloatArray

WAYS = ("brake", "hold", "follow", "brake_with_friction")
"""What the others do: their drives brake, as in a team of processes; they hold; they follow the plan."""

_FRICTION = 10.0
"""Viscous friction of every base in the last of them [N s/m]: one of 6 kg would roll on for 0.6 s."""

_AFTER = 3.0
"""Simulated time from the fault to the end of a run, unless the team rests or touches something [s]."""


class LimpExchange(DirectExchange):
    """Carries plain values between nodes; from an instant on, one robot's drives give no effort.

    Args:
        scenario: The scenario.
        robot: Index of the robot.
        fault: When its drives fail [s].
        brakes: Whether the drives of the others brake, once these have missed its answers for long enough.
    """

    def __init__(self, scenario: Scenario, robot: int, fault: float, *, brakes: bool) -> None:
        super().__init__()
        self._robot, self._fault, self._brakes = robot, fault, brakes
        self._drives = brakes_of(scenario, build_station(scenario).team)
        self._still, self._failed, self._rests = Stillness(control_period(scenario)), False, False

    def step(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> list[FloatArray]:
        """See ``Exchange``."""
        efforts = super().step(time, measured, stamps)
        self._failed = time >= self._fault
        if not self._failed:
            return efforts
        self._rests = self._still.sees_rest(
            np.concatenate([own[(len(own) - 3) // 2 : -3] for own in measured])
        )
        if self._brakes and time >= self._fault + TOLERATED:
            efforts = [
                braking_effort(own[:-3], brake) for own, brake in zip(measured, self._drives, strict=True)
            ]
        efforts[self._robot] = np.zeros_like(efforts[self._robot])
        return efforts

    def stopped(self) -> bool:
        """Whether the drives have failed: from then on contacts end a run, and bounds of the plan do not."""
        return self._failed

    def trouble(self) -> str:
        """See ``Exchange``."""
        return "the team rests" if self._rests else ""


def limp_tasks() -> list[Task]:
    """One fault after the other, each with all that the others may do."""
    return [
        Task(f"apart/limp/{team}_{label_of(index, at)}", partial(_rows, team, index, at), alone=True)
        for team, faults in KILLED.items()
        for index, at in faults
        if index != SUPERVISOR
    ]


def _rows(team: str, index: int, at: float, _: Sequence[Row]) -> list[Row]:
    resting = with_gains(load_scenario(team), "scheduled")
    scenario = replace(resting, deployment=deployment_of({"preset": "mobile_base"}))
    plan, maps = planned_transport(team, scenario.command_age, scenario)
    name = f"apart/limp/{team}_{label_of(index, at)}"
    return [row for way in WAYS for row in limp(f"{name}/{way}", scenario, plan, maps, index, at, way)]


def limp(
    name: str, scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap], index: int, at: float, way: str
) -> list[Row]:
    """Return the figures of a run in one process in which the drives of one robot fail.

    Args:
        name: What the rows are called.
        scenario: The scenario, with a control rate.
        plan: A plan for it.
        maps: The harmonic map of every transition.
        index: Whose drives fail.
        at: When, in simulated time [s].
        way: What the others do, one of ``WAYS``.
    """
    control = Control(hold=Hold(at=(at + TOLERATED,), duration=_AFTER)) if way == "hold" else scenario.control
    deployment = scenario.deployment
    if "friction" in way:
        deployment = replace(deployment, floor=Floor(viscous_friction=_FRICTION))
    brief = replace(
        scenario,
        control=control,
        deployment=deployment,
        simulator=replace(scenario.simulator, max_time=at + _AFTER),
    )
    log = simulate_apart(brief, plan, maps, exchange=LimpExchange(brief, index, at, brakes="brake" in way))
    later = slice(int(np.searchsorted(log.times, at)), None)
    clearance = min(log.workspace_clearance[later].min(), log.body_clearance[later].min())
    moved = np.hypot(*(log.object_pose[later, :2] - log.object_pose[later][0, :2]).T)
    ended = (
        "touches_after" if clearance <= 0.0 else "rests_after" if "rests" in log.violation else "moves_for"
    )
    return [
        Row(f"{name}/{ended}", float(log.times[-1]) - at, "s"),
        Row(f"{name}/way", 1e3 * float(moved.max()), "mm"),
        Row(f"{name}/clearance", 1e3 * float(clearance), "mm"),
    ]
