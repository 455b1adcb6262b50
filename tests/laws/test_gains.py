"""Funnels, and the rules that give every cell its gains."""

import numpy as np
import pytest

from coop_drake import laws
from coop_drake.laws.gains import IDEAL_AGE, PEAK, schedule_of, scheduled_governor


def make_funnel(shape):
    return laws.Funnel(
        slice_lower=np.array([0.0, -2.0]),
        slice_upper=np.array([1.0, 0.5]),
        goal_lower=np.array([0.7, -2.0]),
        goal_upper=np.array([0.9, 0.5]),
        decay_rate=np.array([2.0, 3.0]),
        shape=shape,
    )


def test_values_at_one_instant():
    lower = laws.funnel_bounds(make_funnel("exponential"), 0.5).lower[0]
    assert lower == pytest.approx(0.7 * (1.0 - np.exp(-1.0)))
    u = 0.5 * 2.0 / 5.0
    quintic = laws.funnel_bounds(make_funnel("quintic"), 0.5).upper[0]
    assert quintic == pytest.approx(0.9 + 0.1 * (1.0 - 10.0 * u**3 + 15.0 * u**4 - 6.0 * u**5))


def test_no_quintic_wall_accelerates_more_than_the_schedule_counts_on():
    """PEAK lambda^2 shrink, found again by sampling."""
    funnel = make_funnel("quintic")
    seen = max(abs(laws.funnel_bounds(funnel, t).lower_acceleration[0]) for t in np.linspace(0.0, 2.5, 2001))
    assert seen == pytest.approx(PEAK * 2.0**2 * 0.7, rel=1e-5)


def test_only_quintic_walls_begin_at_rest_and_stand_at_the_goal_once_closed():
    """The first axis' walls close for 5 / lambda = 2.5 s; the second one's do not shrink."""
    quintic, exponential = make_funnel("quintic"), make_funnel("exponential")
    first, closed, early = (laws.funnel_bounds(quintic, time) for time in (0.0, 2.5, 0.3))
    assert first.lower == pytest.approx(quintic.slice_lower, abs=1e-15)
    assert first.upper == pytest.approx(quintic.slice_upper, abs=1e-15)
    assert np.all(np.array(first[2:]) == 0.0)
    assert laws.funnel_bounds(exponential, 0.0).lower_rate == pytest.approx([1.4, 0.0])
    assert [wall[0] for wall in closed] == [0.7, 0.9, 0.0, 0.0, 0.0, 0.0]
    assert (early.lower[1], early.lower_rate[1], early.lower_acceleration[1]) == (-2.0, 0.0, 0.0)


def test_select_keeps_the_axes_asked_for():
    funnel, gains = make_funnel("quintic"), schedule(laws.ScheduledGains())
    own, own_gains = funnel.select(np.array([1])), gains.select(np.array([1]))
    assert laws.funnel_bounds(own, 0.3).lower.tolist() == [laws.funnel_bounds(funnel, 0.3).lower[1]]
    for name in ("decay_rate", "log_gain", "energy_bound"):
        assert getattr(own_gains, name).tolist() == [getattr(gains, name)[1]]
    assert own_gains.rate_gain == gains.rate_gain


SLICE = {"slice_lower": np.array([0.0, -1.0]), "slice_upper": np.array([1.0, 1.0])}

GOAL = {"goal_lower": np.array([0.8, -1.0]), "goal_upper": np.array([1.0, 1.0])}

RESTING = np.array([0.4, 0.5])


def schedule(gain_set, *, clearance=0.2, **changes):
    return laws.transition_gains(
        gain_set, clearance=clearance, **({**SLICE, **GOAL, "resting": RESTING} | changes)
    )


@pytest.mark.parametrize(
    ("clearance", "stiffness"),
    [(1.0, 50.0), (0.4, 50.0), (0.2, 100.0), (0.05, 150.0), (0.01, 150.0), (0.0, 150.0)],
)
def test_stiffness_follows_the_clearance_between_its_bounds(clearance, stiffness):
    gains = schedule(laws.ScheduledGains(), clearance=clearance)
    assert scheduled_governor(schedule_of(laws.ScheduledGains()), clearance)[0] == pytest.approx(
        stiffness, rel=1e-14
    )
    assert gains.stiffness == pytest.approx(stiffness, rel=1e-14)
    assert gains.damping == pytest.approx(1.4 * np.sqrt(stiffness))
    assert gains.governor_gain == pytest.approx(1.2 * np.sqrt(stiffness))


@pytest.mark.parametrize("age", [0.005, 0.0125, 0.03, 0.2])
def test_gains_follow_the_age_of_what_a_command_rests_on(age):
    """k2 is 0.4 over the age, all others are fractions of it, and K is at most the square of 0.4 / age."""
    gains = schedule(laws.ScheduledGains(command_age=age), clearance=0.01, resting=np.array([0.5, 0.0]))
    k2 = min(60.0, 0.4 / age)
    assert gains.rate_gain == pytest.approx(k2)
    assert (gains.position_gain, gains.ramp_rate) == pytest.approx((0.4 * k2, 0.3 * k2))
    assert gains.stiffness == pytest.approx(min(150.0, (0.4 / age) ** 2))
    assert gains.log_gain[0] == pytest.approx(min(0.1, 0.3 * (0.2 * k2) ** 2 / 16.0))
    assert np.all(gains.decay_rate <= 0.5 * k2 * (1.0 + 1e-12))


def test_bounds_log_term_and_entry_take_a_share_of_a_limit_of_acceleration():
    most = np.array([np.inf, 2.0])
    narrow = {"goal_lower": np.array([0.8, 0.6]), "resting": np.array([0.4, -0.8])}
    free, limited = (schedule(laws.ScheduledGains(), acceleration_limit=a, **narrow) for a in (None, most))
    assert (limited.decay_rate[0], limited.log_gain[0]) == (free.decay_rate[0], free.log_gain[0])
    assert limited.decay_rate[1] == pytest.approx(np.sqrt(0.8 * 2.5 * np.sqrt(3.0) / 1.6))
    assert limited.log_gain[1] == pytest.approx((0.8 / limited.rate_gain) ** 2)
    assert limited.energy_bound[1] < free.energy_bound[1]
    funnel = laws.Funnel(SLICE["slice_lower"], SLICE["slice_upper"], narrow["goal_lower"], GOAL["goal_upper"],
                    limited.decay_rate)  # fmt: skip
    at_rest = laws.funnel_acceleration(narrow["resting"], np.zeros(2), funnel, 0.0, limited)
    assert abs(at_rest[1]) <= 0.8


def test_walls_that_close_far_close_slowly():
    gains = schedule(
        laws.ScheduledGains(turning_acceleration=1e3),  # joints bear any turn
        slice_lower=np.array([0.0, 0.0, 0.0, 0.0]),
        slice_upper=np.array([10.0, 2.0, 2.0, 2.0]),
        goal_lower=np.array([9.0, 0.8, 1.9, 0.0]),
        goal_upper=np.array([10.0, 2.0, 2.0, 2.0]),
        resting=np.array([5.0, 1.0, 1.0, 1.0]),
    )
    # The largest acceleration of a bound is 10 / (25 sqrt(3)) lambda^2 shrink; without shrink it is k2 / 2.
    aimed = np.sqrt(12.0 * 2.5 * np.sqrt(3.0) / np.array([9.0, 0.8, 1.9]))
    assert gains.decay_rate == pytest.approx([*aimed, 0.2 / 0.015])
    narrow = {"goal_lower": np.array([0.98, -1.0])}
    least = schedule(laws.ScheduledGains(goal_acceleration=0.1), **narrow).decay_rate[0]
    assert least == pytest.approx(np.sqrt(0.1 * (0.4 / 0.015) ** 2 * 0.02 * 2.5 * np.sqrt(3.0) / 0.98))
    slow = schedule(laws.ScheduledGains(funnel_acceleration=0.1))
    assert slow.decay_rate[0] == 1.5


def test_the_log_term_at_rest_stays_below_its_acceleration():
    lower, upper, rest = np.zeros(3), np.ones(3), np.array([0.5, 0.03, 1.0 - 0.02])
    goal_upper = np.array([1.0, 1.0, 1.0])
    gains = schedule(
        laws.ScheduledGains(),
        slice_lower=lower,
        slice_upper=upper,
        goal_lower=lower,
        goal_upper=goal_upper,
        resting=rest,
    )
    pull = np.abs(np.log(rest / (1.0 - rest))) / (rest * (1.0 - rest))
    assert gains.log_gain[0] == 0.1
    assert gains.log_gain[1:] * pull[1:] == pytest.approx(5.0)


def test_the_energy_bound_lies_above_the_energy_at_rest():
    s = np.log(0.4 / 0.6)
    gains = schedule(laws.ScheduledGains())
    # Quintic walls stand still at first, and k1 begins at zero: the wanted rate is zero.
    kappa = gains.log_gain[0]
    assert gains.energy_bound[0] == pytest.approx(0.6 * kappa * s**2 + 0.5 * kappa + 0.5 * 0.02**2)


def test_energies_of_a_rule_without_a_ramp_hold_the_rate_wanted_at_rest():
    s = np.log(0.4 / 0.6)
    gains = schedule(laws.FixedGains(funnel="quintic", log_gain=0.1))
    at_rest = 0.5 * 0.1 * s**2 + 0.5 * (s * 0.4 * 0.6) ** 2
    assert gains.energy_bound[0] == pytest.approx(1.2 * at_rest + 0.05)


def test_fixed_gains_do_not_look_at_the_cell():
    wide, narrow = (
        schedule(laws.FixedGains(joint_decay_rate=3.0)),
        schedule(laws.FixedGains(joint_decay_rate=3.0), clearance=1e-6),
    )
    for gains in (wide, narrow):
        assert (gains.stiffness, gains.damping, gains.governor_gain) == (50.0, 5.0, 5.0)
        assert gains.decay_rate.tolist() == [2.0, 3.0]
        assert gains.log_gain.tolist() == [1.0, 1.0]
        assert gains.funnel == "exponential"


@pytest.mark.parametrize("gain_set", [laws.FixedGains(), laws.ScheduledGains()])
@pytest.mark.parametrize("resting", [[0.0, -1.0], [1.0, 1.0], [-0.3, 2.0], [5.0, -5.0]])
def test_rest_on_or_outside_the_border_gives_finite_gains_that_lead_back(gain_set, resting):
    resting = np.array(resting)
    gains = schedule(gain_set, resting=resting)
    for values in (gains.decay_rate, gains.log_gain, gains.energy_bound):
        assert np.all(np.isfinite(values))
        assert np.all(values > 0.0)
    funnel = laws.Funnel(**SLICE, **GOAL, decay_rate=gains.decay_rate, shape=gains.funnel)
    acceleration = laws.funnel_acceleration(resting, np.zeros(2), funnel, 0.0, gains)
    assert np.all(np.isfinite(acceleration))
    assert np.all(np.sign(acceleration) == np.where(resting <= SLICE["slice_lower"], 1.0, -1.0))


def test_a_goal_as_wide_as_the_slice_is_allowed():
    gains = schedule(laws.ScheduledGains(), goal_lower=SLICE["slice_lower"], goal_upper=SLICE["slice_upper"])
    assert gains.decay_rate == pytest.approx([0.2 / 0.015] * 2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"goal_lower": np.array([0.8, 1.0])}, r"axis 1: goal interval \[1.0, 1.0\] must be inside slice"),
        (
            {"goal_upper": np.array([1.1, 1.0])},
            r"axis 0: goal interval \[0.8, 1.1\] must be inside slice \[0.0, 1.0\]",
        ),
        (
            {"slice_upper": np.array([0.0, 1.0])},
            r"axis 0: .* must be inside slice \[0.0, 0.0\], and both longer",
        ),
        ({"goal_lower": np.array([np.nan, -1.0])}, "axis 0: goal interval"),
    ],
)
def test_funnels_without_inside_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        schedule(laws.ScheduledGains(), **changes)


def test_defaults_of_the_fixed_set_are_table_2():
    gains = laws.FixedGains()
    table_2 = {
        "stiffness": 50.0,
        "damping": 5.0,
        "governor_gain": 5.0,
        "angle_decay_rate": 2.0,
        "joint_decay_rate": 2.0,
        "position_gain": 1.0,
        "rate_gain": 1.0,
    }
    assert {name: getattr(gains, name) for name in table_2} == table_2
    assert gains.funnel == "exponential"
    assert gains.smoothing == 0.0


def test_bad_gains_are_refused_by_name():
    with pytest.raises(ValueError, match=r"^energy_factor: 0\.9 .* a number of at least 1$"):
        laws.ScheduledGains(energy_factor=0.9)
    with pytest.raises(ValueError, match=r"^smoothing: -0\.001 .* expected zero or a positive number$"):
        laws.ScheduledGains(smoothing=-0.001)
    with pytest.raises(ValueError, match=r"^funnel: 'cubic' .* one of exponential, quintic$"):
        laws.FixedGains(funnel="cubic")


def test_bounds_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match=r"^min_stiffness: 9.0 .* expected at most max_stiffness, 3$"):
        laws.ScheduledGains(min_stiffness=9.0, max_stiffness=3.0)


def test_an_age_that_is_given_stays_and_an_ideal_team_gets_the_smallest():
    gains = laws.ScheduledGains()
    assert gains.age == gains.for_age(0.0).age == IDEAL_AGE
    assert gains.for_age(0.03).age == 0.03
    assert laws.ScheduledGains(command_age=0.002).for_age(0.03).age == 0.002


def test_gains_may_be_computed_with_numpy():
    gains = laws.ScheduledGains(wall_stiffness=np.float64(20.5), min_stiffness=np.int64(50))
    assert (gains.wall_stiffness, gains.min_stiffness) == (20.5, 50.0)
