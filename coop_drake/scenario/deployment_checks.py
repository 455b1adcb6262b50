"""What a deployment must satisfy."""

import dataclasses
from collections.abc import Iterator

from coop_drake.errors import ScenarioError
from coop_drake.scenario.deployment import Deployment
from coop_drake.scenario.model import Scenario

_FASTEST = 1e4
"""Control rates beyond would only be a slow way to simulate continuous time [Hz]."""


def check_deployment(scenario: Scenario) -> None:
    """Refuse a deployment whose values do not fit together.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
    """
    for key, value, allowed in _departures(scenario.deployment):
        raise ScenarioError(str(scenario.path), f"deployment.{key}", value, allowed)


def _departures(deployment: Deployment) -> Iterator[tuple[str, object, str]]:
    rate = deployment.control_rate
    if rate is not None and not 1.0 <= rate <= _FASTEST:
        yield "control_rate", rate, f"a number between 1 and {_FASTEST:g}, or null"
    if not -0.9 <= deployment.mass_error <= 10.0:
        yield "mass_error", deployment.mass_error, "a number between -0.9 and 10"
    if deployment.seed < 0:
        yield "seed", deployment.seed, "zero or a positive whole number"
    for name, section in (("measurements", deployment.measurements), ("messages", deployment.messages)):
        for field in dataclasses.fields(section):
            key, value = f"{name}.{field.name}", getattr(section, field.name)
            if value < 0.0:
                yield key, value, "zero or a positive number"
            elif field.name in ("loss", "repeat") and value > 1.0:
                yield key, value, "a probability, at most 1"
            elif field.name == "delay" and value > 10.0:
                yield key, value, "at most 10 s"
            elif value > 0.0 and rate is None:
                yield key, value, "0 without deployment.control_rate"
    for field in dataclasses.fields(deployment.actuators):
        limit = getattr(deployment.actuators, field.name)
        if limit is not None and not limit > 0.0:
            yield f"actuators.{field.name}", limit, "a positive number, or null"
