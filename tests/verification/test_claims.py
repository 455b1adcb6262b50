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
from coop_drake.plant.facts import budget_of, scenario_budgets
from coop_drake.scenario import Deployment, load_scenario
from coop_drake.scenario.model import RobotLimits
from coop_drake.typed_data import convert_class, field_types
from coop_drake.verification import answer as exact
from coop_drake.verification import budget as budgets_checked
from coop_drake.verification import verify_plan
from coop_drake.verification.budget_origin import check_origin
from coop_drake.verification.gains import check_ages
from tests.support.certificates import GAINS, room_with_pillar
from tests.support.motions import planned_motion
from tests.support.scenarios import MODELS
from tests.support.small_scenario import small_scenario


def last_cells(plan: Plan, problem: PlanningProblem, count: int) -> tuple[Plan, PlanningProblem]:
    """The last cells of a plan, and the question that they answer: from rest where the first is entered."""
    before = plan.transitions[-count - 1]
    start = np.concatenate([before.target, 0.5 * (before.goal_lower + before.goal_upper)])
    asked = replace(problem, start=start)
    cells, transitions = plan.cells[-count:], plan.transitions[-count:]
    restart = plan.restart and replace(plan.restart, departures=plan.restart.departures[-count:])
    ended = replace(plan, start=start, cells=cells, transitions=transitions, restart=restart)
    return timed(replace(ended, problem=problem_digest(asked))), asked


SCENARIOS = ("base", "warehouse", "three", "tight", "elbow")
"""The shipped scenarios that have a plan."""

EFFORTS = {"base_torque": 500.0, "joint_effort": 500.0}
"""Limits of efforts beside that of the preset [N m]."""

CLOCKS = "warehouse"
"""The scenario whose clocks are wrong."""

RUBBING, FRICTION = "base", {"coulomb": 0.1, "viscous": 0.05}
"""The scenario whose joints have friction, and how much [N m, N m s]."""

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


SAFE, HELD = "at least what the budget gives", "so that the tube that the plan states holds with it"

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
        Free("a region at least the tube's radius inside the cell, which holds path and target"),
    ),
    "transitions[].inradius": Free("at most the target's distance from both cells' boundaries", (1.1,)),
    "transitions[].neck": Free("at most the path's distance from the cell's boundary", (1.1,)),
    "transitions[].gains.rest.reach[]": Free(
        "between what is settled and 0.4 of the goal interval; next cell's entry set", (1e-6, 100.0), 0
    ),
    "transitions[].gains.rest.rate[]": Free("at least what is settled; next entry set", (1e-6, 30.0), 0),
    "transitions[].tolerance.rate_share": Free("above 0, at most 1; the gains follow from it", (2.0,)),
    "transitions[].tolerance.entry_lower[]": Free("at most " + SAFE[9:], shifts=(0.05,)),
    "transitions[].tolerance.entry_upper[]": Free(SAFE, shifts=(-0.05,)),
    "transitions[].tolerance.entry_rate_lower[]": Free("at most " + SAFE[9:], (-1.0,)),
    "transitions[].tolerance.entry_rate_upper[]": Free(SAFE, (-1.0,)),
    "transitions[].tolerance.entry_acceleration[]": Free(SAFE, (0.9,)),
    "transitions[].tolerance.distance[]": Free("above zero, and at most what the budget leaves", (1.2,)),
    "transitions[].tolerance.acceleration[]": Free(SAFE, (0.9,)),
    "transitions[].tolerance.settled[]": Free(SAFE + ", and within the condition of rest", (0.9, 1e9)),
    "transitions[].tolerance.settled_rate[]": Free(SAFE + ", and within the condition of rest", (0.9, 1e9)),
    "transitions[].tolerance.departure[]": Free(SAFE + ", less than what its distance leaves", (0.9,)),
    "transitions[].tolerance.rate_departure[]": Free(SAFE, (0.9,)),
    "transitions[].tolerance.alarm_times[]": Free("times from 0 on, with levels for what departs then"),
    "transitions[].tolerance.alarm[][]": Free(SAFE + ", and what it may miss has room", (0.9, 1e3)),
    "transitions[].tolerance.ahead_alarm[][]": Free(SAFE + ", and what it may miss has room", (0.9, 1e3)),
    "transitions[].tolerance.entry_parts[]": Free("parts with which the sets follow; more follow closer"),
    "transitions[].tolerance.effort[]": Free(SAFE + ", and at most its limit", (0.1, 1e9)),
    "axis_tracking.stiffness": Free(HELD, (0.5, 3.0)),
    "axis_tracking.damping": Free(HELD, (0.5, 3.0)),
    "axis_tracking.rate[]": Free("at least what the axis reaches; what follows from it holds", (0.01,)),
    "axis_tracking.acceleration[]": Free("at least what the axis reaches", (0.01,)),
    "axis_tracking.disturbance[]": Free(SAFE + ", and such that what follows from it holds", (0.3, 100.0)),
    "tube.tracking_stiffness": Free(HELD, (0.5, 3.0)),
    "tube.tracking_damping": Free(HELD, (0.5, 3.0)),
    "tube.speed": Free("at most the speed with which the tube holds", (1.1,)),
    "tube.radius": Free(SAFE + ", and at most what the governed regions leave", (0.99, 1.5)),
    "tube.rate": Free(SAFE, (0.99,)),
    "tube.velocity": Free(SAFE + ", and at most the limit of the object's speed", (0.99, 100.0)),
    "tube.rest": Free(SAFE + ", and less than the goal's tolerance", (0.99, 2.0)),
    "tube.acceleration": Free(SAFE, (0.99,)),
    "tube.ahead": Free(SAFE + ", and at most what its level leaves", (0.99, 1.01)),
    "restart": Free("may be left out: then nothing is promised about teams whose drives braked"),
    "restart.rate": Free("with which the stated departures follow, below the limits of rates", (1.5, 20.0)),
    "restart.acceleration": Free("likewise, below the limits of accelerations", (2.0, 100.0)),
    "restart.rest_rate": Free("at least what counts as rest, and so small that the tube holds", (0.5, 50.0)),
    "restart.wait": Free("at least as long as the loops' responses are", (0.5,)),
    "restart.departures[][]": Free(SAFE, (0.9,)),
    "motion": Free("may be left out: then the team comes to rest in every cell"),
    "motion.rates[]": Free("at least what a stop needs, and within limits", (0.99, -1.0, 100.0)),
    "motion.waiting": Free("so that every stop ends before its cell is left", (0.0, 1.1, 10.0)),
    "motion.ramp": Free("likewise", (0.0, 1.1, 100.0)),
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
def case(name, required):
    """The last cells of a shipped scenario's plan, with and without a budget that it requires."""
    scenario = load_scenario(MODELS / f"{name}.scenario.yaml")
    if required:
        departures = {"preset": "mobile_base", "budget": "all", "actuators": EFFORTS}
        departures |= {"clock_error": 1e-4} if name == CLOCKS else {}
        departures |= {"joint_friction": FRICTION} if name == RUBBING else {}
        deployed = Deployment.completed(departures)
        scenario = replace(scenario, deployment=convert_class(deployed, Deployment))
    problem, gains = planning_problem(scenario), scenario.gain_sets
    budget = budget_of(None, scenario, problem)
    found = make(problem, gains["scheduled"], gain_set_name="scheduled", budget=budget).plan
    plan, asked = last_cells(found, problem, CELLS)
    document = as_written(plan)
    budgets = scenario_budgets(scenario, problem)
    own = budgets.derive()
    return Case(document, asked, gains, replace(budgets, derive=lambda: own))


def as_written(plan):
    """The document of a plan, as its file holds it."""
    return json.loads(json.dumps(plan_document(plan) | {"digest": ""}))


@pytest.fixture(autouse=True)
def once_each(monkeypatch):
    """Ask once about every geometry and every loop, of which most alterations leave one alone."""
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
    monkeypatch.setattr(budgets_checked, "position_bounds", POSITION_BOUNDS)
    monkeypatch.setattr(budgets_checked, "axis_loop", AXIS_LOOP)


POSITION_BOUNDS, AXIS_LOOP = cache(budgets_checked.position_bounds), cache(budgets_checked.axis_loop)
"""Responses of the loops of a position and of axes, by their gains and their budget."""

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
@pytest.mark.parametrize("required", [False, True])
@pytest.mark.parametrize("name", SCENARIOS)
def test_every_entry_of_a_plan_is_compared_or_a_free_choice(name, required):
    """Each scenario's plan has a part of the kinds altered, all of them together all kinds."""
    check_kinds(case(name, required), slice(SCENARIOS.index(name), None, len(SCENARIOS)))


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
    shipped = {kind for name in SCENARIOS for kind in places(case(name, True).document)}
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


def stated(name="base", required=True):
    """The plan of a case, as it was made."""
    return read_plan(Document("", case(name, required).document))


def refused(plan, one, budgets=None):
    with pytest.raises(RefusalError) as error:
        verify_plan(plan, one.problem, one.gains, budgets=budgets or one.budgets)
    return error.value.where


def test_a_plan_without_the_required_budget_and_with_a_part_of_it_are_refused():
    one, plan = case("base", True), stated()
    position = replace(plan.budget, axes=False, **NO_EFFORTS)
    for budget, where in ((None, "budget"), (position, "budget.joint_coulomb")):
        with pytest.raises(RefusalError) as error:
            check_origin(budget, one.budgets)
        assert error.value.where == where
    assert refused(replace(plan, budget=plan.budget.scaled(0.9)), one) == "budget.delay"


def test_a_budget_that_is_not_required_is_the_scenarios_own_or_said_not_to_be():
    one, plan = case("base", True), stated()
    free = replace(one.budgets, required="none")
    own = verify_plan(plan, one.problem, one.gains, budgets=free)
    assert own.subject.endswith("the budget is that of the scenario's deployment, all")
    for smaller, said in (
        (
            {"model_error": 0.1},
            "the budget is not the scenario's: model_error is 0.1; the scenario gives 0.2",
        ),
    ):
        other = replace(plan, budget=replace(plan.budget, **smaller))
        assert said in verify_plan(other, one.problem, one.gains, budgets=free).subject


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
    one, plan = case("base", True), stated()
    other = replace(plan, budget=replace(plan.budget, model_error=0.1, **changes))
    assert refused(other, one, replace(one.budgets, required="none")) == where


def test_gains_for_commands_that_are_younger_than_the_teams_are_refused():
    """Twenty times younger, with all gains that follow from that."""
    one, plan = case("base", False), stated("base", False)
    quick = replace(plan, age_factor=0.05)
    assert refused(with_gains(quick, one.gains["scheduled"], plan.gain_set), one) == "age_factor"
    one, plan = case("base", True), stated()
    parts = [replace(part.tolerance, age_factor=0.5) for part in plan.transitions]
    quick = [replace(part, tolerance=own) for part, own in zip(plan.transitions, parts, strict=True)]
    with pytest.raises(RefusalError, match="those of nominal motions are"):
        check_ages(replace(plan, transitions=tuple(quick)), one.gains["scheduled"])
    parts = [replace(part.tolerance, rate_share=0.5) for part in plan.transitions]
    slow = [
        replace(part, tolerance=own, gains=replace(part.gains, rate_limit=None))
        for part, own in zip(plan.transitions, parts, strict=True)
    ]
    with pytest.raises(RefusalError, match="no rate is limited"):
        check_ages(replace(plan, transitions=tuple(slow)), one.gains["scheduled"])


def test_a_stiffer_governor_than_the_gain_set_allows_is_refused():
    """With the damping and the gain that follow from its K, in all transitions."""
    one, plan = case("base", True), stated()
    own = plan.transitions[0].gains
    stiffer = own.with_governor(4.0 * own.stiffness, 2.0 * own.damping, 2.0 * own.governor_gain)
    assert one.gains["scheduled"].max_stiffness < stiffer.stiffness
    parts = [
        replace(
            part, gains=part.gains.with_governor(stiffer.stiffness, stiffer.damping, stiffer.governor_gain)
        )
        for part in plan.transitions
    ]
    assert refused(replace(plan, transitions=tuple(parts)), one) == "transitions[0].gains.stiffness"
