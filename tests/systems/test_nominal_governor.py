"""The nominal governor: its ports, its law, what it keeps to, and that no measurement moves p_G."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.diagram.knowledge import robot_knowledge
from coop_drake.laws.governor import energy_margin, tracking_energy
from coop_drake.laws.nominal import nominal_flow, tracked_acceleration
from coop_drake.plant import build_team_plant
from coop_drake.simulation import build_maps
from coop_drake.systems import NominalGovernor
from coop_drake.systems.kernels import nominal_room
from tests.support.system_checks import context_with, evaluate
from tests.support.tubes import BUDGET, tubed_problem


@cache
def known():
    """Cells and nominal motion as robot 0 knows them, with measurements that are two periods old."""
    scenario, plan = tubed_problem()
    team = build_team_plant(scenario, DiagramBuilder())
    robot = robot_knowledge(scenario, plan, build_maps(plan), team)[0]
    return robot.cells, replace(robot.motion, measurement_periods=2)


def measured(x=3.0, y=3.0):
    return {"object_state": [x, y, 0.2, 0.0, 0.0, 0.0], "current_cell": [0.0, 0.0]}


def stepped(system, context, steps):
    """States after every step, shape (steps, size)."""
    states = []
    for _ in range(steps):
        context.SetDiscreteState(system.EvalUniquePeriodicDiscreteUpdate(context))
        states.append(context.get_discrete_state_vector().CopyToVector())
    return np.array(states)


def test_the_reference_moves_alike_whatever_is_measured():
    system = NominalGovernor(*known())
    runs = [
        stepped(system, context_with(system, measured(*place)), 200) for place in ((3.0, 3.0), (9.0, -4.0))
    ]
    np.testing.assert_array_equal(*runs)
    assert np.linalg.norm(runs[0][-1, 4:6] - runs[0][0, 4:6]) > 0.1


def test_the_nominal_motion_is_the_flow_behind_the_reference():
    (cells, motion), system = known(), NominalGovernor(*known())
    states, gains = stepped(system, context_with(system, measured()), 100), cells[0].gains
    flow = nominal_flow(gains.stiffness, gains.damping, motion.period)
    for before, after in pairwise(states):
        for i in range(2):
            off, rate = flow @ (before[i] - before[4 + i], before[2 + i])
            assert after[i] == pytest.approx(before[4 + i] + off, abs=1e-14)
            assert after[2 + i] == pytest.approx(rate, abs=1e-14)


def test_the_nominal_motion_never_leaves_its_region_and_the_reference_keeps_its_speed():
    (cells, motion), system = known(), NominalGovernor(*known())
    states = stepped(system, context_with(system, measured()), 600)
    rooms = [
        nominal_room(cells[0].clearance.edges, cells[0].gains.stiffness, state[:4], state[4:6])
        for state in states
    ]
    assert min(rooms) >= 0.0
    steps = np.hypot(*np.diff(states[:, 4:6], axis=0).T)
    assert 0.5 * motion.tube.speed < steps.max() / motion.period <= motion.tube.speed * (1.0 + 1e-9)
    assert np.linalg.norm(states[-1, :2] - motion.targets[0]) < 1e-3


def test_the_command_compares_measurements_with_the_nominal_state_of_their_time():
    (cells, motion), system = known(), NominalGovernor(*known())
    context = context_with(system, measured())
    states, gains = stepped(system, context, 40), motion.tracking_row(cells[0])
    command = system.GetOutputPort("governor_command").Eval(context)
    now, then = states[-1], states[-3]
    for i, place in enumerate((3.0, 3.0)):
        expected = tracked_acceleration(
            place, 0.0, now[4 + i], (now[i], now[2 + i]), (then[i], then[2 + i]), tuple(gains)
        )
        assert command[2 + i] == pytest.approx(expected, rel=1e-12)
        assert command[i] == pytest.approx((now[4 + i] - states[-2][4 + i]) / motion.period)


def test_what_it_shows():
    (cells, motion), system = known(), NominalGovernor(*known())
    context = context_with(system, measured())
    state, gains = stepped(system, context, 30)[-1], cells[0].gains
    shown = system.GetOutputPort("nominal").Eval(context)
    np.testing.assert_array_equal(shown[:4], state[:4])
    energy = tracking_energy(*(state[:2] - state[4:6]), *state[2:4], gains.stiffness)
    margin = energy_margin(energy, cells[0].clearance(state[4:6]), gains.stiffness)
    assert shown[4] == system.GetOutputPort("energy_margin").Eval(context)[0] == pytest.approx(margin)
    assert 0.0 < shown[5] <= motion.report_periods * motion.period * motion.tube.speed
    np.testing.assert_array_equal(system.GetOutputPort("governor_position").Eval(context), state[4:6])


def test_at_rest_the_reference_waits_and_with_half_the_pace_it_is_half_as_fast():
    system = NominalGovernor(*known(), paced=True)
    distances = []
    for pace in (0.0, 0.5, 1.0):
        context = context_with(system, {**measured(), "clock": [0.0, pace, 0.0]})
        state = stepped(system, context, 1)[-1]
        distances.append(np.linalg.norm(state[4:6] - state[6:8]))
    assert distances[0] == 0.0
    assert distances[1] <= distances[2]
    assert distances[1] > 0.0


def test_refusals():
    cells, motion = known()
    with pytest.raises(ValueError, match="one target for each cell, not 3 for 0"):
        NominalGovernor([], motion)
    other = replace(cells[1], gains=replace(cells[1].gains, stiffness=70.0))
    with pytest.raises(ValueError, match="the same K in all cells"):
        NominalGovernor([cells[0], other, cells[2]], motion)
    with pytest.raises(RuntimeError, match="object_state"):
        evaluate(NominalGovernor(cells, motion), {"current_cell": [0.0, 0.0]}, "governor_command")
    assert BUDGET.period == motion.period
