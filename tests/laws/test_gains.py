import numpy as np
import pytest

from coop_drake.laws import FixedGains, ScheduledGains, TransitionGains
from coop_drake.laws.gains import IDEAL_AGE


def test_defaults_of_the_fixed_set_are_table_2():
    gains = FixedGains()
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


@pytest.mark.parametrize("gain_set", [FixedGains, ScheduledGains])
@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("energy_allowance", 0.0, "energy_allowance: 0.0 is not allowed; expected a positive number"),
        ("energy_allowance", float("nan"), "energy_allowance: nan is not allowed; expected a finite number"),
        ("smoothing", -0.001, "smoothing: -0.001 is not allowed; expected zero or a positive number"),
        ("energy_factor", 0.9, "energy_factor: 0.9 is not allowed; expected a number of at least 1"),
        ("saturation", 0.5, "saturation: 0.5 is not allowed; expected a positive number, less than 0.5"),
    ],
)
def test_bad_gains_are_refused_by_name(gain_set, name, value, message):
    with pytest.raises(ValueError, match="^" + message + "$"):
        gain_set(**{name: value})


def test_an_unknown_shape_of_a_funnel_is_refused():
    with pytest.raises(
        ValueError, match=r"^funnel: 'cubic' is not allowed; expected one of exponential, quintic$"
    ):
        FixedGains(funnel="cubic")


def test_bounds_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match=r"^min_stiffness: 9.0 .* expected at most max_stiffness, 3$"):
        ScheduledGains(min_stiffness=9.0, max_stiffness=3.0)


def test_an_age_that_is_given_stays_and_an_ideal_team_gets_the_smallest():
    gains = ScheduledGains()
    assert gains.age == gains.for_age(0.0).age == IDEAL_AGE
    assert gains.for_age(0.03).age == 0.03
    assert ScheduledGains(command_age=0.002).for_age(0.03).age == 0.002


def test_select_keeps_the_axes_asked_for():
    gains = TransitionGains(
        stiffness=50.0,
        damping=5.0,
        governor_gain=5.0,
        smoothing=0.0,
        funnel="quintic",
        decay_rate=np.array([1.0, 2.0, 3.0]),
        log_gain=np.array([4.0, 5.0, 6.0]),
        position_gain=1.0,
        rate_gain=8.0,
        ramp_rate=2.0,
        saturation=0.02,
        hand_over_time=0.1,
        energy_bound=np.array([7.0, 8.0, 9.0]),
    )
    own = gains.select(np.array([0, 2]))
    assert own.decay_rate.tolist() == [1.0, 3.0]
    assert own.log_gain.tolist() == [4.0, 6.0]
    assert own.energy_bound.tolist() == [7.0, 9.0]
    assert own.rate_gain == 8.0


def test_gains_may_be_computed_with_numpy():
    gains = ScheduledGains(wall_stiffness=np.float64(20.5), min_stiffness=np.int64(50))
    assert (gains.wall_stiffness, gains.min_stiffness) == (20.5, 50.0)
