"""The governor: its law, energies, and hand-overs, in which gains and accelerations move smoothly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from shapely import box

from coop_drake import laws
from coop_drake.geometry.polygons import edges_of
from coop_drake.laws.axis_table import (
    axis_table,
    track_axes,
    track_row,
    write_jumps,
)
from coop_drake.laws.gains import schedule_of
from coop_drake.laws.governor import ATTRACTION_RATE, VELOCITY_STEP
from coop_drake.laws.ppc import STEEPEST, fading, governed_gains, shortest_hand_over
from coop_drake.scenario import SimulatorSettings
from coop_drake.systems.kernels import cell_margin

K, K_G = 50.0, 5.0


def test_the_field_leads_while_the_margin_is_large():
    velocity = laws.governor_velocity(0.3, -0.4, 100.0, K, K_G, 0.0)
    assert velocity == pytest.approx([1.5, -2.0])


@pytest.mark.parametrize("smoothing", [0.0, 0.001, 0.1])
def test_the_root_leads_while_the_margin_is_small(smoothing):
    velocity = laws.governor_velocity(0.6, -0.8, 0.02, K, K_G, smoothing)
    root = np.sqrt(0.02 / 50.0 + smoothing**2) - smoothing
    assert velocity == pytest.approx(5.0 * root * np.array([0.6, -0.8]))


def test_the_smoothed_root_is_lipschitz_and_the_printed_one_is_not():
    def slope(smoothing, margin):
        return laws.governor_velocity(1.0, 0.0, margin, K, K_G, smoothing)[0] / margin

    assert slope(0.0, 1e-12) > 1e3 * slope(0.0, 1e-4)
    assert slope(0.001, 1e-12) <= 5.0 / (2.0 * 0.001 * 50.0)


def test_a_target_is_approached_no_faster_than_the_integrator_can_follow():
    """Copies of p_G that differ by rounding must not drift apart: the step stays in RK's stable region."""
    for governor_gain in (5.0, 16.0):
        near = 0.01 * laws.slowdown_radius(0.7, governor_gain)
        field = 0.7 * near / laws.slowdown_radius(0.7, governor_gain)
        speed, _ = laws.governor_velocity(field, 0.0, 1e6, 50.0, governor_gain, 0.0)
        assert speed / near == pytest.approx(ATTRACTION_RATE)
    assert ATTRACTION_RATE * SimulatorSettings().max_step_size < 1.0


def test_the_loops_margin_is_the_law_with_velocities_in_steps():
    state, governor = np.array([1.0, 2.0, 0.3, 0.2, -0.1, 0.4]), np.array([1.1, 1.95])
    vx, vy = np.round(state[3:5] / VELOCITY_STEP) * VELOCITY_STEP
    edges = edges_of(box(0.0, 0.0, 1.5, 9.0))  # p_G is 0.4 from them
    expected = laws.energy_margin(laws.tracking_energy(1.0 - 1.1, 2.0 - 1.95, vx, vy, K), 0.4, K)
    assert cell_margin(edges, K, state, governor) == pytest.approx((expected, 0.4), rel=1e-13)
    assert abs(state[3:5] - [vx, vy]).max() <= 0.5 * VELOCITY_STEP
    # Rounding of the measured velocity does not reach the margin.
    rounded = state * (1.0 + 1e-14 * np.array([0, 0, 0, 1, -1, 1]))
    assert cell_margin(edges, K, rounded, governor) == cell_margin(edges, K, state, governor)


def test_accelerations_and_energies_by_hand():
    assert laws.governed_acceleration(1.0, 0.5, 1.5, 50.0, 5.0) == 22.5
    assert laws.governed_acceleration(2.0, -1.0, 2.0, 50.0, 5.0) == 5.0
    assert laws.tracking_energy(0.0, -0.2, 3.0, 4.0, 50.0) == pytest.approx(0.5 * 25.0 + 0.5 * 50.0 * 0.04)
    assert laws.energy_margin(1.0, 0.4, 50.0) == pytest.approx(3.0)
    assert laws.energy_margin(0.0, 0.0, 50.0) == 0.0
    assert laws.energy_margin(0.0, -0.4, 50.0) == pytest.approx(-4.0)


@pytest.mark.parametrize("smoothing", [0.0, 0.001])
@pytest.mark.parametrize("margin", [0.0, -1e-12, -3.0])
def test_the_governor_waits_without_margin_and_rests_where_the_field_vanishes(margin, smoothing):
    assert laws.governor_velocity(0.6, -0.8, margin, K, K_G, smoothing) == (0.0, 0.0)
    assert laws.governor_velocity(0.0, 0.0, 1.0, K, K_G, smoothing) == (0.0, 0.0)


ON_TIME = np.array([0.0, 1.0, 0.0])


AXES = {
    "slice_lower": np.array([0.0]),
    "slice_upper": np.array([1.0]),
    "goal_lower": np.array([0.7]),
    "goal_upper": np.array([0.95]),
}


def gains_of(clearance, gain_set=None, resting=0.3):
    return laws.transition_gains(
        gain_set or laws.ScheduledGains(), clearance=clearance, resting=np.array([resting]), **AXES
    )


def table_of(gains):
    return axis_table(laws.Funnel(**AXES, decay_rate=gains.decay_rate, shape=gains.funnel), gains)


def test_fading_falls_from_one_to_zero_and_nowhere_faster_than_it_says():
    assert (fading(0.0, 0.2), fading(0.2, 0.2), fading(0.3, 0.2), fading(0.0, 0.0)) == (1.0, 0.0, 0.0, 0.0)
    values = np.array([fading(t, 0.2) for t in np.linspace(0.0, 0.2, 2001)])
    assert np.all(np.diff(values) <= 0.0)
    assert -np.diff(values).min() / 1e-4 * 0.2 == pytest.approx(STEEPEST, rel=1e-5)


def test_gains_of_the_governor_go_from_those_of_the_last_cell_to_their_own():
    narrow, wide = gains_of(0.01), gains_of(2.0)
    row, T = wide.governor_row(narrow), wide.hand_over_time
    assert governed_gains(row, 0.0) == pytest.approx((narrow.stiffness, narrow.damping, narrow.governor_gain))
    assert governed_gains(row, T) == (wide.stiffness, wide.damping, wide.governor_gain)
    between = [governed_gains(row, t)[0] for t in np.linspace(0.0, T, 50)]
    assert np.all(np.diff(between) < 0.0)
    assert governed_gains(wide.governor_row(wide), 0.3 * T)[0] == pytest.approx(wide.stiffness)


def test_the_paper_s_gains_step():
    paper = gains_of(0.1, laws.FixedGains())
    assert paper.hand_over_time == 0.0
    assert governed_gains(paper.governor_row(gains_of(0.01)), 0.0) == (50.0, 5.0, 5.0)


@pytest.mark.parametrize("age", [0.0125, 0.03, 0.1])
def test_a_hand_over_takes_long_enough_for_the_largest_fall_of_k(age):
    rule = schedule_of(laws.ScheduledGains(command_age=age, hand_over_time=1e-3))
    most, least = rule.max_stiffness, rule.min_stiffness
    damping = rule.damping_factor * np.sqrt(least)
    assert rule.hand_over_time == max(1e-3, shortest_hand_over(most, least, damping))


def worst_margin(duration, heading, share):
    """Smallest Delta E, over K d^2 / 2, of an object that starts with none while p_G stands still."""
    clearance, narrow, wide = 0.2, gains_of(0.01), gains_of(2.0)
    row = wide.governor_row(narrow)
    row[7] = duration
    start = governed_gains(row, 0.0)[0]
    position = np.sqrt(share) * clearance * np.array([1.0, 0.0])
    velocity = np.sqrt((1.0 - share) * start) * clearance * np.array([np.cos(heading), np.sin(heading)])

    def flow(t, z):
        stiffness, damping, _ = governed_gains(row, t)
        return np.array([*z[2:], *laws.governed_acceleration(z[:2], z[2:], np.zeros(2), stiffness, damping)])

    times = np.linspace(0.0, duration, 200)
    run = solve_ivp(flow, (0.0, duration), [*position, *velocity], t_eval=times, rtol=1e-9, atol=1e-12)
    margins = []
    for t, z in zip(run.t, run.y.T, strict=True):
        stiffness = governed_gains(row, t)[0]
        margin = laws.energy_margin(laws.tracking_energy(*z, stiffness), clearance, stiffness)
        margins.append(margin / (0.5 * stiffness * clearance**2))
    return min(margins)


@settings(max_examples=30)
@given(st.floats(-np.pi, np.pi), st.floats(0.0, 1.0))
def test_delta_e_stays_while_k_falls(heading, share):
    """At the start the whole of what the clearance allows is used, by distance and by speed."""
    narrow, wide = gains_of(0.01), gains_of(2.0)
    assert worst_margin(wide.hand_over_time, heading, share) >= -1e-7
    assert wide.hand_over_time >= shortest_hand_over(narrow.stiffness, wide.stiffness, wide.damping)


def test_delta_e_would_not_stay_if_k_fell_at_once():
    assert worst_margin(1e-3, 0.0, 0.0) < -0.5


@settings(max_examples=30)
@given(st.floats(0.05, 0.95), st.floats(-0.2, 0.2), st.floats(-40.0, 40.0))
def test_an_axis_stays_in_its_funnel_whatever_the_jump(start, speed, jump):
    """V grows by at most jump^2 T / (8 k2) while the jump fades."""
    gains = gains_of(0.1)
    table, jumps, out = table_of(gains), np.array([jump]), np.empty(1)

    def flow(t, z):
        track_axes(table, t, ON_TIME, jumps, np.array([0.0, 0.0, z[0], 0.0, 0.0, z[1]]), z, out)
        return np.array([z[1], out[0]])

    T = gains.hand_over_time
    run = solve_ivp(flow, (0.0, T), [start, speed], rtol=1e-8, atol=1e-10, max_step=0.01 * T)
    energies = [track_row(table[0], t, *z)[1] for t, z in zip(run.t, run.y.T, strict=True)]
    assert max(energies) <= energies[0] + jump**2 * T / (8.0 * gains.rate_gain) + 1e-6
    assert 0.0 < run.y[0].min() <= run.y[0].max() < 1.0


def test_with_its_jump_the_next_law_begins_where_the_last_one_ends():
    table, next_table = (
        table_of(gains_of(0.1)),
        table_of(gains_of(0.1, laws.ScheduledGains(command_age=0.03))),
    )
    state, jumps, before, after = np.array([0.0, 0.0, 0.8, 0.0, 0.0, 0.1]), *np.empty((3, 1))
    write_jumps(table, next_table, 0.4, ON_TIME, state, state, jumps)
    track_axes(table, 0.4, ON_TIME, np.zeros(1), state, state, before)
    track_axes(next_table, 0.0, ON_TIME, jumps, state, state, after)
    assert after == pytest.approx(before, rel=1e-14)
    assert abs(jumps[0]) > 0.1
