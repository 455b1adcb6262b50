"""Transports of teams that are not ideal, mild and harsh, and what predictor and observer buy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import (
    Found,
    HarmonicMap,
    Plan,
    Scenario,
    SimulationLog,
    build_maps,
    load_scenario,
    plan,
    simulate,
)
from coop_drake.errors import PlanError
from coop_drake.scenario import Control, Deployment, with_gains
from coop_drake.typed_data import convert_class

TEAMS = ("base", "tight")

_RATE = {"control_rate": 200.0}
_NOISE = {"position_noise": 0.001, "angle_noise": 0.0005, "rate_noise": 0.01}


class Case(NamedTuple):
    """Sections ``deployment`` with which a transport arrives, and with which it does not.

    Attributes:
        mild: As a scenario file has it; a control rate of 200 Hz is added where none is given.
        harsh: None where nothing of the kind failed.
        known: Whether gains are scheduled for the age of commands of the harsh one; teams that know of their
            lag or delay are only slow.
    """

    mild: dict[str, Any]
    harsh: dict[str, Any] | None = None
    known: bool = True


def _measured(**values: object) -> dict[str, Any]:
    return {"measurements": values}


def _waves(size: float) -> dict[str, Any]:
    return {name: {"size": size, "period": 0.3} for name in ("angle", "joints")}


def _first(**values: object) -> dict[str, Any]:
    return {"robots": {"robot_0": values}}


def _pushed(force: float) -> dict[str, Any]:
    return {"pushes": [{"body": "object", "force": [force, 0.0], "time": 3.0, "duration": 2.0}]}


CASES: Mapping[str, Case] = {
    "nothing": Case({"control_rate": None}),
    "sampling": Case({"control_rate": 40.0}),
    "limits": Case({"actuators": {"base_force": 150.0}}, {"actuators": {"base_force": 5.0}}),
    "lag": Case({"actuators": {"lag": 0.02}}, {"actuators": {"lag": 0.2}}, known=False),
    "model error": Case({"mass_error": 0.3}, {"mass_error": -0.9}),
    "noise": Case(_measured(**_NOISE), _measured(**{name: 20.0 * size for name, size in _NOISE.items()})),
    "bounded errors": Case(_measured(waves=_waves(0.0015)), _measured(waves=_waves(0.04))),
    "delay": Case(_measured(delay=0.02), _measured(delay=0.1), known=False),
    "lost measurements": Case(_measured(loss=0.3), _measured(loss=0.9)),
    "late measurements": Case(_measured(late=0.8, late_by=0.5)),
    "lost reports": Case({"messages": {"loss": 0.7}}, {"messages": {"loss": 1.0}}),
    "late reports": Case({"messages": {"delay": 0.04}}),
    "repeated reports": Case({"messages": {"repeat": 1.0, "delay": 0.04}}),
    "biased pose, one robot": Case(_first(pose_bias={"x": 0.005}), _first(pose_bias={"x": 0.02})),
    "biased pose, all": Case(
        {"robots": {"*": {"pose_bias": {"x": 0.005}}}}, {"robots": {"*": {"pose_bias": {"x": 0.02}}}}
    ),
    "odometry": Case(_first(odometry_scale=0.02), _first(odometry_scale=0.05)),
    "late samples": Case(_first(sample_offset=0.0049)),
    "clock": Case(_first(clock_error=0.004), _first(clock_error=0.01)),
    "late switches": Case(_first(switch_delay=0.01), _first(switch_delay=0.1)),
    "silence": Case(
        _first(silence={"begin": 3.0, "duration": 2.0}), _first(silence={"begin": 3.0, "duration": None})
    ),
    "silence, motors held": Case(
        _first(silence={"begin": 3.0, "duration": 0.02, "motors": "held"}),
        _first(silence={"begin": 3.0, "duration": 1.0, "motors": "held"}),
    ),
    "silence, motors limp": Case(
        _first(silence={"begin": 3.0, "duration": 0.02, "motors": "limp"}),
        _first(silence={"begin": 3.0, "duration": 1.0, "motors": "limp"}),
    ),
    "blocked wheels": Case(
        _first(blocked={"begin": 3.0, "duration": 0.02}), _first(blocked={"begin": 3.0, "duration": None})
    ),
    "wheels that slip": Case(
        _first(slip={"begin": 3.0, "share": 0.3}), _first(slip={"begin": 3.0, "share": 1.0})
    ),
    "Coulomb friction": Case({"floor": {"coulomb_friction": 2.0}}, {"floor": {"coulomb_friction": 10.0}}),
    "viscous friction": Case({"floor": {"viscous_friction": 2.0}}, {"floor": {"viscous_friction": 5.0}}),
    "friction of joints": Case({"joint_friction": {"coulomb": 0.1}}, {"joint_friction": {"coulomb": 10.0}}),
    "slope": Case({"floor": {"slope": 0.01745}}, {"floor": {"slope": 0.2}}),
    "push": Case(_pushed(1.0), _pushed(20.0)),
    "start offset": Case(
        {"start_offset": {"x": 0.005, "theta": 0.005}}, {"start_offset": {"x": 0.005, "theta": 0.1}}
    ),
    "four at once": Case({**_measured(**_NOISE), "mass_error": -0.3, "messages": {"loss": 0.7}}),
}
"""Every departure."""

OBSERVED: Mapping[str, dict[str, Any]] = {
    "Coulomb friction of 50 N": {"floor": {"coulomb_friction": 50.0}},
    "slope of 1 degree": {"floor": {"slope": 0.01745}},
    "slope of 0.1 rad": {"floor": {"slope": 0.1}},
    "push of 50 N for 2 s": _pushed(50.0),
    "preset mobile_base": {"preset": "mobile_base"},
}
"""What an observer may buy something against."""

PREDICTED: Mapping[str, dict[str, Any]] = {
    **{f"delay of {1e3 * delay:g} ms": _measured(delay=delay) for delay in (0.01, 0.02, 0.05)},
    "preset mobile_base": {"preset": "mobile_base"},
    "preset mobile_base, 20 ms": {"preset": "mobile_base", **_measured(delay=0.02)},
}
"""What a predictor may buy something against."""

ADDED = {
    "observer": (OBSERVED, Control(observer=True)),
    "predictor": (PREDICTED, Control(predictor=True)),
}
"""The additions to the controllers, each with its cases."""


def departure_tasks() -> list[Task]:
    """Every departure, and the additions to the controllers, for each team."""
    return [
        *(
            Task(f"departures/{team}/{name}", partial(_case_rows, team, name, case), alone=True)
            for team in TEAMS
            for name, case in CASES.items()
        ),
        *(
            Task(
                f"departures/{team}_additions/{what}: {name}",
                partial(_added_rows, team, what, name),
                alone=True,
            )
            for team in TEAMS
            for what in ADDED
            for name in ADDED[what][0]
        ),
    ]


def deployment_of(data: Mapping[str, Any]) -> Deployment:
    """Return a deployment from data as in a scenario file, at 200 Hz unless it says otherwise."""
    own = {} if "preset" in data else _RATE
    return convert_class(Deployment.completed({**own, **data}), Deployment)


def departing(team: str, deployment: Deployment, control: Control, *, known: bool = True) -> SimulationLog:
    """Plan a shipped transport that rests in every cell, with a deployment and additions, and simulate it.

    Args:
        team: Name of the shipped scenario.
        deployment: The departures.
        control: The additions.
        known: Whether the plan is made for this deployment, otherwise for the ideal team.
    """
    ideal = with_gains(load_scenario(team), "scheduled")
    scenario = replace(ideal, deployment=deployment, control=control)
    planned = scenario if known else ideal
    return simulate(scenario, *planned_transport(team, planned.command_age, planned))


_PLANS: dict[tuple[str, float, bool], tuple[Plan, Sequence[HarmonicMap]]] = {}


def planned_transport(team: str, age: float, scenario: Scenario) -> tuple[Plan, Sequence[HarmonicMap]]:
    """Return plan and maps; they depend on the age of commands, and on whether the team passes."""
    key = team, age, scenario.passes
    if key not in _PLANS:
        result = plan(scenario)
        if not isinstance(result, Found):
            raise PlanError(f"{scenario.path}: no plan to measure departures on: {result.reason}")
        _PLANS[key] = result.plan, build_maps(result.plan)
    return _PLANS[key]


def _case_rows(team: str, name: str, case: Case, _: Sequence[Row]) -> list[Row]:
    rows = _rows(f"departures/{team}/{name}/mild", team, case.mild, Control())
    if case.harsh is not None and team == TEAMS[0]:  # what breaks one team is enough to know
        harsh = f"departures/{team}/{name}/harsh"
        rows += _rows(harsh, team, case.harsh, Control(), known=case.known)
    return rows


def _added_rows(team: str, what: str, name: str, _: Sequence[Row]) -> list[Row]:
    cases, added = ADDED[what]
    where = f"departures/{team}_additions/{what}: {name}"
    return [
        row
        for figure, control in (("without", Control()), ("with", added))
        for row in _rows(f"{where}/{figure}", team, cases[name], control)
    ]


def _rows(
    name: str, team: str, data: Mapping[str, Any], control: Control, *, known: bool = True
) -> list[Row]:
    """Return time, and where the team arrived smallest funnel margin and largest force; else how it ended."""
    log = departing(team, deployment_of(data), control, known=known)
    rows = [Row(name, float(log.times[-1]), "s", "" if log.reached else log.violation)]
    if log.reached:
        rows.append(Row(f"{name}_margin", 1e3 * float(log.funnel_margin.min()), "mrad or mm"))
        rows.append(Row(f"{name}_force", peak_force(log), "N"))
    return rows


def peak_force(log: SimulationLog) -> float:
    """Return the largest force of a base in a run [N]."""
    return float(np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1]).max())
