import numpy as np
import pytest

from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import VelocityField
from coop_drake.systems import GovernedCell, ReadyMonitor, axis_laws
from coop_drake.systems.kernels import ready_conditions
from tests.support.readiness import margin_of
from tests.support.small_loop import small_maps
from tests.support.small_plan import GOAL_POSE, POSITION_TOLERANCE, small_plan, stiffer_and_stiffer
from tests.support.system_checks import evaluate

PLAN = stiffer_and_stiffer(small_plan(("a", "b", "c")))
AXES = [0, 2, 3]
INPUTS = {
    "object_state": [3.8, 3.5, 0.3, 0.0, 0.0, 0.0],
    "robot_state": [1.0, 2.0, 0.3, 0.1, 0.12, *[0.0] * 5],
    "governor_position": [3.8, 3.5],
    "current_cell": [0.0, 0.0],
}


@pytest.fixture
def cells():
    return [
        GovernedCell(BoundaryDistance(cell.tidied), VelocityField(field_map), transition.gains)
        for cell, field_map, transition in zip(PLAN.cells, small_maps(), PLAN.transitions, strict=True)
    ]


@pytest.fixture
def monitor(cells):
    inradii = [transition.inradius for transition in PLAN.transitions]
    return ReadyMonitor(cells, axis_laws(PLAN, AXES), inradii, PLAN.goal_pose[:2], POSITION_TOLERANCE)


def conditions(cells):
    return ready_conditions(
        [law.table for law in axis_laws(PLAN, AXES)],
        [cell.clearance.edges for cell in cells],
        [cell.row for cell in cells],
        [transition.inradius for transition in PLAN.transitions],
        PLAN.goal_pose[:2],
        POSITION_TOLERANCE,
    )


@pytest.mark.parametrize("index", [0, 1])
def test_the_report_is_the_law_with_the_next_cells_energy(monitor, cells, index):
    inputs = {**INPUTS, "current_cell": [index, 0.0], "object_state": [3.8, 3.5, 0.3, 0.1, 0.0, 0.05]}
    expected = margin_of(
        conditions(cells)[index], [3.8, 3.5], [0.1, 0.0], INPUTS["governor_position"], [0.3, 0.1, 0.12],
        [0.05, 0.0, 0.0],
    )  # fmt: skip
    np.testing.assert_array_equal(evaluate(monitor, inputs, "ready", 10.0), [index, expected])


def test_ready_at_rest_on_the_target(monitor):
    target = PLAN.transitions[0].target
    middle = 0.5 * (PLAN.transitions[0].goal_lower + PLAN.transitions[0].goal_upper)[AXES]
    inputs = {
        **INPUTS,
        "object_state": [*target, middle[0], 0.0, 0.0, 0.0],
        "governor_position": target,
        "robot_state": [0.0, 0.0, 0.0, *middle[1:], *[0.0] * 5],
    }
    assert evaluate(monitor, inputs, "ready", 10.0)[1] > 0.0
    assert (
        evaluate(monitor, {**inputs, "object_state": [*target, middle[0], 9.0, 0.0, 0.0]}, "ready", 10.0)[1]
        < 0.0
    )
    assert evaluate(monitor, {**inputs, "governor_position": [2.5, 2.5]}, "ready", 10.0)[1] < 0.0
    moved = [0.0, 0.0, 0.0, middle[1] + 0.3, middle[2], *[0.0] * 5]
    assert evaluate(monitor, {**inputs, "robot_state": moved}, "ready", 10.0)[1] < 0.0


def test_in_the_last_cell_it_reports_arrival(monitor, cells):
    state = [0.0, 0.0, 0.0, 0.3, 0.28, 0.0, 0.0, 0.0, 0.001, 0.002]
    inputs = {
        **INPUTS,
        "current_cell": [2.0, 1.0],
        "object_state": [GOAL_POSE[0] + 0.002, GOAL_POSE[1], GOAL_POSE[2] + 0.001, 0.001, 0.0, 0.003],
        "robot_state": state,
    }
    expected = margin_of(
        conditions(cells)[2], inputs["object_state"][:2], [0.001, 0.0], [3.8, 3.5],
        [GOAL_POSE[2] + 0.001, 0.3, 0.28], [0.003, 0.001, 0.002],
    )  # fmt: skip
    assert expected > 0.0
    np.testing.assert_array_equal(evaluate(monitor, inputs, "ready", 10.0), [2.0, expected])


def test_bad_parameters_are_refused(cells):
    laws, goal = axis_laws(PLAN, AXES), np.zeros(2)
    with pytest.raises(ValueError, match="one inradius for each cell, not 3, 3 and 2"):
        ReadyMonitor(cells, laws, [0.1, 0.1], goal, 0.01)
    with pytest.raises(ValueError, match="one inradius for each cell, not 0, 0 and 0"):
        ReadyMonitor([], [], [], goal, 0.01)
    with pytest.raises(ValueError, match=r"position tolerance must be positive, not 0\.0"):
        ReadyMonitor(cells, laws, [0.1, 0.1, 0.1], goal, 0.0)


@pytest.mark.parametrize("axes_led", [False, True])
def test_in_the_last_cell_a_sampled_robot_says_what_it_measures_besides_what_leads_it(cells, axes_led):
    inradii = [transition.inradius for transition in PLAN.transitions]
    parts = cells, axis_laws(PLAN, AXES), inradii, PLAN.goal_pose[:2], POSITION_TOLERANCE
    sampled, last = ReadyMonitor(*parts, measured=True, axes_led=axes_led), len(cells) - 1
    middle = 0.5 * (PLAN.transitions[-1].goal_lower + PLAN.transitions[-1].goal_upper)
    inputs = {
        **INPUTS,
        "object_state": [*PLAN.goal_pose[:2], middle[0], 0.0, 0.0, 0.0],
        "robot_state": [1.0, 2.0, 0.3, middle[2], middle[3], *[0.0] * 5],
        "current_cell": [last, 0.0],
        "arrival": [0.4],
    }
    assert evaluate(sampled, inputs, "ready").tolist() == [last, 0.4]
    assert evaluate(sampled, {**inputs, "arrival": [-1.0]}, "ready").tolist() == [last, -1.0]
    moving = {**inputs, "object_state": [*inputs["object_state"][:5], 0.03]}
    assert (evaluate(sampled, moving, "ready")[1] < 0.0) == axes_led  # else the rate is a noisy measurement
    before = {**inputs, "current_cell": [0.0, 0.0], "arrival": [-1.0]}
    expected = evaluate(ReadyMonitor(*parts), {name: before[name] for name in INPUTS}, "ready")
    np.testing.assert_array_equal(evaluate(sampled, before, "ready"), expected)
