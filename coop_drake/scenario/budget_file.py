"""Budgets: read from files, or taken from a scenario's section ``deployment``."""

from __future__ import annotations

from pathlib import Path

from coop_drake.answers.budget import Budget
from coop_drake.errors import ScenarioError
from coop_drake.scenario.model import Scenario
from coop_drake.scenario.reading import read_file

FROM_DEPLOYMENT = "deployment"
"""The choice that stands for the scenario's own departures."""

DEVIATIONS = 3.0
"""Standard deviations of a normal noise that count as its bound [-]: one sample in 370 is beyond."""

REPORTS_LOST = 5
"""Reports lost in a row for which a budget provides [-]: one in 3000 times where a fifth of them is lost."""

DISAGREEMENT = 0.2
"""Error of accelerations that a budget from a deployment provides for beside that of the model, for the
coupling of axes and for robots that measure differently [rad/s^2 or m/s^2]. It is an assumption, which the
log of a run can be compared with."""


def read_budget(choice: str, scenario: Scenario) -> Budget:
    """Return the budget that ``plan --budget`` names.

    Args:
        choice: ``deployment`` for what the scenario's section of this name departs from the ideal team by, or
            a file with the keys of ``Budget``.
        scenario: The scenario.

    Raises:
        ScenarioError: There is no such file, it is wrong, or the scenario has no control rate.
    """
    if choice == FROM_DEPLOYMENT:
        return _of_deployment(scenario)
    if not Path(choice).is_file():
        raise ScenarioError(str(scenario.path), "--budget", choice, "deployment, or a file with a budget")
    budget: Budget = read_file(Budget, Path(choice))
    return budget


def _of_deployment(scenario: Scenario) -> Budget:
    deployment = scenario.deployment
    if deployment.control_rate is None or deployment.period is None:
        allowed = "a number, for a budget of the scenario's own departures"
        raise ScenarioError(str(scenario.path), "deployment.control_rate", None, allowed)
    measured, messages = deployment.measurements, deployment.messages
    lost = REPORTS_LOST * deployment.period if messages.loss > 0.0 else 0.0
    return Budget(
        control_rate=deployment.control_rate,
        delay=measured.delay,
        lag=deployment.actuators.lag,
        angle_noise=DEVIATIONS * measured.angle_noise,
        rate_noise=DEVIATIONS * measured.rate_noise,
        model_error=abs(deployment.mass_error),
        acceleration_error=DISAGREEMENT,
        report_age=messages.delay + lost,
    )
