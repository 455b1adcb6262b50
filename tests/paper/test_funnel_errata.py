"""E17a, E17b, E18, E20, E35, E39 and E43: bounds and the back-stepping law between them."""

import numpy as np
import pytest

from coop_drake.laws import Funnel, ScheduledGains, funnel_bounds, transition_gains
from coop_drake.laws.readiness import interval_margin
from paper import printed
from paper.table_1 import CORRECTED
from tests.support.prescribed import prescribed_acceleration
from tests.support.table_1 import table_transitions

ONE_AXIS = {
    "slice_lower": np.array([1.47]),
    "slice_upper": np.array([1.867]),
    "goal_lower": np.array([1.667]),
    "goal_upper": np.array([1.867]),
}


def bounds_at(time, *, decay_rate=2.0, shape="exponential", **intervals):
    chosen = {**ONE_AXIS, **intervals}
    rates = np.full(len(chosen["slice_lower"]), decay_rate)
    funnel = Funnel(**chosen, decay_rate=rates, shape=shape)
    return funnel_bounds(funnel, time)


def scalars(bounds):
    return [float(bound[0]) for bound in bounds]


def test_e17a_walls_that_start_together_leave_no_room():
    """(17) starts the upper bound at theta_l; Table 1's first cell, with theta = 1.57."""
    lower, upper = printed.angle_bounds(
        0.0, theta_l=1.47, theta_u=1.867, goal_l=1.667, goal_u=1.867, decay_rate=2.0
    )
    assert upper - lower == pytest.approx(0.0, abs=1e-15)
    corrected = bounds_at(0.0)
    assert corrected.lower[0] < 1.57 < corrected.upper[0]


def test_e17b_an_axis_handed_over_on_the_border_of_its_new_slice_is_thrown_off():
    """The goal's end is the next slice's end: there s = ln 0, and near it the log term has no bound."""
    begin = scalars(bounds_at(0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        _, _, on_the_border = printed.axis_law(np.float64(1.47), 0.0, begin)
    assert on_the_border == -np.inf
    just_inside, _, _ = printed.axis_law(1.47 + 1e-6, 0.0, begin)
    assert just_inside > 1e7
    # The next slice begins where the goal interval of the last cell, as wide as their overlap, ends.
    goal = 1.47, 1.67
    assert interval_margin(1.47 + 1e-6, *goal) < 0.0
    place = next(x for x in np.linspace(1.47, 1.57, 1001) if interval_margin(x, *goal) >= 0.0)
    ready, _, _ = printed.axis_law(place, 0.0, begin)
    assert ready < 200.0


def test_e18_towards_a_point_the_printed_log_term_has_no_bound():
    """Between bounds that close completely, an axis at a quarter of the width is pulled ever harder."""

    def pull(goal_half_width, log_gain, time):
        goal = {
            "goal_lower": np.array([1.7 - goal_half_width]),
            "goal_upper": np.array([1.7 + goal_half_width]),
        }
        bounds = scalars(bounds_at(time, **goal))
        x = 0.75 * bounds[0] + 0.25 * bounds[1]
        with_log, _, _ = printed.axis_law(x, 0.0, bounds, log_gain=log_gain)
        without, _, _ = printed.axis_law(x, 0.0, bounds, log_gain=0.0)
        return abs(with_log - without)

    assert [pull(0.0, 1.0, t + 1.0) / pull(0.0, 1.0, t) for t in (1.0, 2.0, 4.0)] == pytest.approx(
        [np.e**2] * 3
    )
    assert pull(0.0, 1.0, 10.0) > 1e9
    assert pull(0.02, 0.1, 1e3) < 20.0


@pytest.mark.parametrize("time", [0.0, 0.2, 1.0])
def test_e20_without_its_dot_the_wanted_rate_does_not_follow_the_walls(time):
    """At x' = v the log s shall decay as s' = -k1 s; b with rho instead of rho' gives another s'."""
    bounds = scalars(bounds_at(time))
    x = 0.3 * bounds[0] + 0.7 * bounds[1]

    def decay_of_s(first_rate):
        _, v, s = printed.axis_law(x, 0.0, bounds, first_rate=first_rate)
        return (v - bounds[2]) / (x - bounds[0]) - (bounds[3] - v) / (bounds[1] - x), -s

    got, wanted = decay_of_s(bounds[0])
    assert abs(got - wanted) > 1.0
    got, wanted = decay_of_s(None)
    assert got == pytest.approx(wanted, abs=1e-12)


class TestE35:
    """(38) damps the second joint by the rate of the first: two joints on their way, gains 1 as in (48)."""

    kappa, k1, k2 = 1.0, 1.0, 1.0

    def setup_method(self):
        self.bounds = bounds_at(
            0.3,
            shape="quintic",
            **{name: np.repeat(value, 2) for name, value in ONE_AXIS.items()},
        )
        self.x = 0.4 * self.bounds.lower + 0.6 * self.bounds.upper
        self.rate = np.array([-2.0, 0.8])

    def energy_rate(self, acceleration):
        """Return V' of the second joint, and what the gains promise."""
        axis = [bound[1] for bound in self.bounds]
        forced, v, s = printed.axis_law(
            self.x[1], self.rate[1], axis, log_gain=self.kappa, position_gain=self.k1, rate_gain=self.k2
        )
        error = self.rate[1] - v
        promised = -self.kappa * self.k1 * s**2 - self.k2 * error**2
        # V' = promised + (x' - v) times the acceleration that is not that of the law.
        return promised + error * (acceleration - forced), promised

    def test_as_printed_the_second_joint_gains_energy(self):
        axis = [bound[1] for bound in self.bounds]
        undamped, v, _ = printed.axis_law(self.x[1], self.rate[1], axis, rate_gain=0.0)
        got, promised = self.energy_rate(undamped - self.k2 * (self.rate[0] - v))
        assert got > 0.0 > promised

    def test_as_corrected_it_loses_what_the_gains_promise(self):
        acceleration = prescribed_acceleration(
            self.x,
            self.rate,
            self.bounds,
            log_gain=np.full(2, self.kappa),
            position_gain=self.k1,
            rate_gain=self.k2,
        )
        got, promised = self.energy_rate(acceleration[1])
        assert got == pytest.approx(promised, rel=1e-9)
        assert promised < 0.0


def test_e39_an_overbar_means_the_lower_end_in_the_joints_walls():
    """Read as elsewhere in the paper, overbar for upper, the lower bound of (39) is above the upper."""
    for transition in table_transitions(CORRECTED):
        read_literally = {
            "slice_lower": transition["slice_upper"][1:],
            "slice_upper": transition["slice_lower"][1:],
            "goal_lower": transition["goal_upper"][1:],
            "goal_upper": transition["goal_lower"][1:],
        }
        corrected = {name: transition[name][1:] for name in read_literally}
        for time in (0.0, 0.5, 5.0):
            crossed = funnel_bounds(Funnel(**read_literally, decay_rate=np.full(2, 2.0)), time)
            assert np.all(crossed.lower > crossed.upper)
            bounds = funnel_bounds(Funnel(**corrected, decay_rate=np.full(2, 2.0)), time)
            assert np.all(bounds.lower < bounds.upper)


def test_e43_the_wanted_rate_leaves_minus_k1_z1_and_not_its_square():
    """a v - b is odd in z1; the square would push away from one of the two bounds."""
    bounds = scalars(bounds_at(0.4))
    k1 = 1.5
    for fraction in (0.2, 0.8):
        x = (1.0 - fraction) * bounds[0] + fraction * bounds[1]
        _, v, z1 = printed.axis_law(x, 0.0, bounds, position_gain=k1)
        a = 1.0 / (x - bounds[0]) + 1.0 / (bounds[1] - x)
        b = bounds[2] / (x - bounds[0]) + bounds[3] / (bounds[1] - x)
        assert a * v - b == pytest.approx(-k1 * z1)
        assert abs(a * v - b - -k1 * z1**2) > 0.5


def test_gains_of_the_schedule_bound_the_log_term_for_every_row_of_table_1():
    for transition in table_transitions(CORRECTED):
        gains = transition_gains(ScheduledGains(), clearance=0.1, **transition)
        x, lower, upper = transition["resting"], transition["slice_lower"], transition["slice_upper"]
        pull = (upper - lower) / ((x - lower) * (upper - x)) * np.abs(np.log((x - lower) / (upper - x)))
        assert np.all(gains.log_gain * pull <= ScheduledGains().log_acceleration * (1.0 + 1e-12))
