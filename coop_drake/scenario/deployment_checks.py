"""Checks that relate the values of a deployment to each other and to the team."""

from collections.abc import Iterator, Sequence
from dataclasses import fields

from coop_drake.errors import ScenarioError
from coop_drake.scenario.deployment import JointFriction
from coop_drake.scenario.limits import ALL_ROBOTS
from coop_drake.scenario.model import Scenario

_SAMPLED = ("sample_offset", "switch_delay", "silence", "deaf")
"""Departures of single robots that need a control rate."""


def check_deployment(scenario: Scenario, robots: Sequence[str]) -> None:
    """Refuse departures that need what the scenario has not.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
    """
    for key, value, allowed in (*_without_rate(scenario), *_unknown(scenario, robots), *_sizes(scenario)):
        raise ScenarioError(str(scenario.path), f"deployment.{key}", value, allowed)


def _without_rate(scenario: Scenario) -> Iterator[tuple[str, object, str]]:
    """Yield what a team in continuous time cannot have: it has no samples and no messages."""
    deployment = scenario.deployment
    if deployment.control_rate is not None:
        return
    for section in ("measurements", "messages"):
        values = getattr(deployment, section)
        for name, value in ((one.name, getattr(values, one.name)) for one in fields(values)):
            if value:
                yield f"{section}.{name}", value, "0 without deployment.control_rate"
    if deployment.clock_error:
        yield "clock_error", deployment.clock_error, "0 without deployment.control_rate"
    if deployment.budget != "none":
        yield "budget", deployment.budget, "none without deployment.control_rate"
    for robot, departures in deployment.robots.items():
        for name in _SAMPLED:
            if value := getattr(departures, name):
                yield f"robots.{robot}.{name}", value, "0 or null without deployment.control_rate"


def _unknown(scenario: Scenario, robots: Sequence[str]) -> Iterator[tuple[str, object, str]]:
    """Yield names of robots and bodies that the team does not have."""
    for name in scenario.deployment.robots:
        if name not in (*robots, ALL_ROBOTS):
            yield f"robots.{name}", name, f'a robot, one of {", ".join(robots)}, or "{ALL_ROBOTS}"'
    for i, push in enumerate(scenario.deployment.pushes):
        if push.body not in (scenario.object, *robots):
            yield f"pushes[{i}].body", push.body, "one of " + ", ".join((scenario.object, *robots))


def _sizes(scenario: Scenario) -> Iterator[tuple[str, object, str]]:
    """Yield times that do not fit the control period or the steps of the simulation."""
    deployment, step = scenario.deployment, scenario.simulator.max_step_size
    for robot, departures in deployment.robots.items():
        if deployment.period is not None and not departures.sample_offset < deployment.period:
            allowed = f"a time shorter than the control period of {deployment.period:g} s"
            yield f"robots.{robot}.sample_offset", departures.sample_offset, allowed
        if departures.blocked is not None and not scenario.plant.ideal:
            allowed = "null with plant.grasps: constraints: blocked wheels are simulated in one tree alone"
            yield f"robots.{robot}.blocked", departures.blocked, allowed
    if deployment.joint_friction != JointFriction() and not scenario.plant.ideal:
        allowed = "none with plant.grasps: constraints: friction that sticks is simulated in one tree alone"
        yield "joint_friction", deployment.joint_friction, allowed
    for i, push in enumerate(deployment.pushes):
        if push.duration < step:
            allowed = f"at least simulator.max_step_size, {step:g} s: a step might miss a shorter one"
            yield f"pushes[{i}].duration", push.duration, allowed
    lag, plant = deployment.actuators.lag, scenario.plant
    if not plant.ideal and 0.0 < lag < plant.time_step:
        yield "actuators.lag", lag, f"0 or at least plant.time_step, {plant.time_step:g} s"
