"""Motions of plans are verified at all times; altered ones are refused, each with its entry."""

import json
import re
from dataclasses import replace
from functools import partial
from math import inf, pi

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from coop_drake import Found, save_plan
from coop_drake import plan as make
from coop_drake.answers import motion as defaults
from coop_drake.answers.document import problem_digest
from coop_drake.answers.motion import pull_gains
from coop_drake.answers.problem import TeamLimits
from coop_drake.errors import PlanError, RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.duration import timed
from coop_drake.planning.motion import quickest_motion
from coop_drake.planning.motion_limits import base_chains, base_places, motion_limits
from coop_drake.plant.problem import planning_problem
from coop_drake.verification import verify_file, verify_plan
from coop_drake.verification.gains import check_limits, check_speeds
from coop_drake.verification.motion import _Mover, _movers, check_motion
from coop_drake.verification.runs.bodies import component_stages
from tests.support.certificates import changed, write
from tests.support.motions import passing, planned_motion
from tests.support.small_scenario import small_scenario
from tests.support.trees import trees

GAINS = ScheduledGains()


@pytest.fixture(scope="module", params=["base", "elbow"])
def either(request):
    return planned_motion(request.param)


@pytest.fixture(scope="module")
def base():
    return planned_motion("base")


def checked(plan, problem, **changes):
    """The checks of a plan with another motion."""
    return check_motion(replace(plan, motion=replace(plan.motion, **changes)), problem, GAINS)


def refused(plan, problem, **changes):
    """Where a plan with another motion is refused, and what is said."""
    with pytest.raises(RefusalError) as error:
        checked(plan, problem, **changes)
    return str(error.value)


def refusal(plan, problem, **changes):
    """Where a plan with another motion is refused; empty where it is accepted."""
    try:
        checked(plan, problem, **changes)
    except RefusalError as error:
        return error.where
    return ""


def spline(motion):
    """The motion by another implementation than the one that is tested."""
    return BSpline(motion.period * (np.arange(len(motion.points) + 4) - 3.0), motion.points, 3)


def places(problem, z):
    """Positions (x, y) of object and bases, shape (1 + N, T, 2), and angles and joints, shape (., T, 1)."""
    of = problem.limits
    bases = base_places(
        base_chains(problem.tree, list(zip(of.base_components, of.base_points, strict=True))), z
    )
    return [z[:, :2], *bases[..., :2]], [*bases[..., 2:], *z.T[3:, :, None]]


def limits_of(problem):
    """Largest speeds and accelerations of what ``places`` returns."""
    of, robots, joints = problem.limits, len(problem.limits.base_points), len(problem.tree.joints)
    speeds = [np.inf, *[1.0] * robots, *[1.0] * robots, *[1.0] * joints]
    accelerations = [1.5, *[1.0] * robots, *[2.0] * robots, *[2.0] * joints]
    assert of.base_speeds.tolist() == [1.0] * robots
    assert not np.isfinite(of.base_accelerations).any()
    return speeds, accelerations


def sampled(plan, problem, motion, count=4000):
    """By how much dense samples leave the cells [m, rad], and the largest share of a limit that they use."""
    curve, outside, share, last = spline(motion), 0.0, 0.0, len(plan.cells) - 1
    for i, ((begin, end), cell) in enumerate(zip(motion.windows, plan.cells, strict=True)):
        z = curve(np.linspace(begin, end, count // len(plan.cells)))
        away = shapely.distance(plan.governed(i), shapely.points(z[:, :2]))
        outside = max(outside, away.max(), (cell.lower - z[:, 2:]).max(), (z[:, 2:] - cell.upper).max())
        begin = 0.0 if i == 0 else motion.windows[i - 1, 0] + motion.waiting
        times, step = np.linspace(begin, end, count // len(plan.cells)), 2e-4
        now, before, after = (
            places(problem, curve(np.clip(times + shift, 0.0, motion.duration)))
            for shift in (0.0, -step, step)
        )
        kappa = motion.rates[i] if i < last else 0.0
        for x, low, high, speed, most in zip(
            *(one[0] + one[1] for one in (now, before, after)), *limits_of(problem), strict=True
        ):
            v, a = (high - low) / (2.0 * step), (high - 2.0 * x + low) / step**2
            hardest = max(np.linalg.norm(one, axis=1).max() for one in (a, kappa * v, a - kappa * v))
            share = max(share, np.linalg.norm(v, axis=1).max() / speed, hardest / most)
    return outside, share


def test_true_motions_are_accepted_and_samples_agree(either):
    plan, problem = either
    checks = check_motion(plan, problem, GAINS)
    assert [check.count > 0 for check in checks] == [True] * 5
    outside, share = sampled(plan, problem, plan.motion)
    assert outside == 0.0
    assert checks[3].tightest <= 1.0 - share <= checks[3].tightest + 5e-3


# Alterations.


def moved_points(motion, rows, columns, by):
    points = motion.points.copy()
    points[rows, columns] += by
    return {"points": points}


def moved_window(motion, row, column, to):
    windows = motion.windows.copy()
    windows[row, column] = to
    return {"windows": windows}


def other_rate(motion, row, rate):
    rates = motion.rates.copy()
    rates[row] = rate
    return {"rates": rates}


def other_gain(motion, loop, gain, factor):
    gains = [list(each) for each in motion.gains]
    gains[loop][gain] *= factor
    return tuple(map(tuple, gains))


def stretched(motion, factor, *, stops):
    """All times changed, and rates so that stops still end where they must."""
    windows = factor * motion.windows
    rates = motion.rates.copy()
    if stops:
        rates[:-1] = 1.0 / (2.0 * (windows[:-1, 1] - windows[:-1, 0] - motion.waiting) - motion.ramp)
    return {"period": factor * motion.period, "windows": windows, "rates": rates}


ALTERED = {
    "start moved": (lambda m: moved_points(m, [0, 1, 2], 0, 1e-6), r"motion\.points\[0\]"),
    "no rest at the start": (lambda m: moved_points(m, 1, 2, 1e-9), r"motion\.points\[1\]"),
    "accelerated at the start": (lambda m: moved_points(m, 2, 1, -1e-9), r"motion\.points\[2\]"),
    "no rest at the end": (lambda m: moved_points(m, -2, 0, 1e-9), r"motion\.points\[LAST_1\]"),
    "accelerated at the end": (lambda m: moved_points(m, -3, 3, 1e-9), r"motion\.points\[LAST_2\]"),
    "ends beside the goal": (lambda m: moved_points(m, [-3, -2, -1], 0, 0.011), r"motion\.points\[LAST\]"),
    "ends turned": (lambda m: moved_points(m, [-3, -2, -1], 2, 0.05), r"motion\.points\[LAST\]: .* theta"),
    "begins later": (lambda m: moved_window(m, 0, 0, 1e-3), r"motion\.windows\[0\]"),
    "begins before its beginning": (lambda m: moved_window(m, 0, 0, -1e-3), r"motion\.windows\[0\]"),
    "windows swapped": (
        lambda m: {"windows": m.windows[[0, 1, 3, 2, *range(4, len(m.windows))]]}, r"motion\.windows\[[23]\]"
    ),
    "a gap between windows": (lambda m: moved_window(m, 5, 0, m.windows[4, 1]), r"motion\.windows\[5\]"),
    "windows that overlap for less than clocks differ": (
        lambda m: moved_window(m, 5, 0, m.windows[4, 1] - 0.0039), r"motion\.windows\[5\]: begins",
    ),
    "two begin together": (lambda m: moved_window(m, 5, 0, m.windows[4, 0]), r"motion\.windows\[5\]"),
    "left before the one before it": (
        lambda m: moved_window(m, 5, 1, m.windows[4, 1]),
        r"motion\.windows\[5\]: ends",
    ),
    "a window without time": (lambda m: moved_window(m, 5, 1, m.windows[5, 0]), r"motion\.windows\[5\]"),
    "a window backwards": (lambda m: {"windows": m.windows[:, ::-1]}, r"motion\.windows\[0\]"),
    "ends after the end": (lambda m: moved_window(m, -1, 1, 1.001 * m.duration), r"motion\.windows\[END\]"),
    "ends before the end": (lambda m: moved_window(m, -1, 1, 0.999 * m.duration), r"motion\.windows\[END\]"),
    "left later": (lambda m: moved_window(m, 3, 1, m.windows[4, 1] - 1e-3), r"motion\.windows\[3\]: from"),
    "entered earlier": (
        lambda m: moved_window(m, 10, 0, 0.8 * m.windows[9, 0] + 0.2 * m.windows[10, 0]),
        r"motion\.windows\[10\]: from",
    ),
    "no time for a stop": (
        lambda m: moved_window(m, 7, 1, m.windows[7, 0] + m.waiting + 0.04),
        r"motion\.windows\[(7|8)\]",
    ),
    "stops too late": (lambda m: other_rate(m, 4, 0.999 * m.rates[4]), r"motion\.rates\[4\]"),
    "does not stop": (lambda m: other_rate(m, 4, 0.0), r"motion\.rates\[4\]"),
    "gains pace": (lambda m: other_rate(m, 4, -m.rates[4]), r"motion\.rates\[4\]"),
    "stops too hard": (lambda m: other_rate(m, 4, 20.0 * m.rates[4]), r"motion\.rates\[4\]: at .* brakes at"),
    "stops in the last cell": (lambda m: other_rate(m, -1, 1e-3), r"motion\.rates\[END\]"),
    "does not wait": (lambda m: {"waiting": 0.0}, r"motion\.waiting"),
    "waits longer": (lambda m: {"waiting": 1.1 * m.waiting}, r"motion\.rates\[0\]"),
    "waits for long": (lambda m: {"waiting": 2.0}, r"motion\.(rates|windows)\[\d+\]"),
    "brakes at once": (lambda m: {"ramp": 0.0}, r"motion\.ramp"),
    "brakes within a period": (lambda m: {"ramp": 1e-9}, r"motion\.ramp"),
    "brakes more gently": (lambda m: {"ramp": 1.1 * m.ramp}, r"motion\.rates\[0\]"),
    "a shorter period": (lambda m: {"period": 0.99 * m.period}, r"motion\.windows\[END\]"),
    "a longer period": (lambda m: {"period": 1.01 * m.period}, r"motion\.windows\[END\]"),
    "quicker": (lambda m: stretched(m, 0.99, stops=False), r"motion\.rates\[0\]"),
    "quicker, and stops so": (
        lambda m: stretched(m, 0.99, stops=True), r"motion\.(points|rates)\[\d+\]: at .*limit"
    ),
    "a jump": (lambda m: moved_points(m, 100, 0, 0.3), r"motion\.(points|windows)\[\d+\]: from"),
    "starts more quickly": (lambda m: {"start_rate": 1.02 * m.start_rate}, r"motion\.start_rate"),
    "pulled harder": (lambda m: {"gains": other_gain(m, 0, 0, 1.01)}, r"motion\.gains\[0\]\[0\]"),
    "pulled with less damping": (lambda m: {"gains": other_gain(m, 1, 1, 0.99)}, r"motion\.gains\[1\]\[1\]"),
    "no number in points": (lambda m: moved_points(m, 100, 0, np.nan), r"motion\."),
    "no number in windows": (lambda m: moved_window(m, 5, 1, np.nan), r"motion\.windows\[5\]"),
    "no number in rates": (lambda m: other_rate(m, 5, np.nan), r"motion\.rates\[5\]"),
    "no number as period": (lambda m: {"period": np.nan}, r"motion\.windows\[0\]"),
}  # fmt: skip


@pytest.mark.parametrize("name", ALTERED)
def test_altered_motions_are_refused_with_their_entry(base, name):
    alter, where = ALTERED[name]
    motion = base[0].motion
    last, end = len(motion.points) - 1, len(motion.windows) - 1
    numbers = {"LAST_1": last - 1, "LAST_2": last - 2, "LAST": last, "END": end}
    for name, number in numbers.items():
        where = where.replace(name, str(number))
    assert re.match(where, message := refused(*base, **alter(motion))), message


def test_slower_motions_of_the_same_cells_are_accepted(base):
    plan, problem = base
    checked(plan, problem, **stretched(plan.motion, 1.01, stops=True))


def inside_window(motion, cell):
    """The knots in a cell's window and its ends, and many times between them [s]."""
    begin, end = motion.windows[cell].tolist()
    knots = motion.period * np.arange(len(motion.points) - 2)
    return np.array([begin, *knots[(begin < knots) & (knots < end)], end]), np.linspace(begin, end, 20001)


def test_a_motion_that_leaves_its_cell_between_two_knots_only_is_refused(base):
    """Cells end between the largest angle at knots and that between them."""
    plan, problem = base
    curve, found = spline(plan.motion), 0
    for cell in range(len(plan.cells)):
        knots, dense = (curve(times)[:, 2:] for times in inside_window(plan.motion, cell))
        for axis in range(knots.shape[1]):
            at_knots, between = knots[:, axis].max(), dense[:, axis].max()
            if between > at_knots + 1e-6:
                upper = plan.cells[cell].upper.copy()
                upper[axis] = 0.5 * (at_knots + between)
                cells = list(plan.cells)
                cells[cell] = replace(cells[cell], upper=upper)
                message = refused(replace(plan, cells=tuple(cells)), problem)
                assert message.startswith(("motion.points[", "motion.windows[")), message
                found += message.startswith("motion.points[")
    assert found > 3


def test_a_position_that_leaves_its_region_between_two_knots_only_is_refused(base):
    plan, problem = base
    curve, found = spline(plan.motion), 0
    for cell in range(len(plan.cells)):
        knots, dense = (curve(times)[:, :2] for times in inside_window(plan.motion, cell))
        for turn in np.linspace(0.0, 2.0 * pi, 24, endpoint=False):
            along = np.array([np.cos(turn), np.sin(turn)])
            at_knots, between = (knots @ along).max(), (dense @ along).max()
            if between > at_knots + 1e-6:
                region = shapely.affinity.rotate(
                    shapely.box(-99.0, -99.0, 0.5 * (at_knots + between), 99.0), turn, (0.0, 0.0), True
                ).intersection(shapely.box(-90.0, -90.0, 90.0, 90.0))
                cells = list(plan.cells)
                cells[cell] = replace(cells[cell], tidied=region)
                message = refused(replace(plan, cells=tuple(cells)), problem)
                assert message.startswith(("motion.points[", "motion.windows[")), message
                assert f"outside cells[{cell}].tidied" in message
                found += message.startswith("motion.points[")
    assert found > 3


# Limits.


LARGEST = {
    "base_speeds": 1.0, "turn_rates": 1.0, "joint_rates": 1.0, "joint_accelerations": 2.0,
    "base_accelerations": defaults.BASE_ACCELERATION, "turn_accelerations": defaults.TURN_ACCELERATION,
    "base_jerks": defaults.BASE_JERK, "object_acceleration": defaults.OBJECT_ACCELERATION,
    "frictions": defaults.FRICTION, "base_forces": 40.0,
}  # fmt: skip


def with_limit(problem, name, value):
    size = {"object_acceleration": 1}.get(name, len(getattr(problem.limits, name)) or 2)
    return replace(problem, limits=replace(problem.limits, **{name: np.full(size, value)}))


@pytest.mark.parametrize("name", LARGEST)
def test_every_limit_counts_as_the_problem_states_it(base, name):
    """By bisection: the motion is accepted above a value not far below the limit, and refused below."""
    plan, problem = base
    checked(plan, with_limit(problem, name, LARGEST[name]))
    low, high = 0.0, LARGEST[name]
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        if where := refusal(plan, with_limit(problem, name, middle)):
            assert where.startswith(("motion.points[", "motion.rates[", "motion.start_rate"))
            low = middle
        else:
            high = middle
    assert high > {"frictions": 0.15, "base_forces": 0.15}.get(name, 0.3) * LARGEST[name]
    points, angles = places(problem, spline(plan.motion)(np.linspace(0.0, plan.motion.duration, 20001)))
    robots = len(points) - 1
    of = {"base_speeds": points[1:], "turn_rates": angles[:robots], "joint_rates": angles[robots:]}.get(name)
    if of is not None:  # as differences of positions find it
        moved_by = max(np.linalg.norm(np.diff(one, axis=0), axis=1).max() for one in of)
        assert high == pytest.approx(moved_by * 20000 / plan.motion.duration, rel=2e-3)


def test_a_motion_within_little_friction_is_slower_and_keeps_it(base):
    plan, problem = base
    slippery = with_limit(problem, "frictions", 0.06)
    motion = quickest_motion(plan, slippery, motion_limits(slippery.limits), pull_gains(GAINS.age))
    assert motion.duration > 1.05 * plan.motion.duration
    checks = check_motion(replace(plan, motion=motion), slippery, GAINS)
    assert 0.0 <= min(check.tightest for check in checks if check.unit.startswith("least share")) < 0.01
    with pytest.raises(RefusalError, match=r"the centre of all that base \d moves is accelerated by"):
        check_motion(replace(plan, motion=motion), with_limit(problem, "frictions", 0.055), GAINS)


@pytest.mark.parametrize("unknown", [np.empty(0), np.full(2, np.inf)])
def test_limits_that_nobody_states_are_those_by_default(base, unknown):
    _, problem = base
    names = [name for name in LARGEST if name != "object_acceleration"]
    of = replace(problem.limits, **dict.fromkeys(names, unknown), object_acceleration=unknown[:1])
    movers = _movers(replace(problem, limits=of))
    found = [(one.speed, one.acceleration, one.jerk) for one in movers]
    by_friction = (np.inf, 0.5 * 9.81, np.inf)
    bases, joints = [(1.0, 1.0, 10.0), by_friction, (1.5, 2.0, np.inf)] * 2, [(1.0, 2.0, np.inf)] * 2
    assert found == [(np.inf, 1.5, np.inf), *bases, *joints]


STEPS = (0.0, 0.1, 0.2, 0.3, 0.39, 0.4, 0.392, 0.3, 0.2, 0.1, 0.0)
"""Between control points of the angle: it turns most quickly near the middle of the middle span [rad]."""


@pytest.fixture(scope="module")
def turning(base):
    """A plan of one cell in which the team turns about the object's origin.

    Returns:
        The plan; its problem, whose other limits are wide; the largest acceleration of a base at quarters of
        spans and that at all times, r sqrt(w^4 + w'^2) with the rate w of the angle [m/s^2].
    """
    plan, problem = base
    angles = plan.start[2] + np.cumsum([0.0, 0.0, *STEPS, 0.0, 0.0])
    points = np.tile(plan.start, (len(angles), 1))
    points[:, 2] = angles
    period, wide = 0.8, np.full(plan.start.size - 2, 20.0)
    end = replace(plan.transitions[-1], goal_lower=-wide, goal_upper=wide)
    windows = np.array([[0.0, period * (len(points) - 3)]])
    still = {"windows": windows, "rates": np.zeros(1), "start_rate": 0.1}
    motion = replace(plan.motion, points=points, period=period, **still)
    cells = (replace(plan.cells[0], lower=-wide, upper=wide, tidied=shapely.box(-99.0, -99.0, 99.0, 99.0)),)
    made = replace(plan, cells=cells, transitions=(end,), goal_pose=points[-1, :3], motion=motion)
    (origin, *bases), _ = places(problem, points[:1])
    radius = max(float(np.linalg.norm(one - origin)) for one in bases)
    fast = replace(problem.limits, base_speeds=np.full(2, 9.0), turn_accelerations=np.full(2, 9.0))
    hardest = []
    for parts in (4, 40000):
        times = np.linspace(0.0, motion.duration, parts * (len(points) - 3) + 1)[:-1]
        rate, turning = spline(motion)(times, 1)[:, 2], spline(motion)(times, 2)[:, 2]
        hardest.append(radius * float(np.hypot(rate**2, turning).max()))
    return made, replace(problem, limits=fast), *hardest


def test_an_acceleration_that_is_exceeded_for_a_moment_only_is_refused(turning):
    """The bound on what curves it is needed: it is exceeded neither at knots nor at quarters of spans."""
    plan, problem, at_quarters, largest = turning
    assert largest > at_quarters * (1.0 + 1e-5)
    checked(plan, with_limit(problem, "base_accelerations", largest * (1.0 + 1e-7)))
    for limit in (at_quarters * (1.0 + 1e-6), largest * (1.0 - 1e-6)):
        message = refused(plan, with_limit(problem, "base_accelerations", limit))
        assert re.match(r"motion\.points\[[6-9]\]: at .* base \d is accelerated by", message), message


def test_a_plan_of_one_cell_needs_no_stop(turning):
    plan, problem, _, _ = turning
    assert [check.count for check in check_motion(plan, problem, GAINS)][:2] == [2, 0]


# The bound between two times.


@given(trees(), st.integers(0, 2**32 - 1))
def test_what_curves_velocities_and_accelerations_is_bounded(tree, seed):
    """By differences of the accelerations of cubic motions, at many times in a step."""
    random, axes = np.random.default_rng(seed), 3 + len(tree.joints)
    component, point = int(random.integers(len(tree.components))), tuple(random.normal(size=2))
    points = (0.7, component_stages(tree, component), point), (0.3, component_stages(tree, 0), (0.2, 0.1))
    mover = _Mover("base", "m", 1.0, 1.0, None, np.inf, points)
    c = random.normal(size=(4, axes)) * random.choice([0.1, 1.0, 3.0], size=(4, 1))
    e, t = 1e-3, np.linspace(0.0, 0.1, 50)

    def rates(t):
        t = t[:, None]
        z, v = c[0] + c[1] * t + c[2] * t**2 + c[3] * t**3, c[1] + 2.0 * c[2] * t + 3.0 * c[3] * t**2
        return z, v, 2.0 * c[2] + 6.0 * c[3] * t, np.tile(6.0 * c[3], (len(t), 1))

    found = [mover.rates(*rates(t + shift)[:3]) for shift in (-e, 0.0, e)]
    bounds = mover.curving(*(np.abs(one) for one in rates(t)))
    for before, now, after, bound in zip(*found, bounds, strict=True):
        curved = np.linalg.norm(after - 2.0 * now + before, axis=1) / e**2
        assert (curved <= bound * (1.0 + 1e-3) + 1e-3).all()


# Random alterations.


def random_changes(motion, random, number):
    """One of seven kinds of change, of a size between a millionth and a tenth."""
    size, count = 10.0 ** random.uniform(-6.0, -1.0), len(motion.points)
    cell = int(random.integers(len(motion.windows)))
    kind = number % 7
    if kind == 0:
        row, column = random.integers(3, count - 3), random.integers(motion.points.shape[1])
        return moved_points(motion, row, column, random.normal() * size)
    if kind == 1:
        waves = np.sin(np.arange(count - 6.0) * random.uniform(0.1, 3.0))
        return moved_points(motion, slice(3, -3), slice(None), size * waves[:, None])
    if kind == 2:
        return moved_window(motion, cell, random.integers(2), random.choice(motion.windows.ravel()))
    if kind == 3:
        return moved_window(motion, cell, 1, motion.windows[cell, 1] + size)
    if kind == 4:
        return other_rate(motion, cell, motion.rates[cell] * (1.0 + 10.0 * size))
    if kind == 5:
        return stretched(motion, 1.0 - random.choice([-1.0, 1.0]) * size, stops=True)
    return {"waiting": motion.waiting * (1.0 - size), "ramp": motion.ramp * (1.0 - size)}


def test_random_alterations_are_accepted_only_if_samples_keep_cells_and_limits(either):
    plan, problem = either
    random, accepted, count, worst = np.random.default_rng(8), 0, 49, -1.0
    for number in range(count):
        changes = random_changes(plan.motion, random, number)
        where = refusal(plan, problem, **changes)
        if not where:
            accepted += 1
            outside, share = sampled(plan, problem, replace(plan.motion, **changes), 1000)
            worst = max(worst, outside, share - 1.0 - 2e-3)  # differences see jerk that jumps at a knot
        assert where.startswith("motion.") or not where
    assert worst <= 0.0
    assert 0.2 * count < accepted < 0.9 * count


# Plans, their files and what is said of them.


def test_motions_of_ways_and_with_unknown_bases_are_refused(base):
    plan, problem = base
    of_way = replace(plan, refused_by=("a limit",))
    for altered, asked in ((of_way, problem), (plan, replace(problem, limits=TeamLimits()))):
        with pytest.raises(RefusalError) as error:
            check_motion(altered, asked, GAINS)
        assert error.value.where == "motion"
    assert check_motion(replace(plan, motion=None), problem, GAINS) == []


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A plan with a motion in an open room, as a file, its question, and what was verified."""
    scenario = passing(small_scenario())
    answer, problem = make(scenario), planning_problem(scenario)
    assert isinstance(answer, Found)
    path = save_plan(answer.plan, tmp_path_factory.mktemp("small") / "plan.json")
    return json.loads(path.read_text()), problem, scenario.gain_sets, answer.plan


def test_a_plan_with_a_motion_is_verified_and_says_what_is_proved(base):
    plan, problem = base
    gains = {plan.gain_set: GAINS}
    verified = verify_plan(plan, problem, gains)
    names = [check.name for check in check_motion(plan, problem, GAINS)]
    assert len(names) == 5
    assert set(names) <= {check.name for check in verified.checks}
    assert "the motion leads from start to goal" in verified.proved
    assert verified.not_proved.startswith(
        "that a team stays in the cells (verify the log of its run, or plan"
    )
    unlimited = replace(problem, limits=TeamLimits())
    at_rest = replace(timed(plan), motion=None, problem=problem_digest(unlimited))
    at_rest = verify_plan(at_rest, unlimited, gains)
    assert at_rest.proved.endswith("in any state of the cells, which lead from start to goal")
    assert not any("motion" in check.name for check in at_rest.checks)
    assert "motion" not in at_rest.proved + at_rest.not_proved


@pytest.mark.parametrize(
    ("where", "change"),
    [
        ("transitions[3].estimated_time", {"estimated_time": 0.7}),
        ("transitions[3].gains.speed_limit", {"speed_limit": 1.0}),
        ("transitions[3].gains.rate_limit", {"rate_limit": np.ones(3)}),
        ("transitions[3].gains.acceleration_limit", {"acceleration_limit": np.array([inf, 2.0, 2.0])}),
        ("age_factor", {}),
    ],
)
def test_times_are_those_of_the_motion_which_alone_keeps_limits(base, where, change):
    plan, problem = base
    steps = list(plan.transitions)
    if ".gains." in where:
        change = {"gains": replace(steps[3].gains, **change)}
    steps[3] = replace(steps[3], **change)
    altered = replace(plan, transitions=tuple(steps), age_factor=1.5 if where == "age_factor" else 1.0)
    check = partial(check_limits, gain_set=GAINS) if "time" in where else check_speeds
    with pytest.raises(RefusalError) as error:
        check(altered, problem)
    assert error.value.where == where
    check(plan, problem)


def test_a_file_with_a_motion_through_one_cell_is_verified(small, tmp_path):
    document, problem, gains, plan = small
    assert len(plan.cells) == 1
    verify_file(write(document, tmp_path / "plan.json", signed=False), problem, gains)


@pytest.mark.parametrize(
    ("way", "value"),
    [
        (("points", 4, 1), float("nan")),
        (("points", 4), [1.0]),
        (("points", 0), [1.0, 2.0]),
        (("points",), []),
        (("period",), float("inf")),
        (("period",), 0.0),
        (("windows", 0, 0), float("nan")),
        (("windows", 0), [0.0]),
        (("windows",), [[0.0, 1.0]] * 50),
        (("rates", 0), None),
        (("rates",), []),
        (("waiting",), -0.1),
        (("ramp",), 0.0),
    ],
)
def test_what_is_no_motion_is_refused_when_it_is_read(small, tmp_path, way, value):
    document, problem, gains, _ = small
    path = write(changed(document, ("motion", *way), value), tmp_path / "plan.json", signed=False)
    with pytest.raises(PlanError, match=rf"motion\.{way[0]}"):
        verify_file(path, problem, gains)
