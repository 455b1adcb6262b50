"""Every number of a plan is compared with something: altered ones are refused, but for free choices.

Each leaf of the plans' documents is altered: numbers up and down, truths, texts, lengths of lists, and
entries that are left out. What is refused nowhere stands in ``FREE``, with the inequality that it satisfies.
"""

import json
from copy import deepcopy
from dataclasses import is_dataclass, replace
from functools import cache
from types import UnionType
from typing import NamedTuple, Union, get_args, get_origin

import numpy as np
import pytest

from coop_drake.answers.budget import LIMITS
from coop_drake.answers.document import Document, problem_digest
from coop_drake.answers.plan import Plan, plan_document, read_plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import PlanError, RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.duration import timed
from coop_drake.planning.planner import plan as make
from coop_drake.planning.transitions import with_gains
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import scenario_budgets
from coop_drake.robustness.couplings import team_couplings
from coop_drake.scenario import load_scenario
from coop_drake.scenario.model import RobotLimits
from coop_drake.typed_data import field_types
from coop_drake.verification import answer as exact
from coop_drake.verification import budget as budgets_checked
from coop_drake.verification import verify_plan
from coop_drake.verification.budget_origin import check_origin
from tests.support.certificates import GAINS, room_with_pillar
from tests.support.motions import planned_motion, planned_under_budget, required_budget
from tests.support.scenarios import MODELS, resting
from tests.support.small_scenario import small_scenario


def last_cells(plan: Plan, problem: PlanningProblem, count: int) -> tuple[Plan, PlanningProblem]:
    """The last cells of a plan, and the question that they answer: from rest where the first is entered."""
    before = plan.transitions[-count - 1]
    start = np.concatenate([before.target, 0.5 * (before.goal_lower + before.goal_upper)])
    asked = replace(problem, start=start)
    cells, transitions = plan.cells[-count:], plan.transitions[-count:]
    ended = replace(plan, start=start, cells=cells, transitions=transitions)
    return timed(replace(ended, problem=problem_digest(asked))), asked


SCENARIOS = ("base", "warehouse", "three", "tight", "elbow")
"""The shipped scenarios that have a plan."""

CELLS = 2
"""So many cells of every plan are verified: the first and the last one are special."""

OUT = "left out"
"""What is altered of an entry that is not there any more."""


class Free(NamedTuple):
    """A free choice.

    Attributes:
        inequality: What it has to satisfy, in words.
        beyond: Factors with which it does not; each has to be refused.
        at: Index of the transition in which that is tried.
        shifts: What is added to it, likewise.
    """

    inequality: str
    beyond: tuple[float, ...] = ()
    at: int = -1
    shifts: tuple[float, ...] = ()


FREE = {
    **dict.fromkeys(
        ("cells[].tidied.outer", "cells[].tidied.outer[]", "cells[].tidied.outer[][]"),
        Free("a region whose configurations are free, which holds path and target"),
    ),
    **dict.fromkeys(
        ("transitions[].path", "transitions[].path[]", "transitions[].path[][]"),
        Free("a line from the entry to the target inside the cell, that keeps the stated clearance"),
    ),
    **dict.fromkeys(
        (
            "transitions[].governed.outer",
            "transitions[].governed.outer[]",
            "transitions[].governed.outer[][]",
        ),
        Free("a region inside the cell by the room for departures, which holds the motion"),
    ),
    "transitions[].inradius": Free("at most the target's distance from both cells' boundaries", (1.1,)),
    "transitions[].neck": Free("at most the path's distance from the cell's boundary", (1.1,)),
    "departures.pull[]": Free("one that reproduces itself, from which all else follows", (0.9, 2.0)),
    "motion": Free("may be left out: then the team comes to rest in every cell"),
    "motion.rates[]": Free("at least what a stop needs, and within limits", (0.99, -1.0, 100.0)),
    "motion.waiting": Free("so that every stop ends before its cell is left", (0.0, 1.1, 10.0)),
    "motion.ramp": Free("likewise", (0.0, 1.1, 100.0)),
    "motion.start_rate": Free("at most what limits allow", (1.1, 10.0)),
}
"""All that may be altered in a plan without making a statement false."""

ADVICE = (
    "nothing refuses it. Let `verify` derive the number and compare it (coop_drake/verification: gains.py, "
    "budget.py), or, if it is a free choice, check its inequality there and add it to FREE with "
    "factors that break the inequality"
)


class Case(NamedTuple):
    document: dict
    problem: object
    gains: dict
    budgets: object


@cache
def case(name):
    """The last cells of a shipped scenario's plan."""
    scenario = resting(load_scenario(MODELS / f"{name}.scenario.yaml"))
    problem, gains = planning_problem(scenario), scenario.gain_sets
    found = make(problem, gains["scheduled"], gain_set_name="scheduled").plan
    plan, asked = last_cells(found, problem, CELLS)
    budgets = scenario_budgets(scenario, problem)
    own = budgets.derive()
    return Case(as_written(plan), asked, gains, replace(budgets, derive=lambda: own))


@cache
def tolerant():
    """A plan under a budget that its scenario requires."""
    plan, problem, _ = planned_under_budget("base")
    scenario = required_budget("base")
    budgets = scenario_budgets(scenario, problem)
    own = budgets.derive()
    return Case(as_written(plan), problem, scenario.gain_sets, replace(budgets, derive=lambda: own))


def as_written(plan):
    """The document of a plan, as its file holds it."""
    return json.loads(json.dumps(plan_document(plan) | {"digest": ""}))


@pytest.fixture(autouse=True)
def once_each(monkeypatch):
    """Ask once about every geometry and every loop and team, of which most alterations leave one alone."""
    known, ask = {}, exact.check

    def check(question, answer, progress):
        read = {"cells": answer["cells"], "start": question["start"]}
        read["transitions"] = [{key: one[key] for key in READ if key in one} for one in answer["transitions"]]
        key = json.dumps(read)
        if key not in known:
            try:
                known[key] = ask(question, answer, progress)
            except exact.RefusedError as error:
                known[key] = error
        if isinstance(known[key], Exception):
            raise known[key]
        return known[key]

    monkeypatch.setattr(exact, "check", check)
    monkeypatch.setattr(budgets_checked, "team_couplings", known_couplings)


COUPLINGS = {}


def known_couplings(budget, tree, cells):
    """What masses couple in cells, computed once for equal ones."""
    masses = budget.bodies, budget.bases, budget.rotors, budget.dampings, budget.limited, budget.ahead
    intervals = tuple((cell.lower.tobytes(), cell.upper.tobytes()) for cell in cells)
    key = (*masses, *(getattr(budget, name) for name in LIMITS), len(tree.joints), intervals)
    if key not in COUPLINGS:
        COUPLINGS[key] = team_couplings(budget, tree, cells)
    return COUPLINGS[key]


READ = ("target", "goal_lower", "goal_upper", "path", "neck", "length", "inradius")
"""Entries of a transition that the exact checker reads."""


def refusal(document, case):
    """Why a document is refused, None where it is accepted."""
    try:
        plan = read_plan(Document("altered", document))
        verify_plan(plan, case.problem, case.gains, budgets=case.budgets)
    except (RefusalError, PlanError) as error:
        return str(error)
    return None


def ways_of(value, way=()):
    """Ways to every entry of a document, leaves and what holds them."""
    entries = (
        value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    )
    own = [way] if way and way != ("digest",) else []  # the digest belongs to the file, not to the plan
    return [*own, *(place for key, one in entries for place in ways_of(one, (*way, key)))]


def kind_of(way):
    """A way without its numbers."""
    return "".join("[]" if isinstance(step, int) else f".{step}" for step in way).removeprefix(".")


def places(document):
    """The ways to every kind of entry that is not null."""
    found = {}
    for way in ways_of(document):
        found.setdefault(kind_of(way), []).append(way)
    return found


def alterations(value, key):
    """Other values of an entry: numbers up and down, truths, texts, lengths, and nothing at all."""
    others = [] if isinstance(key, int) else [OUT]
    if isinstance(value, bool):
        return [*others, not value]
    if isinstance(value, int):
        return [*others, value + 1, value - 1]
    if isinstance(value, float):
        step = max(0.1 * abs(value), 1e-3)
        return [*others, value + step, value - step]
    if isinstance(value, str):
        return [*others, f"{value}x"]
    if isinstance(value, list) and value:
        return [*others, value[:-1], [*value, value[-1]]]
    return [1.0] if value is None else others


def altered(document, way, value):
    """The document with another value at the end of a way, or without it."""
    changed = deepcopy(document)
    entry = value_at(changed, way[:-1])
    if value == OUT:
        del entry[way[-1]]
    else:
        entry[way[-1]] = value
    return changed


def value_at(document, way):
    for step in way:
        document = document[step]
    return document


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
def test_every_entry_of_a_plan_is_compared_or_a_free_choice(name):
    """Each scenario's plan has a part of the kinds altered, all of them together all kinds."""
    check_kinds(case(name), slice(SCENARIOS.index(name), None, len(SCENARIOS)))


@pytest.mark.slow
@pytest.mark.parametrize("of", ["budget", "departures", "transitions[].governed"])
def test_every_entry_of_a_budget_is_compared_or_a_free_choice(of):
    check_kinds(tolerant(), slice(None), of)


@pytest.mark.slow
def test_every_entry_of_a_way_that_limits_refuse_is_compared_or_a_free_choice():
    problem = room_with_pillar()
    problem = replace(problem, settings=replace(problem.settings, min_clearance=0.9))
    way = make(problem, GAINS["scheduled"], gain_set_name="scheduled").plan
    assert [refusal.limit for refusal in way.refused_by] == ["planner.min_clearance"]
    one = Case(as_written(way), problem, GAINS, None)
    check_kinds(one, slice(None))
    with pytest.raises(RefusalError, match="a way that limits refuse has none"):
        verify_plan(replace(way, budget=stated().budget), problem, GAINS)


@cache
def limited():
    """A plan whose gains are slowed until no limit of acceleration acts."""
    scenario = small_scenario()
    goal = replace(scenario.goal, joints={"robot_0": (0.4,), "robot_1": (-0.3,)})
    scenario = replace(scenario, goal=goal, limits={"*": RobotLimits(joint_accelerations=(0.5,))})
    problem = planning_problem(scenario)
    return Case(
        as_written(make(problem, ScheduledGains(), gain_set_name="scheduled").plan), problem, GAINS, None
    )


def test_every_entry_of_a_plan_with_limits_of_acceleration_is_compared_or_a_free_choice():
    assert limited().document["age_factor"] > 1.0
    check_kinds(limited(), slice(None))


def passed():
    """A plan of a team that passes from cell to cell."""
    plan, problem = planned_motion("base")
    return Case(as_written(plan), problem, GAINS, None)


def test_every_entry_of_a_motion_is_compared_or_a_free_choice():
    check_kinds(passed(), slice(None), "motion")


def fields_of(kind, way=""):
    """The places of all fields of a class of typed data in its document."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return [place for part in parts for place in fields_of(part, way)]
    if origin is tuple:
        return fields_of(parts[0], f"{way}[]")
    if not is_dataclass(kind):
        return []
    types = {name: field.kind for name, field in field_types(kind).items()}
    own = {name: f"{way}.{name}".removeprefix(".") for name in types}
    return [*own.values(), *(place for name, part in types.items() for place in fields_of(part, own[name]))]


@pytest.mark.slow
def test_every_field_of_a_plan_is_altered_in_one_of_these_tests_and_no_free_choice_is_of_none():
    shipped = {kind for name in SCENARIOS for kind in places(case(name).document)}
    shipped |= set(places(tolerant().document))
    kinds = shipped | set(places(limited().document)) | set(places(passed().document))
    assert set(FREE) <= shipped | set(places(passed().document))
    refused_by = {place for place in fields_of(Plan) if place.startswith("refused_by[]")}  # of ways, above
    missing = set(fields_of(Plan)) - kinds - refused_by
    assert not missing, f"no test alters {sorted(missing)}: add a case whose plan has these entries"


def check_kinds(one, some, of=""):
    assert refusal(one.document, one) is None
    kinds = {kind: ways for kind, ways in places(one.document).items() if kind.startswith(of)}
    for kind in sorted(kinds)[some]:
        if kind in FREE:
            check_beyond(one, kind, kinds[kind])
            continue
        way = kinds[kind][len(kind) % len(kinds[kind])]
        for other in alterations(value_at(one.document, way), way[-1]):
            changed = altered(one.document, way, other)
            if other != OUT or not says_the_same(changed, one.document):
                assert refusal(changed, one), (
                    f"{kind}: {other} instead of {value_at(one.document, way)}: {ADVICE}"
                )


def check_beyond(one, kind, ways):
    """A free choice beyond its inequality is refused, for the first axis of a transition."""
    free = FREE[kind]
    cells = len(one.document["cells"])
    way = next(way for way in ways if way[0] != "transitions" or way[1] == free.at % cells)
    value = value_at(one.document, way)
    others = [factor * value for factor in free.beyond] + [value + shift for shift in free.shifts]
    for other in others:
        assert refusal(altered(one.document, way, other), one), f"{kind}: {other} instead of {value}"


def says_the_same(document, other):
    """Whether two documents hold the same plan: entries that are left out have values, too."""
    try:
        return plan_document(read_plan(Document("", document))) == plan_document(
            read_plan(Document("", other))
        )
    except PlanError:
        return False


def stated():
    """The plan under a budget, as it was made."""
    return read_plan(Document("", tolerant().document))


def refused(plan, one, budgets=None):
    with pytest.raises(RefusalError) as error:
        verify_plan(plan, one.problem, one.gains, budgets=budgets or one.budgets)
    return error.value.where


def test_a_plan_without_the_required_budget_and_with_a_part_of_it_are_refused():
    one, plan = tolerant(), stated()
    position = replace(plan.budget, axes=False, **NO_EFFORTS)
    for budget, where in ((None, "budget"), (position, "budget.base_force")):
        with pytest.raises(RefusalError) as error:
            check_origin(budget, one.budgets)
        assert error.value.where == where
    assert refused(replace(plan, budget=plan.budget.scaled(0.9)), one) == "budget.delay"


def test_a_budget_that_is_not_required_is_the_scenarios_own_or_said_not_to_be():
    one, plan = tolerant(), stated()
    free = replace(one.budgets, required="none")
    own = verify_plan(plan, one.problem, one.gains, budgets=free)
    assert own.subject.endswith("the budget is that of the scenario's deployment, all")
    assert "a team that departs by no more than the plan's budget, as docs/budget.md says" in own.proved
    assert own.not_proved.startswith("that a team that departs by more than the plan's budget stays in the")
    assert "motors" not in own.not_proved  # The budget limits base forces.
    for smaller, said in (
        (
            {"model_error": 0.1},
            "the budget is not the scenario's: model_error is 0.1; the scenario gives 0.2",
        ),
    ):
        assert said in check_origin(replace(plan.budget, **smaller), free).name


NO_EFFORTS = {**dict.fromkeys(LIMITS), "joint_coulomb": 0.0, "joint_viscous": 0.0}
"""What a budget without bodies cannot have."""


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"rotors": (100.0, 100.0)}, "budget.rotors"),
        ({"bodies": (), "bases": (), "rotors": (1.0, 0.0), **NO_EFFORTS}, "budget.rotors"),
        ({"bodies": ((0.0, 1.0, 0.0, 0.0, 1.0, 1.0),)}, "budget.bodies"),
        ({"bases": ((1.0, 0.0, 0.0), (2.0, 0.0, 0.0))}, "budget.bases"),
        ({"base_force": 2000.0}, "budget.base_force"),
        ({"base_force": None}, "budget.base_force"),
    ],
)
def test_other_masses_than_the_teams_are_refused_in_any_budget(changes, where):
    one, plan = tolerant(), stated()
    away = plan.departures if changes.get("bodies", True) else replace(plan.departures, effort=np.empty(0))
    other = replace(plan, budget=replace(plan.budget, model_error=0.1, **changes), departures=away)
    assert refused(other, one, replace(one.budgets, required="none")) == where


def test_gains_for_commands_that_are_younger_than_the_teams_are_refused():
    """Twenty times younger, with all gains that follow from that."""
    one = case("base")
    plan = read_plan(Document("", one.document))
    quick = replace(plan, age_factor=0.05)
    assert refused(with_gains(quick, one.gains["scheduled"], plan.gain_set), one) == "age_factor"
