"""A robot says that it has arrived where what it measures lies at the goal, and rests, and nowhere else."""

import numpy as np
import pytest

from coop_drake.laws.readiness import FAR, ArrivalGoal, arrival_margin, mean_samples

PERIOD = 0.005
ROWS = 2 * mean_samples(PERIOD)
TIMES = PERIOD * np.arange(ROWS)
PLACE = np.array([1.0, 2.0, 0.5, 0.0])
EXACT = ArrivalGoal(PLACE, np.array([0.01, 0.02, np.inf]), np.zeros(3))
CERTIFIED = EXACT._replace(errors=np.array([0.003, 0.002, 0.002]))
NOISE = np.array([1e-3, 1e-3, 5e-4, 5e-4])


def margin(samples, goal=EXACT, turned=0):
    """Of samples from the oldest to the newest, kept in a ring that begins anywhere."""
    return arrival_margin(*goal, np.roll(samples, turned, axis=0), (ROWS - 1 + turned) % ROWS)


def at(*away):
    return np.tile(PLACE + np.array(away), (ROWS, 1))


@pytest.mark.parametrize("turned", [0, 7, ROWS - 1])
def test_at_rest_at_the_goal_it_has_arrived_wherever_the_ring_begins(turned):
    assert margin(at(0.0, 0.0, 0.0, 3.0), turned=turned) > 1.0 - 1e-9
    samples = at(0.0, 0.0, 0.0, 0.0)
    samples[: ROWS // 2, 0] += 0.05  # the older half elsewhere
    assert margin(samples, turned=turned) < 0.0


def test_it_measures_for_long_enough_first():
    samples = at(0.0, 0.0, 0.0, 0.0)
    samples[0] = np.inf
    assert margin(samples) == FAR


@pytest.mark.parametrize(
    ("goal", "allowed"), [(EXACT, (0.009, 0.018)), (CERTIFIED, (0.007, 0.018))], ids=["exact", "certified"]
)
def test_the_mean_lies_within_the_tolerance_less_its_certified_error(goal, allowed):
    place, angle = allowed
    for share, arrived in ((0.999, True), (1.001, False)):
        assert (margin(at(0.6 * share * place, 0.8 * share * place, 0.0, 0.0), goal) >= 0.0) == arrived
        assert (margin(at(0.0, 0.0, -share * angle, 0.0), goal) >= 0.0) == arrived
    assert margin(at(0.0, 0.0, 0.0, 5.0), goal) > 1.0 - 1e-9  # the joint is free


@pytest.mark.parametrize(("column", "speed"), [(0, 0.01), (2, 0.02), (3, 0.02)])
def test_what_moves_has_not_arrived(column, speed):
    for share, arrived in ((0.9, True), (3.0, False)):
        samples = at(0.0, 0.0, 0.0, 0.0)
        samples[:, column] += share * speed * (TIMES - TIMES[ROWS // 2])
        assert (margin(samples) >= 0.0) == arrived


@pytest.mark.parametrize("size", [0.015, 0.03])
def test_what_moves_to_and_fro_through_the_goal_has_not_arrived_at_any_moment(size):
    for frequency in np.arange(0.5, 25.0, 0.25):
        for phase in np.linspace(0.0, 2.0 * np.pi, 24):
            samples = at(0.0, 0.0, 0.0, 0.0)
            samples[:, 0] += size * np.sin(2.0 * np.pi * frequency * TIMES + phase)
            # Slower than this, the turning point is rest for as long as a robot looks.
            away = abs(samples[ROWS // 2 :, 0].mean() - PLACE[0])
            assert margin(samples) < 0.0, (frequency, phase, away)


def test_noise_does_not_keep_it_from_arriving_and_does_not_let_it_arrive_elsewhere():
    generator = np.random.default_rng(0)
    said = {}
    for away, scale in ((0.0, 1.0), (0.012, 1.0), (0.012, 5.0), (0.03, 10.0)):
        samples = at(away, 0.0, 0.0, 0.0) + scale * NOISE * generator.normal(size=(2000, ROWS, 4))
        said[away, scale] = np.mean([margin(one) >= 0.0 for one in samples])
    assert said[0.0, 1.0] > 0.99
    assert said[0.012, 1.0] == 0.0
    assert said[0.012, 5.0] < 1e-3
    assert said[0.03, 10.0] == 0.0


def test_a_certified_error_that_jumps_does_not_keep_it_from_arriving_for_ever():
    goal = CERTIFIED._replace(errors=np.array([0.0024, 0.0015, 0.0015]))
    arrived = 0
    for phase in np.linspace(0.0, 1.0, 60):
        samples = at(0.0, 0.0, 0.0, 0.0)
        samples += np.outer(np.where((TIMES / 0.3 + phase) % 1.0 < 0.5, 1.0, -1.0), goal.errors[[0, 0, 1, 2]])
        arrived += margin(samples, goal) >= 0.0
    assert arrived > 20
