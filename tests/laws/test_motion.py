"""The law of a team that passes from cell to cell, against scipy's splines and a linear system."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from coop_drake.laws.motion import motion_at, pull

PERIOD = 0.3


@pytest.fixture
def points() -> np.ndarray:
    inner = np.random.default_rng(3).normal(size=(6, 4))
    return np.concatenate([[inner[0]] * 3, inner[1:-1], [inner[-1]] * 3])


def test_rates_and_accelerations_are_those_of_the_path_at_the_pace(points) -> None:
    """By the chain rule: x' = rho z', x'' = rho^2 z'' + rho' z'."""
    spline = BSpline(PERIOD * (np.arange(len(points) + 4) - 3.0), points, 3)
    duration, nominal = (len(points) - 3) * PERIOD, np.empty((3, 4))
    for phase, pace, pace_rate in np.random.default_rng(4).uniform([0, 0, -3], [duration, 1, 3], (50, 3)):
        motion_at(points, PERIOD, phase, pace, pace_rate, nominal)
        z, rate, bend = spline(phase), spline(phase, 1), spline(phase, 2)
        expected = np.stack([z, pace * rate, pace**2 * bend + pace_rate * rate])
        np.testing.assert_allclose(nominal, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("phase", [-1.0, 0.0, 2.1, 9.0])
def test_it_rests_before_its_beginning_and_after_its_end(points, phase) -> None:
    nominal = np.empty((3, 4))
    motion_at(points, PERIOD, phase, 1.0, 0.5, nominal)
    np.testing.assert_allclose(nominal[0], points[0] if phase <= 0.0 else points[-1], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(nominal[1:], 0.0)


def test_a_departure_is_pulled_to_zero() -> None:
    """A team whose robot has one joint, the second of the tree."""
    expected = np.array([[1.0, 2.0, 0.3, 9.0, 0.4], [0.1, 0.2, 0.3, 9.0, 0.5], [9.0] * 5])
    ahead = np.vstack([[9.0] * 5, [9.0] * 5, [0.5, 0.6, 0.7, 9.0, 0.8]])
    at, found = (expected[0, :3], expected[1, :3], expected[:2, 4]), np.empty(4)
    for off in (0.0, 0.1):
        places, rates = at[0] + off * np.array([1, 2, 3]), at[1] - off * np.array([1, 2, 3])
        robot = np.zeros(8)
        robot[[3, 7]] = at[2] + off * np.array([4, -4])
        gains = np.array([9.0, 6.0, 16.0, 8.0])
        pull(ahead, expected, np.array([4]), gains, np.concatenate([places, rates]), robot, found)
        pulled = off * np.array([3.0, 6.0, 8.0 * 3.0, 8.0 * 4.0])
        np.testing.assert_allclose(found, [0.5, 0.6, 0.7, 0.8] - pulled, atol=1e-12)
