from dataclasses import replace

import numpy as np
import pytest

from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import VelocityField
from coop_drake.laws import governed_acceleration, governor_velocity
from coop_drake.laws.governor import object_energy_margin
from coop_drake.systems import GovernedCell, ReferenceGovernor
from tests.support.small_loop import small_maps
from tests.support.small_plan import small_plan
from tests.support.system_checks import evaluate

PLAN = small_plan(("a", "b"))
INPUTS = {
    "object_state": [3.1, 3.2, 0.3, 0.2, -0.1, 0.4],
    "governor_position": [3.2, 3.15],
    "current_cell": [1.0, 2.0],
}


@pytest.fixture
def cells():
    return [
        GovernedCell(BoundaryDistance(cell.tidied), VelocityField(field_map), transition.gains)
        for cell, field_map, transition in zip(PLAN.cells, small_maps(), PLAN.transitions, strict=True)
    ]


def expected_margin(cell, inputs):
    state, governor = np.array(inputs["object_state"]), np.array(inputs["governor_position"])
    return object_energy_margin(state, governor, cell.clearance(governor), cell.gains.stiffness)


def test_a_slower_clock_slows_the_governor_alone(cells):
    command = evaluate(ReferenceGovernor(cells), INPUTS, "governor_command")
    paced = ReferenceGovernor(cells, paced=True)
    slowed = evaluate(paced, {**INPUTS, "clock": [0.1, 0.25, -0.5]}, "governor_command")
    np.testing.assert_array_equal(slowed, [*(0.25 * command[:2]), *command[2:]])


@pytest.mark.parametrize("index", [0, 1, 2])
def test_outputs_are_the_law_of_the_current_cell(cells, index):
    inputs = {**INPUTS, "current_cell": [index, 2.0], "governor_position": [4.1, 3.15]}
    inputs["object_state"] = [4.15, 3.2, 0.3, 0.2, -0.1, 0.4]
    system, cell, gains = ReferenceGovernor(cells), cells[index], cells[index].gains
    governor = np.array(inputs["governor_position"])
    margin = expected_margin(cell, inputs)
    np.testing.assert_allclose(evaluate(system, inputs, "energy_margin"), [margin], rtol=1e-15)
    velocity, acceleration = np.split(evaluate(system, inputs, "governor_command"), 2)
    np.testing.assert_array_equal(
        acceleration,
        governed_acceleration(
            np.array(inputs["object_state"][:2]),
            np.array(inputs["object_state"][3:5]),
            governor,
            gains.stiffness,
            gains.damping,
        ),
    )
    np.testing.assert_array_equal(
        velocity,
        governor_velocity(
            *cell.field(governor), margin, gains.stiffness, gains.governor_gain, gains.smoothing
        ),
    )
    assert np.linalg.norm(velocity) > 0.0


def test_the_governor_waits_while_the_energy_margin_is_not_positive(cells):
    inputs = {**INPUTS, "object_state": [3.1, 3.2, 0.3, 9.0, 0.0, 0.0]}
    assert evaluate(ReferenceGovernor(cells), inputs, "energy_margin")[0] < 0.0
    np.testing.assert_array_equal(
        evaluate(ReferenceGovernor(cells), inputs, "governor_command")[:2], [0.0, 0.0]
    )


def test_rounding_in_the_velocity_does_not_reach_the_governor(cells):
    """Robots compute it through different arms; their copies of p_G must stay alike."""
    system = ReferenceGovernor(cells)
    state = np.array(INPUTS["object_state"])
    other = state * (1.0 + 1e-14 * np.array([0, 0, 0, 1, -1, 1]))
    velocities = [
        evaluate(system, {**INPUTS, "object_state": s}, "governor_command")[:2] for s in (state, other)
    ]
    assert np.any(other != state)
    np.testing.assert_array_equal(*velocities)


@pytest.mark.parametrize("index", [-1, 3])
def test_a_cell_outside_the_plan_is_refused(cells, index):
    with pytest.raises(IndexError, match=f"current_cell is {index}; the plan has cells 0 to 2"):
        evaluate(ReferenceGovernor(cells), {**INPUTS, "current_cell": [index, 0.0]}, "energy_margin")


def test_no_cells_are_refused():
    with pytest.raises(ValueError, match="ReferenceGovernor needs at least one cell"):
        ReferenceGovernor([])


def test_a_stiffer_cell_has_another_margin(cells):
    cell = cells[0]
    stiffer = replace(cell, gains=replace(cell.gains, stiffness=2.0 * cell.gains.stiffness))
    soft, hard = (
        evaluate(ReferenceGovernor([kept]), {**INPUTS, "current_cell": [0.0, 0.0]}, "energy_margin")
        for kept in (cell, stiffer)
    )
    assert hard[0] > soft[0]
