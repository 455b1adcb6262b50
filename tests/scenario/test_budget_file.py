"""Budgets of a scenario's own departures, asked for by an option or required by the scenario."""

from dataclasses import replace
from math import sqrt
from types import SimpleNamespace

import pytest

import coop_drake
from coop_drake.answers import Found, Undecided, load_plan
from coop_drake.cli.simulate import read_plan
from coop_drake.cli.task import read_task
from coop_drake.errors import ScenarioError
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import budget_of
from coop_drake.scenario import Deployment, Measurements
from coop_drake.tree.component_tree import axis_levers
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

PRESET = {"preset": "mobile_base"}

UNLIMITED = {"actuators": {"base_force": None}}
"""A budget for the position alone bounds no efforts."""


GOAL = {"object": {"x": 3.5, "y": 2.0, "theta": 0.0}, "tolerances": {"position": 0.015}}


def scenario(folder, **deployment):
    return write_scenario(folder / "room.scenario.yaml", goal=GOAL, deployment={**PRESET, **deployment})


def test_the_budget_of_a_preset(tmp_path):
    found = coop_drake.load_scenario(scenario(tmp_path))
    problem = planning_problem(found)
    budget = budget_of("all", found, problem)
    assert budget_of(None, found, problem) is None
    with pytest.raises(ScenarioError, match="bounds no effort of angles and joints"):
        budget_of("position", found, problem)
    unlimited = coop_drake.load_scenario(scenario(tmp_path, **UNLIMITED))
    alone = dict.fromkeys(("bodies", "bases", "rotors", "dampings"), ())
    assert budget_of("position", unlimited, problem) == replace(budget, axes=False, base_force=None, **alone)
    assert sum(body[1] for body in budget.bodies) == pytest.approx(17.0)
    moved = [sum(body[1] for body in budget.bodies if body[5] == k) for k in (0, 1)]
    assert (budget.base_force, moved) == (650.0, pytest.approx([8.5, 8.5]))
    assert budget.bases == ((1.0, 0.35, 0.0), (2.0, -0.35, 0.0))
    assert (budget.delay, budget.lag, budget.model_error) == (0.01, 0.005, 0.2)
    assert budget.position_noise == pytest.approx(3.44 * 0.001 / sqrt(2.0))  # two robots of the same mass
    levers = budget.velocity_noise / (3.44 * 0.01 / sqrt(2.0))
    assert 1.5 < levers < 2.0  # the base's velocity, its yaw about 1.2 m away, the elbow 0.8 m away


def test_a_budget_counts_the_error_of_clocks_and_not_the_clocks_of_single_robots(tmp_path):
    found = coop_drake.load_scenario(scenario(tmp_path, clock_error=2e-4))
    assert budget_of("all", found, planning_problem(found)).clock_error == 2e-4
    assert found.deployment.command_age == pytest.approx(0.0177)
    alone = coop_drake.load_scenario(scenario(tmp_path, robots={"robot_0": {"clock_error": 1e-4}}))
    with pytest.raises(ScenarioError, match=r"deployment\.robots"):
        budget_of("all", alone, planning_problem(alone))
    file = write_scenario(tmp_path / "without.scenario.yaml", deployment={"clock_error": 1e-3})
    with pytest.raises(ScenarioError, match=r"0 without deployment\.control_rate"):
        planning_problem(coop_drake.load_scenario(file))


def test_a_budget_counts_bounded_errors_with_their_worst_signs(tmp_path):
    waves = {name: {"size": 0.001 * (1 + i)} for i, name in enumerate(("x", "y", "angle", "joints"))}
    waves |= {"velocity_x": {"size": 0.01}, "turn_rate": {"size": 0.02}, "joint_rates": {"size": 0.03}}
    with_waves = coop_drake.load_scenario(scenario(tmp_path, measurements={"waves": waves}))
    budget = budget_of("all", with_waves, planning_problem(with_waves))
    plain = coop_drake.load_scenario(scenario(tmp_path))
    usual = budget_of("all", plain, planning_problem(plain))
    assert budget.angle_noise - usual.angle_noise == pytest.approx(0.004)
    assert budget.rate_noise - usual.rate_noise == pytest.approx(0.02 + 0.03)  # one joint to each base
    assert budget.position_noise - usual.position_noise == pytest.approx(sqrt(5.0) * 0.001)
    reach, lever = axis_levers(planning_problem(plain).tree)[0], 0.8
    assert budget.velocity_noise - usual.velocity_noise == pytest.approx(
        0.01 + 0.02 * reach + 0.03 * lever, rel=0.05
    )


def test_a_required_budget_is_planned_for_without_an_option(tmp_path):
    file = scenario(tmp_path, budget="position", **UNLIMITED)
    result = invoke("plan", file, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "the position, not angles and joints" in " ".join(result.output.split())
    plan = load_plan(tmp_path / "out" / "plan.json")
    assert plan.departures is not None
    shown = invoke("verify", tmp_path / "out" / "plan.json", file, "--json").stdout
    assert "departures from the motion follow from the budget" in shown
    assert isinstance(coop_drake.plan(coop_drake.load_scenario(file)), Found)


def test_a_plan_under_another_budget_than_the_required_one_is_refused(tmp_path):
    """One without any budget, and one for the position alone where the axes are asked for, too."""
    plan = tmp_path / "out" / "plan.json"
    for made, asked, finding in (
        ("none", "all", "budget: is missing; the scenario requires `deployment.budget: all`"),
        ("position", "all", "budget.axes: is False; the scenario gives True"),
    ):
        without = scenario(tmp_path, budget=made, **UNLIMITED)
        assert invoke("plan", without, "--out", plan.parent).exit_code == 0
        file = scenario(tmp_path, budget=asked, **UNLIMITED)
        refused = invoke("verify", plan, file)
        assert (refused.exit_code, finding in " ".join(refused.output.split())) == (1, True), refused.output
        said = []
        read_plan(read_task(file), plan, SimpleNamespace(say=said.append, facts={}))
        assert ["`verify` will refuse the run" in line for line in said] == [True]


def test_a_budget_of_a_file_is_said_not_to_be_the_scenarios(tmp_path):
    (tmp_path / "budget.yaml").write_text("{position_noise: 0.001, axes: false}")
    file = scenario(tmp_path, **UNLIMITED, robots={"*": {"odometry_scale": 0.01}})
    plan = tmp_path / "out" / "plan.json"
    assert invoke("plan", file, "--budget", tmp_path / "budget.yaml", "--out", plan.parent).exit_code == 0
    said = " ".join(invoke("verify", plan, file).output.split())
    assert "the budget is not the scenario's: deployment.robots is" in said


def test_another_budget_than_the_required_one_is_planned_for_with_a_warning(tmp_path):
    file = scenario(tmp_path, budget="all", **UNLIMITED)
    said = " ".join(invoke("plan", file, "--budget", "position", "--out", tmp_path / "out").output.split())
    assert "--budget position: the scenario requires the budget all; `verify` will refuse the plan" in said


def test_a_required_budget_that_does_not_hold_is_a_negative_answer(tmp_path):
    file = scenario(tmp_path, budget="position", **UNLIMITED, measurements={"position_noise": 0.02})
    result = invoke("plan", file, "--out", tmp_path / "out")
    said = " ".join(result.output.split())
    assert result.exit_code == 4, result.output
    assert "No plan was found that holds under this budget: the team may rest" in said
    assert "mm or mrad from its goal, and the tolerance is 15 mm or mrad. One holds under" in said
    assert isinstance(coop_drake.plan(coop_drake.load_scenario(file)), Undecided)


def test_a_budget_needs_a_control_rate_and_a_known_name(tmp_path):
    for deployment, key in (({"budget": "all"}, "control_rate"), ({"budget": "half"}, "budget")):
        file = write_scenario(tmp_path / "room.scenario.yaml", deployment=deployment)
        result = invoke("plan", file, "--out", tmp_path / "out")
        assert (result.exit_code, key in result.output) == (2, True)


def test_a_team_with_nothing_but_a_budget_is_ideal():
    assert Deployment(budget="position").ideal
    assert not Deployment(budget="position", measurements=Measurements(delay=0.01)).ideal


@pytest.mark.parametrize(
    ("key", "departures"),
    [
        ("measurements.loss", {"measurements": {"loss": 0.1}}),
        ("measurements.late", {"measurements": {"late": 0.1, "late_by": 0.005}}),
        ("messages.repeat", {"messages": {"repeat": 0.1}}),
        ("robots", {"robots": {"*": {"odometry_scale": 0.01}}}),
        ("floor", {"floor": {"slope": 0.01}}),
        ("pushes", {"pushes": [{"body": "object", "force": [1.0, 0.0], "time": 1.0, "duration": 1.0}]}),
    ],
)
def test_a_departure_that_no_budget_counts_is_refused(key, departures, tmp_path):
    found = coop_drake.load_scenario(scenario(tmp_path, budget="all", **departures))
    with pytest.raises(ScenarioError, match="none counts this") as refused:
        budget_of(None, found, planning_problem(found))
    assert refused.value.key == f"deployment.{key}"
