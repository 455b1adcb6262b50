"""How far a team departs from its motion: bounds against simulations of the loop, worst inputs included."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.answers.budget import Budget
from coop_drake.answers.motion import Motion
from coop_drake.laws.motion import motion_at
from coop_drake.robustness.couplings import Couplings
from coop_drake.robustness.tracking import (
    Moving,
    departures_of,
    gain_sums,
    loop_sums,
    moving_of,
    noises,
    team_loop,
    unknown_time,
)

BUDGET = Budget(
    control_rate=200.0, delay=0.01, lag=0.005, angle_noise=1e-3, rate_noise=0.02, position_noise=2e-3,
    velocity_noise=0.03, single_noise=1.4, model_error=0.15, acceleration_error=0.2, axis_error=0.3,
)  # fmt: skip
GAINS = (120.0, 20.0)
UNSTABLE = (4e5, 900.0)
STILL = Moving(*np.zeros((3, 1, 2)))


def uncoupled(axes=1):
    rows = 1, 1 + axes
    return Couplings(np.zeros((*rows, axes, axes)), np.zeros((*rows, 0, 2)), np.zeros((*rows, axes - 1)))


class Axis:
    """One axis whose robot follows a motion, integrated in small steps between samples."""

    def __init__(self, budget, epsilon, motion=None, steps=20):
        self.budget, self.epsilon, self.motion, self.steps = budget, epsilon, motion, steps
        self.delay = round(budget.delay * budget.control_rate)

    def nominal(self, time):
        out = np.zeros((3, 3))
        if self.motion is not None:
            motion_at(self.motion.points, self.motion.period, time, 1.0, 0.0, out)
        return out[:, 2]

    def run(self, position_errors, rate_errors, pushes):
        """Return e and e' at all samples, by errors of measurements there and accelerations in periods."""
        T, lag, h = self.budget.period, self.budget.lag, self.budget.period / self.steps
        (x, v, followed), past, found = self.nominal(0.0), [], []
        for k, (n_x, n_v, w) in enumerate(zip(position_errors, rate_errors, pushes, strict=True)):
            now = self.nominal(k * T)
            found.append((x - now[0], v - now[1]))
            past.append((x - now[0] + n_x, v - now[1] + n_v))
            seen = past[k - self.delay] if k >= self.delay else (0.0, 0.0)
            u = self.nominal(k * T + 0.5 * T + lag)[2] - GAINS[0] * seen[0] - GAINS[1] * seen[1]
            for _ in range(self.steps):
                then = u + (followed - u) * np.exp(-h / lag)
                push = (1.0 + self.epsilon) * 0.5 * (followed + then) + w
                x, v, followed = x + h * v + 0.5 * h * h * push, v + h * push, then
        return np.array(found)


@pytest.mark.parametrize(("of", "name"), [(0, "position"), (1, "rate")])
@pytest.mark.parametrize("epsilon", [-0.15, 0.0, 0.15])
def test_worst_inputs_come_near_the_bound_and_never_above(of, name, epsilon):
    """At rest, every input with the sign of its response."""
    budget, zero, impulse = replace(BUDGET, model_error=abs(epsilon)), np.zeros(400), np.eye(1, 400)[0]
    bound = getattr(departures_of((GAINS, GAINS), budget, STILL, uncoupled()), name)[1]
    axis = Axis(budget, epsilon)
    to_noise, to_push = axis.run(impulse / GAINS[0], zero, zero), axis.run(zero, zero, impulse)
    reached = (1e-3 * GAINS[0] + 0.02 * GAINS[1]) * np.abs(to_noise[:, of]).sum()
    reached += 0.3 * np.abs(to_push[:, of]).sum()
    assert reached <= bound
    assert bound <= reached * (1.06 if epsilon == 0.0 and of == 0 else 1.4)


def motion_of(seed, spans=12):
    generator, points = np.random.default_rng(seed), np.zeros((spans + 3, 3))
    points[3:-3] = 0.15 * generator.normal(size=(spans - 3, 3)).cumsum(axis=0)
    points[-3:] = points[-4]
    return Motion(points, 0.1, np.array([[0.0, 0.1 * spans]]), np.zeros(1), 0.128, 0.1, 0.5, (GAINS, GAINS))


@settings(max_examples=15)
@given(st.integers(0, 1000), st.floats(-0.15, 0.15), st.integers(0, 3))
def test_a_team_on_its_motion_departs_by_no_more_than_is_stated(seed, epsilon, kind):
    motion, generator = motion_of(seed), np.random.default_rng(seed)
    away = departures_of((GAINS, GAINS), BUDGET, moving_of(motion), uncoupled())
    samples = round(motion.duration * BUDGET.control_rate)
    draw = (
        lambda: generator.choice([-1.0, 1.0], samples),
        lambda: np.ones(samples),
        lambda: np.sign(np.sin(np.arange(samples) * generator.uniform(0.02, 0.3))),
        lambda: np.zeros(samples),
    )[kind]
    found = np.abs(Axis(BUDGET, epsilon, motion).run(1e-3 * draw(), 0.02 * draw(), 0.3 * draw())).max(axis=0)
    assert found[0] <= away.position[1]
    assert found[1] <= away.rate[1]


def test_random_noise_moves_rates_and_accelerations_as_much_as_is_said():
    budget, samples = replace(BUDGET, model_error=0.0, acceleration_error=0.0, axis_error=0.0), 20000
    away = departures_of((GAINS, GAINS), budget, STILL, uncoupled())
    noise = (1e-3 + 0.02 * GAINS[1] / GAINS[0]) / 3.0 * np.random.default_rng(1).normal(size=samples)
    fast = Axis(budget, 0.0).run(noise, np.zeros(samples), np.zeros(samples))[:, 1]
    assert 3.0 * fast.std() == pytest.approx(away.usual_rate[1], rel=0.05)
    assert 3.0 * np.diff(fast).std() / budget.period == pytest.approx(away.usual_acceleration[1], rel=0.3)


@settings(max_examples=20)
@given(st.integers(0, 1000), st.floats(0.1, 1.0), st.floats(0.0, 1.0))
def test_derivatives_of_a_motion_are_bounded_in_starts_from_any_phase(seed, alpha, share):
    motion = replace(motion_of(seed), start_rate=alpha)
    moving, times, rows = moving_of(motion), np.linspace(0.0, 12.0, 6001), []
    for time in times:
        slow, out = np.tanh(alpha * time), np.zeros((3, 3))
        phase = share * motion.duration + time - slow / alpha
        motion_at(motion.points, motion.period, phase, slow**2, 2.0 * alpha * slow * (1.0 - slow**2), out)
        rows.append(out)
    rates, accelerations = np.array(rows)[:, 1], np.array(rows)[:, 2]
    jerks = np.diff(accelerations, axis=0) / np.diff(times)[:, None]
    for found, bound in zip((rates, accelerations, jerks), moving, strict=True):
        assert np.hypot(found[:, 0], found[:, 1]).max() <= bound[0, 0] + 1e-6
        assert np.abs(found[:, 2]).max() <= bound[0, 1] + 1e-6


def test_rates_of_axes_count_with_the_couplings():
    """By the model's share of c(w), and by c(w + w_1) - c(w)."""
    couplings, moving = uncoupled(axes=2), Moving(np.full((1, 3), 0.5), *np.zeros((2, 1, 3)))
    free = departures_of((GAINS, GAINS), BUDGET, moving, couplings)
    couplings.rates[0, 2, 1, 0] = 2.0
    bound = departures_of((GAINS, GAINS), BUDGET, moving, couplings)
    assert bound.position[1] == pytest.approx(free.position[1])
    assert bound.position[2] > free.position[2] + 0.15 * 2.0 * 0.25 / GAINS[0]


def test_joints_count_the_error_of_their_own_clocks():
    moving = Moving(np.full((1, 3), 0.5), np.full((1, 3), 2.0), np.zeros((1, 3)))
    found = noises(replace(BUDGET, clock_error=2e-3), moving)
    assert found[:, 1].tolist() == [1e-3, 0.02]
    assert found[:, 2] == pytest.approx([1e-3 + 2e-3 * 0.5, 0.02 + 2e-3 * 2.0])


def test_an_unstable_loop_has_no_departures():
    assert gain_sums(UNSTABLE, BUDGET) is None
    assert team_loop((UNSTABLE, GAINS), BUDGET, 1) is None
    assert departures_of((GAINS, UNSTABLE), BUDGET, STILL, uncoupled()) is None


def test_a_loop_in_fine_steps_has_the_sums_of_the_continuous_one():
    """Of x'' + 4 x' + 4 x: the integral of t exp(-2 t) is 1/4, that of its derivative's size 1 / e."""
    sums = loop_sums((4.0, 4.0), (1e-3, 0.0, 0.0), 1.0, 0, 20000)
    assert sums[0, :2] == pytest.approx([0.25, 0.25], rel=1e-2)
    assert sums[1, :2] == pytest.approx([1.0 / np.e] * 2, rel=1e-2)


def test_a_departure_is_known_after_the_age_of_measurements_and_a_period():
    assert unknown_time(replace(BUDGET, delay=0.012, clock_error=1e-3)) == pytest.approx(0.022)
