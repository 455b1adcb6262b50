"""What plans claim about budgets, gains and limits, altered, and what ``verify`` says of it.

Every alteration makes a statement false, or is one that the planner cannot have made: a plan's claims are
derived again from the scenario, so that none may be accepted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from zlib import crc32

import numpy as np

from benchmarks.adversaries.alterations import chosen, copied, step
from benchmarks.adversaries.collisions import Document
from benchmarks.adversaries.trial import Judged
from benchmarks.departures import deployment_of
from coop_drake import load_scenario
from coop_drake.answers import Found
from coop_drake.answers.budget import LIMITS, SCALED
from coop_drake.answers.document import Document as File
from coop_drake.answers.plan import plan_document, read_plan
from coop_drake.errors import PlanError, RefusalError
from coop_drake.planning.planner import plan
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import budget_of, scenario_budgets
from coop_drake.verification import verify_plan

DEPLOYMENT = {
    "preset": "mobile_base", "budget": "all", "clock_error": 1e-4,
    "actuators": {"base_torque": 500.0, "joint_effort": 500.0},
}  # fmt: skip
"""What the plan shall tolerate [s, N m]."""

Random = np.random.Generator
Claim = Callable[[Document, Random], None]


def _scaled(document: Document, name: str, factor: float) -> None:
    """Multiply a number, or all numbers of a list."""
    stated: Any = document[name]
    document[name] = [factor * one for one in stated] if isinstance(stated, list) else factor * stated


def _transition(answer: Document, random: Random) -> Document:
    one: Document = answer["transitions"][chosen(answer["transitions"], random)]
    return one


def _entries(name: str, values: Any) -> Claim:
    """State another value of an entry of the budget."""

    def alter(answer: Document, random: Random) -> None:
        answer["budget"][name] = values(answer["budget"][name]) if callable(values) else values

    return alter


def _gains(name: str, *factors: float) -> Claim:
    """State other gains in one transition."""

    def alter(answer: Document, random: Random) -> None:
        _scaled(_transition(answer, random)["gains"], name, factors[chosen(factors, random)])

    return alter


def _heavier(answer: Document, random: Random) -> None:
    bodies = answer["budget"]["bodies"]
    bodies[chosen(bodies, random)][1] *= 1.0 + step(random)


def _smaller(answer: Document, random: Random) -> None:
    names = [name for name in SCALED if answer["budget"].get(name)]
    _scaled(answer["budget"], names[chosen(names, random)], 1.0 - step(random, 1e-4))


def _unlimited(answer: Document, random: Random) -> None:
    answer["budget"][LIMITS[int(random.integers(len(LIMITS)))]] = None


def _quicker(answer: Document, random: Random) -> None:
    names = "speed_limit", "rate_limit", "acceleration_limit"
    gains, name = _transition(answer, random)["gains"], names[int(random.integers(3))]
    axes = len(answer["start"]) - 2
    gains[name] = 0.01 if name == "speed_limit" else [0.01] * axes


def _refused_by(answer: Document, random: Random) -> None:
    refusal = {"limit": "planner.min_clearance", "cell": 0, "value": 0.0, "allowed": 0.001, "unit": "m"}
    answer["refused_by"] = [refusal | {"joint": ""}]


def _departures(factor: float, *names: str) -> Claim:
    """State other numbers of what departs from the motion."""

    def alter(answer: Document, random: Random) -> None:
        _scaled(answer["departures"], names[chosen(names, random)], factor)

    return alter


def _motion(name: str, factor: float) -> Claim:
    """State another number of the motion."""

    def alter(answer: Document, _: Random) -> None:
        _scaled(answer["motion"], name, factor)

    return alter


def _sooner(answer: Document, random: Random) -> None:
    _scaled(_transition(answer, random), "estimated_time", 1.0 - step(random, 1e-2))


CLAIMS: dict[str, Claim] = {
    "no bodies": _entries("bodies", []),
    "rotors of 100 kg m^2": _entries("rotors", lambda rotors: [100.0] * len(rotors)),
    "no dampings": _entries("dampings", []),
    "bases elsewhere": _entries("bases", lambda bases: [[one[0], one[1] + 0.1, one[2]] for one in bases]),
    "a heavier body": _heavier,
    "a smaller budget": _smaller,
    "an effort without a limit": _unlimited,
    "stiffness": _gains("stiffness", 0.5, 1.1, 3.0),
    "damping": _gains("damping", 0.5, 1.1),
    "governor gain": _gains("governor_gain", 0.5, 1.1),
    "limits of rates": _quicker,
    "refused by a limit": _refused_by,
    "departures": _departures(0.99, "position", "rate", "acceleration", "ahead", "rest", "room"),
    "pulls": _departures(0.99, "pull"),
    "efforts": _departures(0.1, "effort"),
    "levels of monitors": _departures(1.01, "alarm", "rate_alarm", "ahead_alarm"),
    "less noise as a rule": _departures(0.99, "usual_rate", "usual_acceleration"),
    "a quicker motion": _motion("period", 0.9),
    "brakes that are too slow": _motion("rates", 0.5),
    "words that take no time": _motion("waiting", 0.5),
    "a sudden start": _motion("start_rate", 3.0),
    "a sooner arrival": _sooner,
}
"""By kind: alters a plan's document."""


def judged_claims(team: str, rounds: int) -> list[Judged]:
    """Alter the claims of a shipped scenario's plan in every kind of way, and judge what ``verify`` says.

    Args:
        team: The scenario.
        rounds: How many times each kind of alteration is applied.

    Raises:
        PlanError: There is no plan, or ``verify`` refuses it as it is.
    """
    scenario = replace(load_scenario(team), deployment=deployment_of(DEPLOYMENT))
    problem, gains = planning_problem(scenario), scenario.gain_sets
    found = plan(
        problem, gains["scheduled"], gain_set_name="scheduled", budget=budget_of(None, scenario, problem)
    )
    if not isinstance(found, Found):
        raise PlanError(f"{team}: no plan whose claims could be altered")
    document = plan_document(found.plan) | {"digest": ""}
    own = scenario_budgets(scenario, problem).derive()
    budgets = replace(scenario_budgets(scenario, problem), derive=lambda: own)

    def refusal(answer: Document) -> str:
        try:
            verify_plan(read_plan(File(team, answer)), problem, gains, budgets=budgets)
        except (RefusalError, PlanError) as error:
            return str(error)
        return ""

    if why := refusal(copied(document)):
        raise PlanError(f"{team}: {why}")

    def judged() -> Iterator[Judged]:
        for seed in range(rounds):
            for kind, alter in CLAIMS.items():
                altered = copied(document)
                alter(altered, np.random.default_rng([seed, crc32(kind.encode())]))
                yield Judged("claims of a plan", kind, "false: not what follows", refusal(altered))

    return list(judged())
