"""What robots measure, predict and observe: errors, draws, ages, the predictor and the observer."""

import numpy as np
import pytest

from coop_drake.answers.budget import Budget
from coop_drake.laws import measurements
from coop_drake.laws.robot_dynamics import (
    base_acceleration,
    end_effector_command,
    estimate_object,
    motion_room,
)
from coop_drake.plant import build_robot_plant, robot_chain
from coop_drake.robustness.tracking import gain_sums
from coop_drake.scenario import Deployment, Measurements, load_scenario


def wave(number, size, length, phase):
    """The wave alone, without noise."""
    error = np.empty(1)
    measurements.write_errors(9, np.zeros(1), np.array([[size, length, phase]]), number, error)
    return error[0]


def write_normals(seed, number, normals):
    """The noise alone, with a deviation of one."""
    n = len(normals)
    measurements.write_errors(seed, np.ones(n), np.tile([0.0, 2.0, 0.0], (n, 1)), number, normals)


@pytest.mark.parametrize(
    ("phase", "signs"), [(0.0, "++--++--"), (0.25, "+--++--+"), (0.5, "--++--++"), (1.0, "++--++--")]
)
def test_a_wave_is_positive_in_its_first_half(phase, signs):
    values = [wave(number, 0.2, 4.0, phase) for number in range(8)]
    assert values == [0.2 if sign == "+" else -0.2 for sign in signs]


def test_a_wave_that_is_no_whole_number_of_periods_has_the_right_mean_length():
    values = np.array([wave(number, 1.0, 7.3, 0.1) for number in range(7300)])
    assert np.count_nonzero(np.diff(values) > 0.0) == int(7299 / 7.3 + 0.1)
    assert abs(values.mean()) < 0.02


def test_noise_and_waves_add_up_and_neither_acts_where_it_is_not_asked_for():
    deviations, waves = (
        np.array([0.0, 0.5, 2.0]),
        np.array([[0.3, 2.0, 0.0], [0.0, 2.0, 0.0], [0.1, 2.0, 0.0]]),
    )
    errors, drawn = np.empty(3), np.empty(3)
    for number in range(4):
        measurements.write_errors(9, deviations, waves, number, errors)
        write_normals(9, number, drawn)
        sign = 1.0 if number % 2 == 0 else -1.0
        np.testing.assert_allclose(errors, deviations * drawn + sign * waves[:, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        (
            (0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF),
            (0xFFFFFFFF, 0xFFFFFFFF),
            (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD),
        ),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_words_are_those_that_were_published(counter, key, expected):
    assert measurements.random_words(counter, key) == expected


def test_pairs_are_uniform_and_independent():
    pairs = np.array([measurements.uniform_pair(7, k) for k in range(4000)])
    counts, _, _ = np.histogram2d(*pairs.T, bins=5, range=[[0.0, 1.0]] * 2)
    assert np.abs(counts - 160).max() < 5 * np.sqrt(160)


def test_normals_have_the_moments_of_a_normal_distribution():
    drawn = np.empty((4000, 7))
    for k in range(len(drawn)):
        write_normals(3, k, drawn[k])
    np.testing.assert_allclose(drawn.mean(axis=0), 0.0, atol=0.08)
    np.testing.assert_allclose(np.cov(drawn.T), np.eye(7), atol=0.1)
    np.testing.assert_allclose((drawn**4).mean(axis=0), 3.0, atol=0.6)


def test_seed_and_number_decide_and_nothing_else():
    first, again, shorter, other = np.empty(5), np.empty(5), np.empty(3), np.empty(5)
    write_normals(1, 2**40, first)
    write_normals(1, 5, other)
    write_normals(1, 2**40, again)
    write_normals(1, 2**40, shorter)
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first[:3], shorter)
    assert not np.any(first == other)
    write_normals(2, 2**40, other)
    assert not np.any(first == other)


@pytest.mark.parametrize(("time", "periods"), [(0.0, 0), (0.015, 3), (0.3, 60), (0.0151, 4), (0.001, 1)])
def test_a_time_is_rounded_up_to_whole_periods(time, periods):
    assert measurements.whole_periods(time, 0.005) == periods


def test_a_budget_and_the_gains_count_a_delay_as_the_simulation_does():
    barely_more = 0.01 * (1.0 + 1e-7)  # The simulation delays by a third period.
    assert measurements.whole_periods(barely_more, 0.005) == 3
    deployment = Deployment(control_rate=200.0, measurements=Measurements(delay=barely_more))
    assert deployment.whole_delay == pytest.approx(0.015)
    sums = [gain_sums((300.0, 30.0), Budget(delay=delay)) for delay in (barely_more, 0.015)]
    np.testing.assert_array_equal(*(rows[:, :3] for rows in sums))


GAIN, LEAK_RATE = 8.0, 1.6


def estimates(disturbance, wanted, gain=GAIN, leak=LEAK_RATE, step=1e-4, end=3.0):
    """The estimate at every step, the command being what is wanted less the estimate."""
    rate, state, found = np.array([0.3]), np.array([0.3]), []
    state_rate, estimate = np.empty(1), np.empty(1)
    for time in np.arange(0.0, end, step):
        u = np.array([wanted(time, rate[0])])
        measurements.observe(rate, u, state, gain, leak, state_rate, estimate)
        found.append(estimate[0])
        rate = rate + step * (u - estimate + disturbance(time))
        state = state + step * state_rate
    return np.array(found)


def test_the_estimate_is_a_low_pass_of_the_disturbance_whatever_the_law_does():
    times = np.arange(0.0, 3.0, 1e-4)
    expected = 2.0 * GAIN / (GAIN + LEAK_RATE) * (1.0 - np.exp(-(GAIN + LEAK_RATE) * times))
    for wanted in (
        lambda time, rate: 0.0,
        lambda time, rate: 5.0 * np.sin(7.0 * time),
        lambda time, rate: -30.0 * rate,
        lambda time, rate: 40.0 if 1.0 < time < 1.1 else 0.0,
    ):
        found = estimates(lambda time: 2.0, wanted)
        np.testing.assert_allclose(found, expected, atol=2e-3)


def test_without_a_leak_a_constant_disturbance_is_found_whole():
    assert estimates(lambda time: -3.0, lambda time, rate: -rate, leak=0.0)[-1] == pytest.approx(-3.0)


@pytest.mark.parametrize(("frequency", "lowest", "highest"), [(1.0, 1.6, 1.7), (100.0, 0.0, 0.2)])
def test_it_follows_slow_disturbances_and_not_quick_ones(frequency, lowest, highest):
    found = estimates(lambda time: np.sin(frequency * time), lambda time, rate: -rate, step=1e-3, end=8.0)
    assert lowest < np.ptp(found[1000:]) < highest


def test_two_robots_that_want_different_things_do_not_drift_apart_for_ever():
    """Each gives half of the acceleration, and takes what the other one does for a disturbance."""
    rate, states, estimate = 0.0, np.zeros(2), np.zeros(2)
    state_rate, wanted, step = np.zeros(2), np.array([0.1, -0.1]), 1e-3
    for _ in range(20000):
        measurements.observe(np.full(2, rate), wanted, states, GAIN, LEAK_RATE, state_rate, estimate)
        rate += step * float((wanted - estimate).mean())
        states += step * state_rate
    assert rate == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(estimate, -wanted * GAIN / LEAK_RATE, rtol=1e-6)


@pytest.mark.parametrize(
    ("age", "gain"),
    [(0.0, measurements.FASTEST), (0.001, measurements.FASTEST), (0.05, measurements.PHASE / 0.05)],
)
def test_gains_follow_the_age_of_commands(age, gain):
    assert measurements.observer_gains(age) == (gain, pytest.approx(measurements.LEAK * gain))


@pytest.mark.parametrize("age", [0.0125, 0.05, 0.2])
def test_the_observer_s_loop_is_well_damped_with_the_age_as_a_delay(age):
    """d^'(t) = l (d - d^(t - age)) - g d^(t) does not overshoot by more than a hundredth."""
    gain, leak = measurements.observer_gains(age)
    step = age / 100.0
    found = np.zeros(100)
    for _ in range(int(20.0 / gain / step)):
        found = np.append(found, found[-1] + step * (gain * (1.0 - found[-100]) - leak * found[-1]))
    final = gain / (gain + leak)
    assert found[-1] == pytest.approx(final, rel=1e-3)
    assert found.max() <= 1.01 * final


@pytest.fixture(scope="module")
def chain():
    """The chain of a robot with two joints."""
    return robot_chain(build_robot_plant(load_scenario("elbow"), 0))


def test_constant_accelerations_are_predicted_exactly(chain):
    rng, n = np.random.default_rng(22), 5
    (z, v), pose, grasp = rng.uniform(-1.8, 1.8, (2, n)), rng.normal(size=3), rng.normal(size=2)
    robot, rows = np.concatenate([z, v]), np.tile(rng.normal(size=3 + n), (5, 1))
    predicted, predicted_pose, state, period = np.empty(robot.size), np.empty(3), np.empty(6), 0.02
    measurements.predict(chain, grasp, robot, pose, rows, period, predicted, predicted_pose)
    estimate_object(chain, grasp, motion_room(chain), robot, pose, state)
    time = 5 * period
    for found, x, rate, a in (
        (predicted[:n], z, v, rows[0, 3:]),
        (predicted_pose, pose, state[3:], rows[0, :3]),
    ):
        np.testing.assert_allclose(found, x + time * rate + 0.5 * time**2 * a, atol=1e-12)
    np.testing.assert_allclose(predicted[n:], v + time * rows[0, 3:], atol=1e-12)


def test_what_is_kept_is_what_was_commanded(chain):
    rng = np.random.default_rng(5)
    robot, pose, load = rng.uniform(-1.8, 1.8, 10), rng.normal(size=3), rng.uniform(0.1, 1.0, size=7)
    linear, axes, kept = rng.normal(size=2), rng.normal(size=3), np.empty(8)
    measurements.wanted_accelerations(chain, load, robot, pose, linear, axes, kept)
    state, command = np.empty(6), np.empty(6)
    estimate_object(chain, load[:2], motion_room(chain), robot, pose, state)
    end_effector_command(load, state, linear, axes, command)
    np.testing.assert_array_equal(kept[:3], [*linear, axes[0]])
    np.testing.assert_array_equal(
        kept[3:6], base_acceleration(chain, motion_room(chain), robot, command, axes)
    )
    np.testing.assert_array_equal(kept[6:], axes[1:])
