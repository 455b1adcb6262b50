"""How far a team may depart from the motion that it follows, under a budget.

A channel is an axis x of (theta, q...), or the object's position, of which as a vector the length counts.
With e = x - x^ its departure from the motion, robots command at sample k, by measurements that are m periods
old,

    u_k = x^'' - K_t (e_(k-m) + n_x) - zeta_t (e'_(k-m) + n_v),

where x^'' is that of the time T/2 + lag later, at which the command acts on average. It is held for a period
T and followed with the lag of the actuators. With the pull q = u - x^'', which acts with the same lag, and
the factor 1 + epsilon by which the model makes accelerations too large,

    e'' = f q + d,  |d| <= (|f - 1| + r) (|x^''| + c(w^)) + c(w^ + w) - c(w^) + r |q| + a,

where f is the middle of a part of the range of 1 + epsilon and r half its length, c(w) the largest
acceleration that rates w of the axes alone cause, w^ the nominal rates, w their departures, and a all else:
the error that the budget states, friction of joints, and what ``_mistimed`` says.

Robots compute what balances c(w^), which leaves c(w^ + w) - c(w^). In w only e'_1 counts, the rates that all
the other disturbances cause: neither what noise adds, whose sign changes, nor what this term itself does.

The loop e'' = f q is linear and does not vary in time. So |e| is at most the sum over all samples of its
responses' magnitudes, times the largest size of what enters: K_t n_x + zeta_t n_v in every period, and d.
Of what enters, r |q| depends on the departures: a plan states a |q| that reproduces itself. If it has not
been larger until now, it is not at the next sample.

**Clocks** are wrong by at most eps. Pose and joints have stamps of their own. A robot compares what it
measured with the motion at the stamp; those of the pose are of one time for all robots, those of its own
joints are by its own clock. So n_x of a joint is larger by eps |x^'|, and n_v by eps |x^''|. An age that is
wrong by s = 2 eps makes n_x of all channels larger by s |e'_1|, and n_v by s |e''_1|.
"""

from __future__ import annotations

from math import exp, inf
from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import Budget, Departures
from coop_drake.answers.motion import Gains, Motion, TeamGains
from coop_drake.answers.problem import PlanningProblem, TeamLimits
from coop_drake.jit import compiled
from coop_drake.laws.measurements import whole_periods
from coop_drake.robustness.couplings import Couplings, Efforts
from coop_drake.tree import ComponentTree
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import point_levers, turn_levers

MODEL_PARTS = 20
"""Parts into which the range of the model's error is cut [-]; within each only r is a disturbance."""

HORIZON = 8.0
"""Longest time for which responses are summed [s]."""

LEFT = 1e-9
"""Responses to a unit of what enters are followed until they are below this [-]; a loop in which they stay
above it for ``HORIZON`` is refused."""

SLACK = 1e-3
"""Fraction by which stated bounds are wider than computed ones [-]: more than the responses after
``HORIZON`` and another way to round need."""

ATTEMPTS, GROWTH = 40, 1.01
"""Largest number of larger and larger pulls that are tried, and by which factor each is larger [-]."""


LARGEST_PULL = 1e6
"""No team that pulls harder is followed further [m/s^2, rad/s^2]."""

CALMING = 3
"""How often the pulls of a team whose motion has ended are bounded anew by what they cause themselves [-]."""


class Moving(NamedTuple):
    """Bounds of a motion in every cell, at any pace, of the position, theta and q, shape (cells, 2 + n) each.

    Attributes:
        rate: Largest |x^'| [m/s, rad/s].
        acceleration: Largest |x^''|, in stops and starts, too.
        jerk: Largest |x^'''|, likewise.
    """

    rate: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def moving_of(motion: Motion) -> Moving:
    """Return the bounds of a motion: its derivatives lie in the hulls of differences of control points.

    In cell i, from tau_i to tau_(i+1), the team may make the stops of all cells j with
    tau_(j-1) + 2 W < tau_(i+1) and x_j > tau_i. With |rho'| <= k and |rho''| <= b, accelerations are at most
    |A - k V| or |A| or k |V|, and jerks |J| + 3 k |A| + b |V|; in a start k is alpha and b is 2 alpha^2.
    """
    h, points, spans = motion.period, motion.points, len(motion.points) - 3
    V, A, J = (np.diff(points, order, axis=0) / h**order for order in (1, 2, 3))
    begins = motion.windows[:, 0]
    ends, late = np.append(begins[1:], motion.duration), np.append(-np.inf, begins[:-1] + motion.waiting)
    rows = []
    for begin, end in zip(begins, ends, strict=True):
        first, last = int(begin / h), min(int(np.ceil(end / h)), spans)
        acts = (late < end) & (motion.windows[:, 1] > begin)
        kappa, alpha = float(motion.rates[acts].max()), motion.start_rate
        v, a, j = V[first : last + 2], A[first : last + 1], J[first:last]
        knots = 0.5 * (V[first : last + 1] + V[first + 1 : last + 2])
        fast, hard, rough = _largest(v), _largest(a), _largest(j)
        # Between knots A is linear, and V departs from its chord by at most h^2 |J| / 8.
        stopping = _largest(a - kappa * knots) + kappa * h * h / 8.0 * rough
        steady, onset = max(kappa, alpha), max(kappa / motion.ramp, 2.0 * alpha * alpha)
        pushed = np.maximum.reduce([hard, stopping, steady * fast])
        rows.append([fast, pushed, rough + 3.0 * steady * hard + onset * fast])
    return Moving(*np.array(rows).transpose(1, 0, 2))


def _largest(rows: FloatArray) -> FloatArray:
    """Return the largest length of (x, y), and magnitudes of the other columns."""
    return np.append(np.hypot(rows[:, 0], rows[:, 1]).max(), np.abs(rows[:, 2:]).max(axis=0))


@compiled
def loop_sums(
    gains: tuple[float, float], times: tuple[float, float, float], factor: float, delay: int, samples: int
) -> FloatArray:
    """Return sums of responses, shape (5, 3), infinite where one does not end.

    Rows: of e, e', q, e + t e', and q after the lag. Columns: the sum of the magnitudes to a unit of command
    in each period, to a unit of acceleration w, and the root of the sum of the squares to commands. Within a
    period, w acts on the sample after it by (T - t) on e and by 1 on e'; |h_e (T - t) + h_v| is convex in t,
    so that its chord is above it.

    Args:
        gains: K_t and zeta_t.
        times: T, the time constant of the actuators, and t [s].
        factor: f [-].
        delay: m.
        samples: Largest number of samples.
    """
    (stiffness, damping), (T, lag, ahead) = gains, times
    # The acceleration a follows a command u with the lag: what a period leaves of a - u in a, x' and x.
    left = exp(-T / lag) if lag > 0.0 else 0.0
    in_v, in_x = lag * (1.0 - left), lag * T - lag * lag * (1.0 - left)
    # The runs: a unit of command, of e and of e'. A ring holds e and e' of the last m samples.
    e, v, s, sums = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((5, 3))
    past, q, quiet = np.zeros((delay + 1, 2, 3)), np.zeros(3), 0
    e[1] = v[2] = 1.0
    for k in range(samples):
        largest = 0.0
        for run in range(3):
            past[k % (delay + 1), 0, run], past[k % (delay + 1), 1, run] = e[run], v[run]
            old = past[(k + 1) % (delay + 1), :, run]
            q[run] = -stiffness * old[0] - damping * old[1] if k >= delay else 0.0
        for i in range(5):
            h = e if i == 0 else v if i == 1 else q if i == 2 else s
            a, b, c = h[0], h[1], h[2]
            if i == 3:
                a, b, c = e[0] + ahead * v[0], e[1] + ahead * v[1], e[2] + ahead * v[2]
            sums[i, 0] += abs(a)
            sums[i, 1] += 0.5 * T * (abs(b * T + c) + abs(c))
            sums[i, 2] += a * a
        for run in range(3):
            u = q[run] + (1.0 if run == 0 and k == 0 else 0.0)
            gap = s[run] - u
            e[run] += T * v[run] + factor * (0.5 * T * T * u + in_x * gap)
            v[run] += factor * (T * u + in_v * gap)
            s[run] = u + left * gap
            largest = max(largest, abs(e[run]) + abs(v[run]))
        quiet = quiet + 1 if largest < LEFT else 0
        if quiet > delay + 1:
            sums[:, 2] = np.sqrt(sums[:, 2])
            return sums
    return np.full((5, 3), np.inf)


class Loop(NamedTuple):
    """The loops of all channels under a budget.

    Attributes:
        budget: The budget.
        gains: K_t and zeta_t of every channel, shape (2, 2 + n).
        sums: See ``loop_sums``, of every part of the model's range, shape (parts, 5, 3, 2 + n).
    """

    budget: Budget
    gains: FloatArray
    sums: FloatArray


def model_parts(budget: Budget) -> tuple[FloatArray, float]:
    """Return f of every part of the model's range, and r [-]."""
    parts = MODEL_PARTS if budget.model_error > 0.0 else 1
    middles = (2.0 * np.arange(parts) + 1.0) / parts - 1.0
    return 1.0 + budget.model_error * middles, budget.model_error / parts


def unknown_time(budget: Budget) -> float:
    """Return t, how long it takes until a robot knows of a departure [s]: the age of measurements, and T."""
    return (whole_periods(budget.delay, budget.period) + 1) * budget.period + budget.age_error


def gain_sums(gains: Gains, budget: Budget) -> FloatArray | None:
    """Return ``loop_sums`` for every part of the model's range, (parts, 5, 3); None for an unstable loop."""
    T = budget.period
    times, periods = (T, budget.lag, unknown_time(budget)), whole_periods(HORIZON, T)
    delay, (factors, rest) = whole_periods(budget.delay, T), model_parts(budget)
    sums = np.array([loop_sums(gains, times, f, delay, periods) for f in factors.tolist()])
    good = np.isfinite(sums).all() and (rest * sums[:, 2, 1] < 1.0).all()
    return sums if good else None


def team_loop(gains: TeamGains, budget: Budget, axes: int) -> Loop | None:
    """Return the loops of position and axes, None where one is not stable for every error of the model.

    Args:
        gains: Those of the position, then those of the axes.
        budget: The departures to be tolerated.
        axes: Number of axes, 1 + n.
    """
    found = [gain_sums(each, budget) for each in gains]
    if found[0] is None or found[1] is None:
        return None
    channels = np.minimum(np.arange(1 + axes), 1)
    sums = np.stack([found[0], found[1]], axis=-1)
    return Loop(budget, np.array(gains).T[:, channels], sums[..., channels])


def noises(budget: Budget, moving: Moving) -> FloatArray:
    """Return n_x and n_v of the mean of all robots but for wrong ages, of every channel, (2, 2 + n)."""
    found = np.zeros((2, moving.rate.shape[1]))
    found[:, 0] = budget.position_noise, budget.velocity_noise
    if budget.axes:
        found[:, 1:] = np.array([[budget.angle_noise], [budget.rate_noise]])
        found[0, 2:] += budget.clock_error * moving.rate[:, 2:].max(axis=0)
        found[1, 2:] += budget.clock_error * moving.acceleration[:, 2:].max(axis=0)
    return found


def departures_after(
    loop: Loop, moving: Moving, couplings: Couplings, pulled: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return bounds of departures at the next samples, if pulls until now are within others.

    Args:
        loop: The loops.
        moving: Bounds of the motion.
        couplings: Those of the plan's cells.
        pulled: Largest |q| until now, shape (2 + n,).

    Returns:
        Largest |e|, |e'|, |e''|, |q|, |e + t e'| and d, shape (6, 2 + n); |e'_1| and |e''_1|, (2, 2 + n); and
        of e' and e'' what noise rarely exceeds, if it is random from sample to sample, and what the budget
        states are three standard deviations of it, (2, 2 + n).
    """
    budget, T, (factors, rest) = loop.budget, loop.budget.period, model_parts(loop.budget)
    wrong_model = 1.0 + budget.model_error

    def turning(w: FloatArray) -> FloatArray:
        """Return c(w) in every cell, w of shape (cells, axes)."""
        found: FloatArray = np.einsum("cj,cijk,ck->ci", w, couplings.rates, w)
        return found

    nominal = turning(moving.rate[:, 1:])
    friction = budget.joint_coulomb + budget.joint_viscous * moving.rate[:, 2:]
    others = np.einsum("cij,cj->ci", couplings.efforts, friction)
    others += wrong_model * _mistimed(budget, moving, couplings) + rest * pulled
    others[:, 0] += budget.acceleration_error
    others[:, 1:] += budget.axis_acceleration_error if budget.axes else 0.0
    own = (np.abs(factors - 1.0) + rest)[:, None, None] * (moving.acceleration + nominal) + others
    driven = own.max(axis=1)[:, None] * loop.sums[:, :, 1]  # (parts, 5, 2 + n)
    push = wrong_model * driven[:, 2] + own.max(axis=1)
    first = np.stack([driven[:, 1] + T * push, push]).max(axis=1)
    entered = (own + turning(moving.rate[:, 1:] + first[0, 1:]) - nominal).max(axis=1)  # (parts, 2 + n)
    noise = (loop.gains * (noises(budget, moving) + budget.age_error * first)).sum(axis=0)
    caused = noise * loop.sums[:, :, 0] + entered[:, None] * loop.sums[:, :, 1]
    caused[:, 2] += noise
    push = wrong_model * caused[:, 2] + entered
    # Between samples, e departs from its chord by at most T^2 |e''| / 8, and e' by T |e''|.
    found = [caused[:, 0] + 0.125 * T * T * push, caused[:, 1] + T * push, push]
    random = wrong_model * noise * loop.sums[:, [1, 4], 2].max(axis=0)
    return np.stack([*found, caused[:, 2], caused[:, 3], entered]).max(axis=1), first, random


def _mistimed(budget: Budget, moving: Moving, couplings: Couplings) -> FloatArray:
    """Return by how much commands differ from what the motion needs where they act, shape (cells, 2 + n).

    A command for T/2 + lag ahead acts, in the mean over its period, at a time that differs from this by
    2 lag / exp(1) in the mean, by the exponential distribution of a lag, and by eps. Within its period it
    does not change, and is half a period away at most. In this time nominal accelerations change by their
    jerk, and what rates cause by accelerations. Stops are known earlier.
    """
    time = 2.0 * exp(-1.0) * budget.lag + budget.clock_error + 0.5 * budget.period
    w, a, rates = moving.rate[:, 1:], moving.acceleration[:, 1:], couplings.rates
    turning = np.einsum("cj,cijk,ck->ci", a, rates, w) + np.einsum("cj,cijk,ck->ci", w, rates, a)
    found: FloatArray = time * (moving.jerk + turning)
    return found


def departures_of(
    gains: TeamGains, budget: Budget, moving: Moving, couplings: Couplings
) -> Departures | None:
    """Return the least departures that reproduce themselves, and what follows from them; None for none.

    Args:
        gains: Those of the position, then those of the axes.
        budget: The departures to be tolerated.
        moving: Bounds of the motion.
        couplings: Those of the plan's cells.
    """
    channels = moving.rate.shape[1]
    loop, pulled = team_loop(gains, budget, channels - 1), np.zeros(channels)
    if loop is None:
        return None
    for _ in range(ATTEMPTS):
        again = departures_after(loop, moving, couplings, pulled)[0][3]
        if (again <= pulled).all():
            return stated_departures(loop, moving, couplings, (1.0 + SLACK) * pulled)
        pulled = np.maximum(pulled, GROWTH * again)
        if not pulled.max() < LARGEST_PULL:
            return None
    return None


def stated_departures(loop: Loop, moving: Moving, couplings: Couplings, pulled: FloatArray) -> Departures:
    """Return what a plan states: departures, the levels of monitors, and the room that they need.

    A robot judges what it measured itself, by its own motion. While no robot measures more than its levels a
    of |e| and b of |e + t e'|, the team is off its motion by at most a + n, and by b + n + t n_v a time t
    later; between, on the way from the one to the other, and off that by what enters meanwhile, at most
    d t^2 / 2: the pull is not counted, for it draws back what it sees.

    Args:
        loop: The loops.
        moving: Bounds of the motion.
        couplings: Those of the plan's cells.
        pulled: A |q| that reproduces itself, shape (2 + n,).
    """
    budget = loop.budget
    found, first, random = departures_after(loop, moving, couplings, pulled)
    still = Moving(*(np.zeros(part.shape) for part in moving))
    calm = pulled
    for _ in range(CALMING):
        calm = departures_after(loop, still, couplings, calm)[0][3]
    rest = departures_after(loop, still, couplings, calm)[0][0]
    t, wide, noise = unknown_time(budget), 1.0 + SLACK, noises(budget, moving)
    wrong = noise + budget.age_error * first
    own = wrong.copy()
    own[:, :2] += (budget.single_noise - 1.0) * noise[:, :2]  # each robot measures its own joints
    position, fast, pushed, _, ahead, entered = wide * found
    alarm, ahead_alarm = position + own[0], ahead + own[0] + t * own[1]
    room = np.maximum(alarm + wrong[0], ahead_alarm + wrong[0] + t * wrong[1]) + 0.5 * entered * t * t
    return Departures(
        pulled,
        position,
        fast,
        pushed,
        ahead,
        wide * rest,
        alarm,
        fast + own[1],
        ahead_alarm,
        room,
        *(wide * random),
    )


def allowed_departures(motion: Motion, budget: Budget, stated: Departures) -> FloatArray:
    """Return how far a team may be off the mean of its robots' motions, and so for rates, shape (2, 2 + n).

    Departures are stated from the motion by a clock without error. By their own clocks, robots are further
    along it or less far, and so is their mean: by eps |x^'|, which is to be added where the team moves, and
    by what accelerations add to that and to rates, which is counted here.

    Args:
        motion: The motion.
        budget: The budget.
        stated: What a plan states.
    """
    eps, hardest = budget.clock_error, moving_of(motion).acceleration.max(axis=0)
    return np.array([stated.position + eps * eps * hardest, stated.rate + eps * hardest])


def goal_tolerances(problem: PlanningProblem) -> FloatArray:
    """Return by how much the team may be off its goal, infinite where it is free, shape (2 + n,) [m, rad]."""
    wanted = np.array([goal is not None for goal in problem.goal_joints], bool)
    joints = np.where(wanted, np.broadcast_to(problem.joint_tolerance, wanted.shape), inf)
    return np.array([problem.position_tolerance, problem.angle_tolerance, *joints])


def speed_departures(tree: ComponentTree, limits: TeamLimits, away: Departures) -> FloatArray:
    """Return what noise rarely adds to speeds: of bases, their angles and the joints, shape (2 N + n,).

    Noises of different channels are independent of each other; a base is moved by each at its lever.

    Args:
        tree: The team.
        limits: Has the bases.
        away: How far the team departs.
    """
    rate, speeds, turns = away.usual_rate, [], []
    for component, point in zip(limits.base_components, limits.base_points, strict=True):
        speeds.append(
            np.hypot(rate[0], np.linalg.norm(np.array(point_levers(tree, component, point)) * rate[1:]))
        )
        turns.append(np.linalg.norm(np.array(turn_levers(tree, component)) * rate[1:]))
    return np.array([*speeds, *turns, *rate[2:]])


def largest_efforts(
    budget: Budget, gains: TeamGains, efforts: Efforts, moving: Moving, away: Departures
) -> FloatArray:
    """Return the largest efforts that robots are told to give, as ``Efforts`` lists them [N, N m].

    Args:
        budget: The budget.
        gains: Those of the position, then those of the axes.
        efforts: What efforts accelerations and rates take in every cell.
        moving: Bounds of the motion.
        away: How far the team departs from it.
    """
    single = np.zeros(moving.rate.shape[1])  # by how much the noise of one robot exceeds the mean's
    own = (np.array(gains).T * noises(budget, moving)[:, :2]).sum(axis=0)
    single[:2] = (budget.single_noise - 1.0) * own
    commands, rates = moving.acceleration + away.pull + single, moving.rate[:, 1:]
    rates = rates + budget.ahead * moving.acceleration[:, 1:]
    turning = np.einsum("cj,cejk,ck->ce", rates, efforts.rates, rates)
    pushed = commands[:, :1] * efforts.push + np.einsum("cej,cj->ce", efforts.axes, commands[:, 1:])
    found: FloatArray = (1.0 + budget.model_error) * (pushed + turning) + rates @ efforts.damping.T
    largest: FloatArray = found.max(axis=0)
    return largest
