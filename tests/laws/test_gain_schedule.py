import numpy as np
import pytest

from coop_drake.laws import FixedGains, Funnel, ScheduledGains, funnel_acceleration, transition_gains
from coop_drake.laws.gains import schedule_of, scheduled_governor

SLICE = {"slice_lower": np.array([0.0, -1.0]), "slice_upper": np.array([1.0, 1.0])}
GOAL = {"goal_lower": np.array([0.8, -1.0]), "goal_upper": np.array([1.0, 1.0])}
RESTING = np.array([0.4, 0.5])


def schedule(gain_set, *, clearance=0.2, **changes):
    return transition_gains(
        gain_set, clearance=clearance, **({**SLICE, **GOAL, "resting": RESTING} | changes)
    )


@pytest.mark.parametrize(
    ("clearance", "stiffness"),
    [(1.0, 50.0), (0.4, 50.0), (0.2, 100.0), (0.05, 150.0), (0.01, 150.0), (0.0, 150.0)],
)
def test_stiffness_follows_the_clearance_between_its_bounds(clearance, stiffness):
    gains = schedule(ScheduledGains(), clearance=clearance)
    assert scheduled_governor(schedule_of(ScheduledGains()), clearance)[0] == pytest.approx(
        stiffness, rel=1e-14
    )
    assert gains.stiffness == pytest.approx(stiffness, rel=1e-14)
    assert gains.damping == pytest.approx(1.4 * np.sqrt(stiffness))
    assert gains.governor_gain == pytest.approx(1.2 * np.sqrt(stiffness))


@pytest.mark.parametrize("age", [0.005, 0.0125, 0.03, 0.2])
def test_gains_follow_the_age_of_what_a_command_rests_on(age):
    """k2 is 0.4 over the age, all others are fractions of it, and K is at most the square of 0.4 / age."""
    gains = schedule(ScheduledGains(command_age=age), clearance=0.01, resting=np.array([0.5, 0.0]))
    k2 = min(60.0, 0.4 / age)
    assert gains.rate_gain == pytest.approx(k2)
    assert (gains.position_gain, gains.ramp_rate) == pytest.approx((0.4 * k2, 0.3 * k2))
    assert gains.stiffness == pytest.approx(min(150.0, (0.4 / age) ** 2))
    assert gains.log_gain[0] == pytest.approx(min(0.1, 0.3 * (0.2 * k2) ** 2 / 16.0))
    assert np.all(gains.decay_rate <= 0.5 * k2 * (1.0 + 1e-12))


def test_bounds_log_term_and_entry_take_a_share_of_a_limit_of_acceleration():
    most = np.array([np.inf, 2.0])
    narrow = {"goal_lower": np.array([0.8, 0.6]), "resting": np.array([0.4, -0.8])}
    free, limited = (schedule(ScheduledGains(), acceleration_limit=a, **narrow) for a in (None, most))
    assert (limited.decay_rate[0], limited.log_gain[0]) == (free.decay_rate[0], free.log_gain[0])
    assert limited.decay_rate[1] == pytest.approx(np.sqrt(0.8 * 2.5 * np.sqrt(3.0) / 1.6))
    assert limited.log_gain[1] == pytest.approx((0.8 / limited.rate_gain) ** 2)
    assert limited.energy_bound[1] < free.energy_bound[1]
    funnel = Funnel(SLICE["slice_lower"], SLICE["slice_upper"], narrow["goal_lower"], GOAL["goal_upper"],
                    limited.decay_rate)  # fmt: skip
    at_rest = funnel_acceleration(narrow["resting"], np.zeros(2), funnel, 0.0, limited)
    assert abs(at_rest[1]) <= 0.8


def test_walls_that_close_far_close_slowly():
    gains = schedule(
        ScheduledGains(turning_acceleration=1e3),  # joints bear any turn
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
    least = schedule(ScheduledGains(goal_acceleration=0.1), **narrow).decay_rate[0]
    assert least == pytest.approx(np.sqrt(0.1 * (0.4 / 0.015) ** 2 * 0.02 * 2.5 * np.sqrt(3.0) / 0.98))
    slow = schedule(ScheduledGains(funnel_acceleration=0.1))
    assert slow.decay_rate[0] == 1.5


def test_the_log_term_at_rest_stays_below_its_acceleration():
    lower, upper, rest = np.zeros(3), np.ones(3), np.array([0.5, 0.03, 1.0 - 0.02])
    goal_upper = np.array([1.0, 1.0, 1.0])
    gains = schedule(
        ScheduledGains(),
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
    gains = schedule(ScheduledGains())
    # Quintic walls stand still at first, and k1 begins at zero: the wanted rate is zero.
    kappa = gains.log_gain[0]
    assert gains.energy_bound[0] == pytest.approx(0.6 * kappa * s**2 + 0.5 * kappa + 0.5 * 0.02**2)


def test_energies_of_a_rule_without_a_ramp_hold_the_rate_wanted_at_rest():
    s = np.log(0.4 / 0.6)
    gains = schedule(FixedGains(funnel="quintic", log_gain=0.1))
    at_rest = 0.5 * 0.1 * s**2 + 0.5 * (s * 0.4 * 0.6) ** 2
    assert gains.energy_bound[0] == pytest.approx(1.2 * at_rest + 0.05)


def test_fixed_gains_do_not_look_at_the_cell():
    wide, narrow = (
        schedule(FixedGains(joint_decay_rate=3.0)),
        schedule(FixedGains(joint_decay_rate=3.0), clearance=1e-6),
    )
    for gains in (wide, narrow):
        assert (gains.stiffness, gains.damping, gains.governor_gain) == (50.0, 5.0, 5.0)
        assert gains.decay_rate.tolist() == [2.0, 3.0]
        assert gains.log_gain.tolist() == [1.0, 1.0]
        assert gains.funnel == "exponential"


@pytest.mark.parametrize("gain_set", [FixedGains(), ScheduledGains()])
@pytest.mark.parametrize("resting", [[0.0, -1.0], [1.0, 1.0], [-0.3, 2.0], [5.0, -5.0]])
def test_rest_on_or_outside_the_border_gives_finite_gains_that_lead_back(gain_set, resting):
    resting = np.array(resting)
    gains = schedule(gain_set, resting=resting)
    for values in (gains.decay_rate, gains.log_gain, gains.energy_bound):
        assert np.all(np.isfinite(values))
        assert np.all(values > 0.0)
    funnel = Funnel(**SLICE, **GOAL, decay_rate=gains.decay_rate, shape=gains.funnel)
    acceleration = funnel_acceleration(resting, np.zeros(2), funnel, 0.0, gains)
    assert np.all(np.isfinite(acceleration))
    assert np.all(np.sign(acceleration) == np.where(resting <= SLICE["slice_lower"], 1.0, -1.0))


def test_a_goal_as_wide_as_the_slice_is_allowed():
    gains = schedule(ScheduledGains(), goal_lower=SLICE["slice_lower"], goal_upper=SLICE["slice_upper"])
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
        schedule(ScheduledGains(), **changes)
