"""How transports end, and how they fail."""

import json
from dataclasses import replace
from math import pi

import numpy as np
import pytest
from shapely import box

from benchmarks.one_process import DirectExchange, simulate_apart
from coop_drake.answers.plan import Found
from coop_drake.apart import RobotNode
from coop_drake.apart.messages import Place, Switch
from coop_drake.chain import plan
from coop_drake.diagram import build_station
from coop_drake.diagram.robot_controller import robot_knowledge
from coop_drake.scenario import load_scenario, with_gains
from coop_drake.simulation import build_maps, run, simulate
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import ROOM
from tests.support.small_scenario import small_scenario
from tests.support.turret import write_turret

SAMPLED = "deployment: {control_rate: 100}"
BUDGET = "deployment: {preset: mobile_base, budget: all}"


class Wrapping(DirectExchange):
    """Sensors of the object's angle and of joints show them in (-pi, pi]."""

    def step(self, time, measured, stamps=None):
        return super().step(time, [self._wrapped(own) for own in measured], stamps)

    def look(self, time, measured, stamps=None):
        return super().look(time, [self._wrapped(own) for own in measured], stamps)

    @staticmethod
    def _wrapped(own):
        """What a robot with one joint measures: x, y, yaw, q, their rates, and the object's pose."""
        shown = own.copy()
        shown[[3, 10]] = np.arctan2(np.sin(own[[3, 10]]), np.cos(own[[3, 10]]))
        return shown


@pytest.fixture(scope="module")
def sampled(tmp_path_factory):
    """Scenario of a sampled team, its plan and maps; the joint begins four turns from where it ends."""
    path = write_turret(tmp_path_factory.mktemp("turret"), 3.0 + 8.0 * pi, -3.1, more=SAMPLED)
    scenario = with_gains(load_scenario(path), "scheduled")
    answer = plan(scenario)
    assert isinstance(answer, Found)
    return scenario, answer.plan, build_maps(answer.plan)


@pytest.mark.slow
@pytest.mark.parametrize("more", ["", BUDGET], ids=["ideal", "under a budget"])
def test_a_turret_turns_through_pi_and_arrives(tmp_path, more):
    path = write_turret(tmp_path, 3.0, 3.3, more=more)
    ran = invoke("run", path, "--out", tmp_path, "--no-figures", "--json")
    assert ran.exit_code == 0
    assert json.loads(ran.stdout)["outcome"] == "arrived"
    assert "notes" not in json.loads(ran.stdout)
    assert invoke("verify", tmp_path / "plan.json", path).exit_code == 0
    assert invoke("verify", tmp_path / "log.npz", path).exit_code == 0


def test_robots_unwrap_what_their_sensors_show(sampled):
    scenario, made, maps = sampled
    usual = simulate(scenario, made, maps)
    wrapped = simulate_apart(scenario, made, maps, exchange=Wrapping())
    assert usual.reached
    assert wrapped.reached
    np.testing.assert_allclose(wrapped.joints[-1], usual.joints[-1], atol=1e-6)
    assert wrapped.joints[-1, 0] == pytest.approx(10.0 * pi - 3.1, abs=0.02)


def test_a_robot_that_is_started_again_counts_turns_from_its_cell(sampled):
    scenario, made, maps = sampled
    team = build_station(scenario).team
    node = RobotNode(robot_knowledge(scenario, made, maps, team)[0], scenario.deployment, 0, "robot_0")
    node.forget()
    node.hear([Switch(0, 0)])
    at_start = np.array([*made.start[:3], 3.0, *[0.0] * 4, *made.start[:3]])
    shown = node.look(0.0, at_start)
    assert np.array_equal(shown, node.look(0.0, np.where(np.arange(11) == 3, made.start[3], at_start)))
    node.step(0.0, at_start, stopped=True)
    assert node.place == Place(True, 0, 0)
    node.release()


@pytest.mark.parametrize(
    ("kind", "limits", "note"),
    [
        ("revolute", "", "turret.urdf: revolute joints without limits are circles, as continuous ones"),
        (
            "continuous",
            'lower="-6.28" upper="6.28"',
            "turret.urdf: limits of continuous joints are kept, so that these are no circles",
        ),
    ],
)
def test_a_plan_names_joints_whose_kind_and_limits_differ(tmp_path, kind, limits, note):
    path = write_turret(tmp_path, 3.0, 3.3, kind=kind, limits=limits)
    planned = invoke("plan", path, "--out", tmp_path, "--json", "--effort", 0)
    assert json.loads(planned.stdout)["notes"] == [f"{note}: turret_joint"]


def test_a_transport_ends_off_a_goal_in_collision_and_within_its_tolerance(tmp_path):
    """The object, half a metre wide, has its middle 0.24 m from the wall; the tolerance is 0.03 m."""
    goal = {"object": {"x": 3.2, "y": 0.24, "theta": 0.0}, "tolerances": {"position": 0.03}}
    scenario, out = write_scenario(tmp_path / "room.scenario.yaml", goal=goal), tmp_path / "out"
    run = invoke("run", scenario, "--out", out, "--no-figures", "--json")
    assert run.exit_code == 0, run.stderr
    assert json.loads(run.stdout)["final_position_error_m"] < 0.03
    last = json.loads((out / "plan.json").read_text())["transitions"][-1]
    assert last["target"][1] > 0.25
    for name, answer in (("plan.json", "found"), ("log.npz", "arrived")):
        verified = invoke("verify", out / name, scenario, "--json")
        assert (verified.exit_code, json.loads(verified.stdout)["answer"]) == (0, answer)


# Runs that must fail, and must say why.


@pytest.fixture(scope="module")
def problem():
    return small_problem("base")


def with_cell(plan, index, **changes):
    cells = [replace(cell, **changes) if k == index else cell for k, cell in enumerate(plan.cells)]
    return replace(plan, cells=tuple(cells))


def with_transition(plan, index, **changes):
    transitions = [replace(one, **changes) if k == index else one for k, one in enumerate(plan.transitions)]
    return replace(plan, transitions=tuple(transitions))


def failed(scenario, plan, seconds=None):
    if seconds is not None:
        scenario = replace(scenario, simulator=replace(scenario.simulator, max_time=seconds))
    log = simulate(scenario, plan, small_maps())
    assert not log.reached
    return log


def test_a_wall_moved_into_the_cell_is_hit_and_named(problem):
    log = failed(small_scenario("base", box(0.0, 0.0, 6.0, 7.0)), problem[1])
    assert "clearance between robot_" in log.violation
    assert "and the walls is -" in log.violation
    assert f"at t = {log.times[-1]:.6g} s in cell {log.cell_index[-1]}" in log.violation
    assert log.workspace_clearance[-1] <= 0.0 < log.workspace_clearance[:-1].min()


def test_a_start_in_a_wall_ends_the_run_at_once(problem):
    log = failed(small_scenario("base", ROOM - box(2.9, 2.9, 3.1, 3.1)), problem[1])
    assert len(log.times) == 1
    assert log.violation.startswith("at t = 0 s in cell 0: clearance between object::body and the walls is -")


START = box(2.9, 2.9, 3.1, 3.1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda plan: {"tidied": plan.cells[0].tidied - START},
            "distance of the object to the boundary of cell 0 is -",
        ),
        (
            lambda plan: {"upper": np.array([0.15, 0.3, 0.3])},
            "distance of object angle to its slice is -",
        ),
        (lambda plan: {"tidied": box(2.2, 2.2, 4.4, 2.9)}, "Delta E is -"),
    ],
)
def test_a_cell_that_does_not_hold_the_team_is_a_violation(problem, change, words):
    scenario, plan = problem
    assert words in failed(scenario, with_cell(plan, 0, **change(plan))).violation


def test_a_cell_that_is_never_left_stalls_and_names_what_blocks(problem, monkeypatch):
    monkeypatch.setattr(run, "PATIENCE_ALLOWANCE", 0.5)
    scenario, plan = problem
    shut = replace(plan.transitions[1].gains, energy_bound=np.zeros(3))
    never = with_transition(with_transition(plan, 1, gains=shut), 0, estimated_time=0.1)
    said = failed(scenario, never).violation
    assert said.startswith("stalled at t = 1.5")
    assert "in cell 0 of 3, entered at 0 s with 0.1 s estimated" in said
    assert "it waits until the energy of " in said
    assert "falls below the next funnel's bound (margin -" in said
    away = with_transition(with_cell(plan, 1, tidied=box(8.0, 5.0, 9.0, 6.0)), 0, estimated_time=0.1)
    said = failed(scenario, away).violation
    assert "it waits until the object's position is safe in the next cell (Delta E) (margin -" in said


def test_too_little_time_and_a_goal_that_is_not_reached_are_reported_with_what_is_missing(problem):
    scenario, plan = problem
    said = failed(scenario, plan, 0.2).violation
    assert said.startswith("no arrival within max_time = 0.2 s at t = 0.2 s in cell 0 of 3")
    elsewhere = replace(plan, goal_pose=plan.goal_pose + np.array([0.5, 0.0, 0.0]))
    said = failed(scenario, elsewhere, 4.0).violation
    assert "it waits until the object reaches its goal position (margin -" in said


def test_progress_grows_to_one_and_ctrl_c_passes_through(problem):
    told = []
    log = simulate(*problem, small_maps(), progress=lambda stage, part: told.append((stage, part)))
    assert log.reached
    assert {stage for stage, _ in told} == {"simulating"}
    parts = [part for _, part in told]
    assert parts == sorted(parts)
    assert parts[-1] == 1.0

    def interrupt(stage, fraction):
        if fraction > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(*problem, small_maps(), progress=interrupt)
