"""Words of a team that does not stop: its phases, and what holds whatever is late or lost."""

from math import inf, isfinite

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.laws import words as w
from tests.support import word_world as world
from tests.support.word_world import (
    Team,
    even_schedule,
    explore,
    random_schedule,
    run_world,
    schedule_of_steps,
)

EPS = 0.002
ROUNDING = 1e-9
WINDOW = 0.05 + 2.0 * EPS + 2.0 * 0.005


def arrived(team):
    return team.code[0] == w.ARRIVED


def all_are(kind):
    return lambda team: all(one == kind for one in team.kinds)


# What a schedule must keep.


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"brakes": [0.127, 0.6]}, "brake phase of cell 0 must be at least 0.128 s after"),
        (
            {"brakes": [0.3, 1.1]},
            "brake phase of cell 1 must be at least 0.128 s after its begin, and before",
        ),
        ({"entries": [0.0, 0.597, 0.8]}, "cells 0 and 1 must overlap for at least 0.004 s"),
        ({"entries": [0.0, 0.41, 0.8]}, "cell 1 must be begun after its entry"),
        ({"begins": [0.0, 0.61, 0.8]}, "cell 0 must be begun after its entry, and be left after the next"),
        ({"begins": [0.1, 0.4, 0.8]}, "cell 0 must be entered and begun at phase 0"),
        ({"brakes": [0.3, 0.6, 1.6]}, "last brake phase must be before the motion's end"),
        ({"ends": [0.6, 1.0]}, "of every cell"),
        ({"start_rate": 0.0}, "must be positive"),
    ],
)
def test_a_schedule_that_the_guarantees_do_not_hold_for_is_refused(change, message):
    given = {
        "entries": [0.0, 0.4, 0.8], "begins": [0.0, 0.4, 0.8], "brakes": [0.3, 0.6], "ends": [0.6, 1.0, 1.5],
        "ramp": 0.1, "start_rate": 1.0, "period": 0.005, "delay": 0.05, "clock_error": EPS,
    }  # fmt: skip
    assert w.schedule_of(**given).window == pytest.approx(WINDOW)
    with pytest.raises(ValueError, match=message):
        w.schedule_of(**{**given, **change})


# Phase, pace and its rate.


def profile(motion, schedule, begin, end, steepest):
    """Sample a motion, whose columns are integrals of each other, and rho'' at most ``steepest``."""
    times = np.linspace(begin, end, 20001)
    phase, pace, rate = world.sample(schedule, motion, times)
    step = times[1] - times[0]
    for value, slope in ((phase, pace), (pace, rate)):
        sums = np.append(0.0, np.cumsum(0.5 * (slope[1:] + slope[:-1]) * step))
        np.testing.assert_allclose(value - value[0], sums, atol=step**2 * steepest * (1.0 + end - begin))
    assert np.abs(np.diff(rate)).max() <= 1.01 * steepest * step
    return times, phase, pace, rate


def motion_of(schedule, first=1.0, *, brake_at=inf, cell=0, origin=None, creep=0.0):
    motion = w.first_motion(first)
    motion[w.BEGIN], motion[w.BRAKE_AT] = 0.0, brake_at
    motion[w.WAY], motion[w.END] = schedule.ends[cell] - schedule.brakes[cell], schedule.ends[cell]
    motion[w.ORIGIN], motion[w.CREEP] = first if origin is None else origin, creep
    return motion


def long_schedule(ramp=0.1, start_rate=1.0, way=0.5):
    """One stop far from all other events."""
    brakes = np.array([50.0, 100.0])
    return w.schedule_of(
        [0.0, 40.0], [0.0, 40.0], brakes[:1], [50.0 + way, 200.0], ramp=ramp, start_rate=start_rate,
        period=0.005, delay=0.05, clock_error=EPS,
    )  # fmt: skip


RATES = st.floats(0.3, 5.0)


@settings(max_examples=25)
@given(RATES, st.floats(0.01, 30.0))
def test_a_start_costs_one_over_its_rate_and_leaves_room_for_the_acceleration_of_the_motion(rate, first):
    schedule = long_schedule(start_rate=rate)
    times, phase, pace, slope = profile(motion_of(schedule, first), schedule, 0.0, 20.0 / rate, 2.0 * rate**2)
    assert (phase[0], pace[0], slope[0]) == (first, 0.0, 0.0)
    assert (slope >= 0.0).all()
    assert (slope <= rate * (1.0 - pace**2) + ROUNDING).all()
    assert pace[-1] == pytest.approx(1.0, abs=1e-15)
    assert phase[-1] == pytest.approx(first + times[-1] - 1.0 / rate)


def test_a_start_at_phase_zero_where_the_motion_rests_is_at_pace_one_at_once():
    schedule = long_schedule()
    motion = motion_of(schedule, 0.0, brake_at=3.0)
    assert w.phase_at(schedule, motion, 0.0) == (0.0, 0.0, 0.0)
    assert w.phase_at(schedule, motion, 1e-9) == (1e-9, 1.0, 0.0)
    assert w.phase_at(schedule, motion, 3.0) == (3.0, 1.0, 0.0)
    assert w.phase_at(schedule, motion, 3.5)[1:] == (pytest.approx(0.5), pytest.approx(-1.0 / 0.9))
    assert w.phase_at(schedule, motion, 4.0)[:2] == (pytest.approx(3.5), 0.0)


@settings(max_examples=40)
@given(RATES, st.floats(0.01, 0.4), st.floats(0.02, 2.0), st.floats(0.0, 20.0))
def test_a_stop_that_begins_at_any_time_keeps_its_rate_and_ends_within_its_way(rate, ramp, way, at):
    schedule = long_schedule(ramp, rate, way)
    motion = motion_of(schedule, brake_at=at)
    kappa = 1.0 / (2.0 * way - min(ramp, way))
    steepest = kappa / min(ramp, way) + 2.0 * rate * kappa + 2.0 * rate**2
    times, phase, pace, slope = profile(motion, schedule, max(at - 0.5, 0.0), at + 2.0 * way + 0.1, steepest)
    assert (slope >= -kappa - ROUNDING).all()
    assert (slope <= rate * (1.0 - pace**2) + ROUNDING).all()
    assert ((pace >= 0.0) & (pace <= 1.0)).all()
    assert (pace[times > at + 2.0 * way + ROUNDING] == 0.0).all()
    begin = w.phase_at(schedule, motion, at)[0]
    assert begin <= phase[-1] <= begin + way * (1.0 + 1e-12)


@pytest.mark.parametrize(("ramp", "way"), [(0.1, 0.5), (0.1, 0.1), (0.1, 0.07)])
def test_a_stop_from_full_pace_takes_its_time_and_its_way(ramp, way):
    schedule = long_schedule(ramp, 1.0, way)
    motion, kappa = motion_of(schedule, brake_at=50.0), 1.0 / (2.0 * way - min(ramp, way))
    begin = w.phase_at(schedule, motion, 50.0)[0]
    assert 2.0 * way == pytest.approx(1.0 / kappa + min(ramp, way))
    assert w.phase_at(schedule, motion, 50.0 + 1.999 * way)[1] > 0.0
    assert w.phase_at(schedule, motion, 50.0 + 2.0 * way)[:2] == (pytest.approx(begin + way, abs=1e-12), 0.0)
    middle = w.phase_at(schedule, motion, 50.0 + way)
    assert middle[1:] == (pytest.approx(0.5), pytest.approx(-kappa))


@settings(max_examples=25)
@given(RATES, st.floats(1e-6, 0.9))
def test_a_robot_that_creeps_comes_from_rest_to_rest_before_the_start(rate, way):
    schedule = long_schedule(start_rate=rate)
    time = w.creep_time(schedule, way)
    motion, before = motion_of(schedule, 1.0, origin=1.0 - way, creep=time), -2.0 * schedule.window
    _, phase, pace, slope = profile(motion, schedule, before - 1.01 * time, before, 60.0 * way / time**3)
    assert (phase[0], pace[0], slope[0]) == (1.0 - way, 0.0, 0.0)
    assert (pace**2 + np.abs(slope) / rate < 1.0).all()
    assert w.phase_at(schedule, motion, before) == (1.0, 0.0, 0.0)


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.floats(0.0, 4.0), st.booleans())
def test_all_accelerations_are_allowed_where_those_are_that_a_plan_states(seed, at, brakes):
    """In an ellipse about any point that contains zero, such as friction leaves on a slope."""
    generator = np.random.default_rng(seed)
    matrix, middle = generator.normal(size=(2, 2)), generator.uniform(-0.6, 0.6, 2)

    def share(vector):
        return np.linalg.norm(vector @ matrix - middle)

    acceleration, velocity = generator.normal(size=(2, 2))
    rate, kappa, ramp = *generator.uniform(0.3, 3.0, 2), 0.1
    way = 0.5 * (1.0 / kappa + ramp)
    while (
        max(map(share, (acceleration, rate * velocity, -kappa * velocity, acceleration - kappa * velocity)))
        > 1
    ):
        acceleration, velocity = 0.95 * acceleration, 0.95 * velocity
    schedule = long_schedule(ramp, rate, way)
    motion = motion_of(schedule, brake_at=at if brakes else inf)
    for t in np.linspace(0.0, 8.0, 400):
        _, pace, slope = w.phase_at(schedule, motion, t)
        assert share(pace**2 * acceleration + slope * velocity) <= 1.0 + ROUNDING


@settings(max_examples=40)
@given(st.floats(0.001, 0.95), st.sampled_from([0.0, 0.3, 0.41, 0.7]))
def test_a_robot_brakes_where_a_hold_says_and_rests_before_its_cell_ends(share, first):
    """From any pace, also just after the start, where the pace is small."""
    schedule = even_schedule(4)
    team = Team(schedule, [first])
    team.until(all_are(w.RUN))
    hold = team.phases[0] + share * (schedule.brakes[2] - team.phases[0])
    team.words[0, 0, w.HOLD] = hold
    rows = team.until(lambda team: team.motions[0, w.BRAKE_AT] < inf)
    motion = team.motions[0].copy()
    found = w.phase_at(schedule, motion, motion[w.BEGIN] + motion[w.BRAKE_AT])[0]
    assert found == pytest.approx(hold, abs=1e-13)
    cell = np.searchsorted(schedule.brakes, hold)
    rows = np.concatenate([rows, team.until(all_are(w.REST))])
    assert team.words[0, 0, w.PHASE] <= schedule.ends[cell]
    kappa = 1.0 / (2.0 * (schedule.ends[cell] - schedule.brakes[cell]) - schedule.ramp)
    assert (rows[:, 0, 2] >= -kappa - ROUNDING).all()
    # No longer than the pace needs: twice its rate and two ramps.
    pace = w.phase_at(schedule, motion, motion[w.BEGIN] + motion[w.BRAKE_AT] + motion[w.WAY])[1] * 2.0
    assert 2.0 * motion[w.WAY] <= max(pace / kappa, schedule.ramp) + 2.0 * schedule.ramp


def test_a_stop_at_the_brake_phase_and_full_pace_ends_where_the_cell_does():
    schedule = even_schedule(6, start_rate=20.0)
    for cell in range(2, 5):
        team = Team(schedule, [0.0])
        team.until(all_are(w.RUN))
        team.words[0, 0, w.HOLD] = schedule.brakes[cell]
        team.until(all_are(w.REST))
        assert schedule.ends[cell] - 1e-12 <= team.words[0, 0, w.PHASE] <= schedule.ends[cell]


def test_after_the_last_brake_phase_the_motion_itself_ends():
    schedule = even_schedule(3)
    schedule = schedule._replace(brakes=np.append(schedule.brakes[:2], schedule.brakes[1]))
    for later, end in ((-0.01, schedule.ends[1]), (0.01, schedule.ends[2])):
        team = Team(schedule, [0.0])
        team.until(all_are(w.RUN))
        team.words[0, 0, w.HOLD] = schedule.brakes[1] + later
        team.until(all_are(w.REST))
        assert 0.9 * end < team.words[0, 0, w.PHASE] <= end
    assert team.words[0, 0, w.PHASE] == schedule.ends[2]


# Words.


@settings(max_examples=50)
@given(st.integers(0, 10**6))
def test_order_loss_and_repetition_of_words_do_not_matter_once_the_newest_has_come(seed):
    generator = np.random.default_rng(seed)
    schedule, team = even_schedule(4), None
    team = Team(schedule, [0.0, 0.0])
    said = []
    while not arrived(team):
        team.alarms[1] = w.GROWS if 1.0 < team.time < 1.1 else w.THERE
        team.step()
        said.append(team.past[0].copy())
    until = generator.integers(1, len(said))
    for sender in range(3):
        heard = w.first_words(schedule, 2)
        order = generator.integers(0, until, generator.integers(1, 30))
        for index in [*order, until - 1, *order]:
            w.hear(heard, sender, said[index][sender])
        np.testing.assert_array_equal(heard[sender], said[until - 1][sender])


def test_words_of_another_plan_and_of_an_epoch_that_is_over_are_not_heard():
    schedule = even_schedule(3)
    words = w.first_words(schedule, 2)
    words[0, w.EPOCH] = 2.0
    before = words.copy()
    for change in ({w.PLAN: 1.0, w.EPOCH: 3.0}, {w.EPOCH: 1.0}):
        word = before[0].copy()
        word[w.CELL], word[w.HOLD], word[w.STAMP] = 2.0, 0.1, 5.0
        for column, value in change.items():
            word[column] = value
        w.hear(words, 0, word)
        np.testing.assert_array_equal(words, before)


# The team.


def test_a_plan_of_one_cell_has_no_brake_phase():
    schedule = w.schedule_of(
        [0.0], [0.0], [], [1.5], ramp=0.1, start_rate=2.0, period=0.005, delay=0.05, clock_error=EPS
    )
    team = Team(schedule, [0.0] * 2)
    team.until(lambda team: team.time > 1.0)
    team.wanted, team.alarms[0] = False, w.ASKS
    team.until(all_are(w.REST))
    assert (team.phases == 1.5).all()


def test_robots_that_rest_apart_creep_to_the_one_in_front_and_go_on_together():
    schedule = even_schedule(6)
    phases = [0.45, 0.3, 0.7]  # in no common cell: cell 0 ends at 0.548, cell 2 is entered at 0.8
    team = Team(schedule, phases)
    rows = team.until(all_are(w.RUN))
    assert rows[-1, :, 0] == pytest.approx([0.7] * 3, abs=1e-6)
    creeps = schedule.start_rate * (1.0 - rows[:, :, 1] ** 2) - np.abs(rows[:, :, 2])
    assert (creeps > 0.0).all()
    assert (rows[:, 2, 0] < 0.7 + 1e-6).all()
    team.until(arrived)


def test_a_team_has_arrived_when_all_measure_that_they_are_at_the_goal():
    team = Team(even_schedule(3), [0.0] * 3)
    team.alarms[1] = w.QUIET
    team.until(lambda team: team.time > team.schedule.ends[-1] + 0.5)
    assert team.kinds == [w.REST] * 3
    assert team.code == (w.GOES, 1)
    team.alarms[1] = w.THERE
    team.until(arrived)
    assert team.words[0, 0, w.EPOCH] == 1.0


@pytest.mark.parametrize("heard", [True, False])
def test_the_supervisor_waits_at_the_end_for_nobody_whom_it_hears(heard):
    """A robot whose clock is behind ends the motion in a later sample than the others."""
    team, seen, parted = Team(even_schedule(3), [0.0] * 3), set(), False
    team.clocks[:2] = 1.0, -1.0
    team.until(lambda team: team.time > 1.0 and team.phases[0] > team.schedule.ends[-1] - 0.01)
    team.closed = set() if heard else {(1, 3)}
    for _ in range(40):
        team.step()
        seen.add(team.code)
        parted = parted or {w.RUN, w.REST} <= {*team.kinds}
    assert parted
    assert seen == {(w.GOES, -1), (w.ARRIVED, -1) if heard else (w.WAITS, 1)}


def test_a_stop_stands_in_the_motion_as_soon_as_it_is_less_than_the_window_away():
    """So that times ahead of a sample have their phase, and the pace does not jump."""
    schedule = even_schedule(6)
    team, ahead = Team(schedule, [0.0]), 0.06
    team.until(lambda team: team.time > 1.0)
    team.words[0, 0, w.HOLD] = schedule.brakes[3]
    while team.kinds[0] != w.REST:
        said = w.phase_at(schedule, team.motions[0], team.time + ahead - schedule.period)
        for _ in range(12):
            team.step()
        assert team.phases[0] == pytest.approx(said[0], abs=1e-12)
        assert team.now[0][1:] == pytest.approx(said[1:], abs=1e-12) or team.kinds[0] == w.REST


def test_who_has_crept_to_a_start_that_is_called_off_stays_there():
    team = Team(even_schedule(6), [0.45, 0.7])
    team.until(all_are(w.ARMED))
    begin = team.motions[0, w.BEGIN]
    team.until(lambda team: team.time > begin - 1.9 * team.schedule.window)
    team.alarms[1] = w.ASKS
    team.until(all_are(w.REST))
    team.step()
    assert team.phases.tolist() == [0.7, 0.7]


def test_a_stop_within_the_first_period_of_a_start_stands_in_the_motion_before_it():
    team = Team(even_schedule(6), [0.0])
    team.until(all_are(w.ARMED))
    begin = team.motions[0, w.BEGIN]
    team.until(lambda team: team.time > begin - team.schedule.window)
    team.alarms[0] = w.GROWS
    team.step()
    hold = team.words[0, 0, w.HOLD]
    assert 0.0 < hold <= team.schedule.period
    assert team.kinds == [w.ARMED]
    assert team.motions[0, w.BRAKE_AT] == pytest.approx(hold)


def test_no_start_leads_beyond_the_cell_after_the_least_begun():
    """Neither does the supervisor say such a start, nor does a robot take it."""
    schedule = even_schedule(6)
    for phase, starts in ((schedule.ends[2], True), (schedule.ends[2] + 1e-6, False)):
        words = w.first_words(schedule, 2, phase)
        words[:2, w.CELL], words[:2, w.FIT], words[:2, w.STAMP] = [2.0, 1.0], 1.0, 0.0
        order = words.copy()
        assert w.supervisor_step(schedule, 0.0, True, order) == ((w.GOES, -1) if starts else (w.WAITS, 1))
        assert order[2, w.EPOCH] == starts
        words[2, w.EPOCH], words[2, w.PHASE], words[2, w.TIME] = 1.0, phase, 1.0
        w.robot_step(schedule, 0.0, w.QUIET, 1, w.first_motion(phase), words)
        assert words[1, w.KIND] == (w.ARMED if starts else w.REST)


@pytest.mark.parametrize("late", [0.02, 0.2])
def test_a_hold_that_is_heard_too_late_is_kept_from_the_last_sample_on(late):
    team = Team(even_schedule(6), [0.0])
    team.until(lambda team: team.time > 1.5)
    before = team.now[0]
    team.words[0, 0, w.HOLD] = before[0] - late
    phase, pace, rate = team.step()[0]
    step = team.schedule.period
    assert before[0] < phase <= before[0] + step
    assert abs(pace - before[1]) <= 10.0 * step**2  # rho'' = kappa / r < 20
    assert rate < 0.0
    assert team.kinds == [w.BRAKE]


@pytest.mark.parametrize(("age", "fit"), [(WINDOW - 1e-6, 1.0), (WINDOW + 1e-6, 0.0)])
def test_who_was_not_heard_for_longer_than_words_may_take_is_missed(age, fit):
    schedule = even_schedule(3)
    words, motion = w.first_words(schedule, 2), w.first_motion()
    words[1, w.STAMP] = 7.0 - age
    w.robot_step(schedule, 7.0, w.QUIET, 0, motion, words)
    assert words[0, w.FIT] == fit


def test_a_hold_behind_the_start_that_comes_just_after_it_stops_where_the_robot_is():
    team = Team(even_schedule(5), [0.7] * 2)
    team.until(all_are(w.RUN))
    team.motions[:, w.LAST], team.words[0, 0, w.HOLD] = 0.0, 0.3
    rows = team.until(all_are(w.REST))
    assert (rows[:, :, 0] >= 0.7).all()
    assert (rows[-1, :, 0] < 0.702).all()


def test_starts_of_a_supervisor_and_of_its_successor_are_not_taken_for_one():
    """Robot 0 takes the start of the first one, the others that of the second: neither may count."""
    team = Team(even_schedule(6), [0.0] * 3)
    team.closed = {(3, 1), (3, 2)}
    team.until(lambda team: team.words[-1, -1, w.EPOCH] == 1.0)
    team.words[-1] = w.first_words(team.schedule, 3, again=True)
    team.step()
    assert team.words[-1, -1, w.EPOCH] == 2.0
    team.closed = set()
    team.until(lambda team: team.kinds == [w.ARMED] * 3)
    assert [team.words[k, k, w.EPOCH] for k in range(3)] == [1.0, 2.0, 2.0]
    rows = team.until(lambda team: team.words[-1, -1, w.EPOCH] > 2.0)
    assert not rows[:, :, 1].any()
    team.until(arrived)


def test_the_common_brake_stops_all_at_once_and_a_new_start_ends_it():
    schedule = even_schedule(6)
    team = Team(schedule, [0.0] * 3)
    team.until(lambda team: team.time > 1.5)
    team.alarms[2] = w.BRAKES
    team.step()
    team.step()
    assert team.kinds == [w.REST] * 3
    assert [team.words[k, k, w.HOLD] for k in range(3)] == [-inf] * 3
    assert np.ptp(team.phases) <= 2.0 * schedule.period
    team.alarms[2] = w.THERE
    team.until(all_are(w.ARMED))
    assert [team.words[k, k, w.HOLD] for k in range(3)] == [inf] * 3
    team.until(arrived)


@pytest.mark.parametrize(("wrong", "holds"), [(1.9, False), (6.0, True)])
def test_a_stamp_that_clocks_do_not_allow_asks_for_a_hold(wrong, holds):
    schedule = even_schedule(6)
    team = Team(schedule, [0.0] * 3)
    team.until(lambda team: team.time > 1.5)
    team.clocks[1] = wrong
    for _ in range(5):
        team.step()
    assert (team.words[0, 0, w.HOLD] < inf) == holds


def test_a_robot_whose_monitor_is_not_quiet_says_no_cell_begun_that_it_enters():
    schedule = even_schedule(6)
    team = Team(schedule, [0.0] * 3)
    team.until(lambda team: team.time > 0.5 and team.phases[0] > schedule.begins[2])
    team.alarms[1] = w.ASKS
    team.until(all_are(w.REST))
    assert team.phases[1] > schedule.begins[3]
    assert [team.words[k, k, w.CELL] for k in range(3)] == [3.0, 2.0, 3.0]


@pytest.mark.parametrize(("share", "brake"), [(1.2, 3), (0.5, 4)])
def test_people_hold_the_team_where_all_can_still_have_heard_of_it(share, brake):
    schedule = even_schedule(6)
    team = Team(schedule, [0.0] * 3)
    team.until(lambda team: team.time > 0.5 and team.phases[0] > schedule.brakes[3] - share * schedule.window)
    team.wanted = False
    team.step()
    assert team.words[-1, -1, w.HOLD] == schedule.brakes[brake]


def test_the_supervisor_names_the_robot_that_it_waits_for():
    schedule = even_schedule(6)
    team = Team(schedule, [0.0] * 3)
    team.until(lambda team: team.time > 1.0)
    team.closed = {(1, k) for k in (0, 2, 3)}
    team.until(all_are(w.REST))
    for _ in range(50):
        team.step()
    assert team.code == (w.WAITS, 1)


# All interleavings of words of three robots; words are up to two steps old, so that W is just enough.

LINKS = [(i, j) for i in range(4) for j in range(4) if i != j]
SUPERVISORS = [link for link in LINKS if 3 in link]
BREAKS = (
    [[link] for link in LINKS]
    + [[link for link in LINKS if link[1] == k] for k in range(4)]
    + [[link for link in LINKS if link[0] == k] for k in range(4)]
    + [[link for link in LINKS if k in link] for k in range(4)]
)


@pytest.mark.parametrize("clocks", [(0, 0, 0, 0), (1, -1, 1, -1), (-1, 1, 1, 1)])
def test_inside_the_delay_every_interleaving_arrives_without_a_hold(clocks):
    eps = 0.2 if any(clocks) else 0.0
    found = explore(schedule_of_steps(clock_error=eps), 2, clocks=clocks)
    assert found.states > 3000
    assert found.spread <= 2.0 * eps + ROUNDING
    assert (found.nowhere, found.beyond) == (0, 0.0)


@pytest.mark.parametrize("alarm", [w.ASKS, w.GROWS])
def test_inside_the_delay_all_brake_at_the_same_phase_whoever_asks_and_whenever(alarm):
    found = explore(schedule_of_steps(), 2, timely=SUPERVISORS, asks=[(0, alarm)], ask_until=11)
    assert found.states > 3000
    assert (found.spread, found.nowhere, found.beyond) == (0.0, 0, 0.0)
    found = explore(schedule_of_steps(), 1, asks=[(0, alarm)], ask_until=45)
    assert (found.spread, found.nowhere, found.beyond) == (0.0, 0, 0.0)


def test_whatever_breaks_and_is_repaired_no_robot_leaves_the_cells_that_all_allow_and_all_arrive():
    found = explore(schedule_of_steps(), 1, breaks=BREAKS, until=45)
    assert found.states > 10000
    assert (found.nowhere, found.beyond) == (0, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "setting",
    [
        {"ages": 2, "timely": SUPERVISORS, "asks": [(0, w.ASKS)], "ask_until": 40},
        {"ages": 2, "timely": SUPERVISORS, "asks": [(0, w.GROWS)], "ask_until": 40},
        {"ages": 1, "breaks": BREAKS, "until": 40, "asks": [(0, w.GROWS)], "ask_until": 40},
        {"ages": 2, "timely": SUPERVISORS, "breaks": BREAKS[12::4], "until": 40},
    ],
)
def test_more_interleavings(setting):
    found = explore(schedule_of_steps(), **setting)
    print(found)
    assert found.beyond == 0.0
    assert "breaks" in setting or (found.spread, found.nowhere) == (0.0, 0)


# Random worlds.


def world_of(seed):
    """A schedule, and what monitors and people ask for in it."""
    generator = np.random.default_rng(seed)
    schedule = random_schedule(generator, 6, period=generator.choice([0.005, 0.01, 0.02]))
    begin, pause = generator.uniform(0.0, 4.0, 2)
    asks = (
        generator.integers(3),
        generator.choice([w.ASKS, w.GROWS]),
        begin,
        begin + generator.uniform(0.0, 0.3),
    )
    return generator, schedule, {"alarms": [asks], "pauses": [(pause, pause + generator.uniform(0.0, 0.5))]}


def check_world_inside_the_delay(seed):
    _, schedule, asks = world_of(seed)
    for each in ({}, asks):
        found = run_world(schedule, seed, **each)
        assert isfinite(found[world.ARRIVAL]), (seed, each)
        assert found[world.SPREAD] <= 2.0 * EPS + ROUNDING, (seed, each)
        wrong = found[[world.NOWHERE, world.LIES, world.ROUGH, world.UNEQUAL]]
        assert not wrong.any(), (seed, each, wrong)
        assert found[[world.BEYOND, world.OVERRUN]].max() <= 0.0, (seed, each)
        assert each or (found[world.EPOCHS], found[world.HELD]) == (1.0, 0.0), seed


def check_world_beyond_the_delay(seed):
    generator, schedule, asks = world_of(seed)
    fault, one = generator.choice([world.DEAF, world.MUTE, world.CUT, world.FORGETS]), generator.integers(4)
    if fault == world.FORGETS:
        one = 3
    begin, span = generator.uniform(0.0, 4.0), generator.uniform(0.05, 1.0)
    found = run_world(schedule, seed, faults=[(fault, one, begin, begin + span)], **asks)
    late, ways = schedule.window + 2.0 * schedule.period, schedule.ends - schedule.brakes
    assert isfinite(found[world.ARRIVAL]), seed
    assert found[world.SPREAD] <= 2.0 * EPS + late + ways[:-1].max(), seed
    assert found[[world.BEYOND, world.OVERRUN]].max() <= 0.0, seed
    assert not found[[world.LIES, world.ROUGH]].any(), seed


def check_world_with_a_dead_robot(seed):
    generator, schedule, asks = world_of(seed)
    one, when = generator.integers(3), generator.uniform(0.0, 3.0)
    found = run_world(
        schedule, seed, faults=[(world.DEAD, one, when, inf)], until_rest=True, limit=20.0, **asks
    )
    assert isfinite(found[world.ARRIVAL]) or found[world.STILL] > 1.0, seed
    assert found[[world.BEYOND, world.OVERRUN]].max() <= 0.0, seed
    assert not found[[world.LIES, world.ROUGH]].any(), seed


CHECKS = [check_world_inside_the_delay, check_world_beyond_the_delay, check_world_with_a_dead_robot]


@pytest.mark.parametrize("check", CHECKS)
def test_in_random_worlds_what_is_guaranteed_holds(check):
    for seed in range(150):
        check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("check", CHECKS)
def test_in_ten_thousand_random_worlds_what_is_guaranteed_holds(check):
    for seed in range(10000):
        check(seed)


@pytest.mark.parametrize("fault", [world.DEAF, world.MUTE, world.CUT])
@pytest.mark.parametrize("alarm", [w.THERE, w.ASKS, w.GROWS])
def test_robots_that_are_not_heard_for_half_a_second_part_by_little(fault, alarm):
    """By what clocks allow where they hear or are heard; otherwise by what silence takes to be noticed."""
    schedule, worst = even_schedule(21, start_rate=20.0), 0.0
    for seed in range(40):
        generator = np.random.default_rng(seed)
        begin, one = generator.uniform(1.0, 8.0), generator.integers(3)
        asks = begin + generator.uniform(0.0, 0.5)
        found = run_world(
            schedule, seed, faults=[(fault, one, begin, begin + 0.5)],
            alarms=[((one + generator.integers(1, 3)) % 3, alarm, asks, asks + 0.1)],
        )  # fmt: skip
        assert isfinite(found[world.ARRIVAL])
        worst = max(worst, found[world.SPREAD])
    parted = fault == world.CUT or (fault == world.DEAF and alarm != w.THERE)
    assert worst <= 2.0 * EPS + (WINDOW + 2.0 * schedule.period if parted else 0.0) + ROUNDING
