import numpy as np
import pytest

from coop_drake.laws import (
    energy_margin,
    governed_acceleration,
    governor_velocity,
    slowdown_radius,
    tracking_energy,
)
from coop_drake.laws.governor import ATTRACTION_RATE, VELOCITY_STEP, object_energy_margin
from coop_drake.scenario import SimulatorSettings

K, K_G = 50.0, 5.0


def test_acceleration_pulls_to_the_governor_and_brakes():
    assert governed_acceleration(1.0, 0.5, 1.5, 50.0, 5.0) == 22.5
    assert governed_acceleration(2.0, -1.0, 2.0, 50.0, 5.0) == 5.0


def test_both_coordinates_may_be_given_at_once():
    acceleration = governed_acceleration(
        np.array([1.0, 2.0]), np.array([0.5, -1.0]), np.array([1.5, 2.0]), 50.0, 5.0
    )
    assert acceleration.tolist() == [22.5, 5.0]


def test_energy_is_kinetic_plus_elastic():
    energy = tracking_energy(0.0, -0.2, 3.0, 4.0, 50.0)
    assert energy == pytest.approx(0.5 * 25.0 + 0.5 * 50.0 * 0.04)


def test_margin_is_what_the_spring_may_still_store():
    assert energy_margin(1.0, 0.4, 50.0) == pytest.approx(3.0)
    assert energy_margin(0.0, 0.0, 50.0) == 0.0
    assert energy_margin(0.0, -0.4, 50.0) == pytest.approx(-4.0)


def test_the_field_leads_while_the_margin_is_large():
    velocity = governor_velocity(0.3, -0.4, 100.0, K, K_G, 0.0)
    assert velocity == pytest.approx([1.5, -2.0])


@pytest.mark.parametrize("smoothing", [0.0, 0.001, 0.1])
def test_the_root_leads_while_the_margin_is_small(smoothing):
    velocity = governor_velocity(0.6, -0.8, 0.02, K, K_G, smoothing)
    root = np.sqrt(0.02 / 50.0 + smoothing**2) - smoothing
    assert velocity == pytest.approx(5.0 * root * np.array([0.6, -0.8]))


@pytest.mark.parametrize("smoothing", [0.0, 0.001])
@pytest.mark.parametrize("margin", [0.0, -1e-12, -3.0])
def test_the_governor_waits_without_margin(margin, smoothing):
    assert governor_velocity(0.6, -0.8, margin, K, K_G, smoothing) == (0.0, 0.0)


def test_the_governor_rests_where_the_field_vanishes():
    assert governor_velocity(0.0, 0.0, 1.0, K, K_G, 0.0) == (0.0, 0.0)


def test_the_smoothed_root_is_lipschitz_and_the_printed_one_is_not():
    def slope(smoothing, margin):
        return governor_velocity(1.0, 0.0, margin, K, K_G, smoothing)[0] / margin

    assert slope(0.0, 1e-12) > 1e3 * slope(0.0, 1e-4)
    assert slope(0.001, 1e-12) <= 5.0 / (2.0 * 0.001 * 50.0)


def test_a_target_is_approached_no_faster_than_the_integrator_can_follow():
    """Copies of p_G that differ by rounding must not drift apart: the step stays in RK's stable region."""
    for governor_gain in (5.0, 16.0):
        near = 0.01 * slowdown_radius(0.7, governor_gain)
        field = 0.7 * near / slowdown_radius(0.7, governor_gain)
        speed, _ = governor_velocity(field, 0.0, 1e6, 50.0, governor_gain, 0.0)
        assert speed / near == pytest.approx(ATTRACTION_RATE)
    assert ATTRACTION_RATE * SimulatorSettings().max_step_size < 1.0


def test_the_loops_margin_is_the_law_with_velocities_in_steps():
    state, governor = np.array([1.0, 2.0, 0.3, 0.2, -0.1, 0.4]), np.array([1.1, 1.95])
    vx, vy = np.round(state[3:5] / VELOCITY_STEP) * VELOCITY_STEP
    expected = energy_margin(tracking_energy(1.0 - 1.1, 2.0 - 1.95, vx, vy, K), 0.4, K)
    assert object_energy_margin(state, governor, 0.4, K) == expected
    assert abs(state[3:5] - [vx, vy]).max() <= 0.5 * VELOCITY_STEP
    # Rounding of the measured velocity does not reach the margin.
    assert (
        object_energy_margin(state * (1.0 + 1e-14 * np.array([0, 0, 0, 1, -1, 1])), governor, 0.4, K)
        == expected
    )
