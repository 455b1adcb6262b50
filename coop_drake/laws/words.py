"""The words of a team that does not stop at every cell, and what robots and supervisor do on hearing them.

A plan has one nominal motion X(sigma) through its cells 0, 1, ..., the same for all robots; sigma is the
phase [s]. Every robot runs along it by its own clock. Words are late by at most the delay, repeats included,
clocks are wrong by at most eps, and everybody listens and speaks once in a period T. What an event of one
robot tells it to say is used by all others before

W = delay + 2 eps + 2 T

have passed on anybody's clock. This module is the only implementation: blocks, the compiled loop and
processes carry rows of numbers and call ``hear``, ``robot_step`` and ``supervisor_step``.

**The schedule.** The motion enters cell i at e_i and leaves it at x_i; cells i and i + 1 overlap from
e_(i+1) to x_i. Cell i is begun at tau_i >= e_i. A stop may begin at any phase up to the brake phase
beta_i >= tau_i + 2 W and ends by x_i. A robot may be in the cells 0 ... P, where P - 1 is the least of the
cells that all robots have begun, as far as it has heard.

**Starting.** With w = t - t_0 the phase is sigma = S(w), the pace rho = S'(w), alpha being the start's rate:

S(w) = sigma_0 + w - tanh(alpha w) / alpha,  S' = tanh^2(alpha w),  S'' = 2 alpha tanh (1 - tanh^2)

Because 2 sqrt(rho) <= 1 + rho, rho' <= alpha (1 - rho^2). Accelerations are rho^2 A + rho' V with A = X'' and
V = X', forces likewise. If a convex set of what is allowed contains 0, A and alpha V, it therefore contains
them during the whole start, wherever it begins. The start costs 1 / alpha and never quite ends; after
20 / alpha the pace is 1 to the last bit. At phase 0 V and A are zero, so that S(w) = w, with pace 1 at once:
such a start costs nothing.

**Braking** goes on in w, whose rate p falls from 1 to 0 in the time 2 h, symmetrically: p' falls to -k within
the ramp r and rises to 0 within r, k = 1 / (2 h - r); a stop shorter than 2 r has ramps of h. Half of its
time is its way: w grows by h, sigma by at most h. At full pace h = x_i - beta_i and k = kappa_i; a stop that
begins during the start at w_b is as short as k S'(w_b + h) <= kappa_i lets it be. So a stop that begins at
beta_i or before, with any pace, ends by x_i. With rho = S' p and rho' = S'' p^2 + S' p',

-kappa_i <= rho' <= alpha (1 - rho^2),

also where a stop begins during the start. Pace and acceleration are continuous. A stop stands in the robot's
motion as soon as the robot knows that it begins within W, so that times ahead of a sample have their phase,
too. It is enough that the plan
states for the phases from beta_(i-1) to x_i that A, -kappa_i V and A - kappa_i V are allowed, and for all
phases that alpha V and -alpha V are. In the last cell no stop begins after the last brake phase: the motion
itself ends.

**Words.** Everybody says all its words anew in every period, as one row: epoch, plan, stamp, kind, cell
begun, hold, phase, time, fit. In an epoch the kind only advances, the cell only grows and the hold only
falls. So a row that was heard makes all earlier ones superfluous; loss, repetition and order do not matter,
and no receipt is needed. Who hears of a cell begun after a hold was said hears of the hold, too. Everybody
also passes holds on: the smallest one that it has heard in its epoch is its own.

**Rules of a robot.**
1. It has begun cell i when sigma >= tau_i and its monitor is quiet. That says where it is, never where it
   may go, and is never withdrawn.
2. At rest, a start of a new epoch is either taken, which counts as heard, or refused for ever. It is taken
   if the monitor is quiet, sigma_0 lies between its own phase and x_P, and there is time. A robot that rests
   behind creeps to sigma_0, from rest to rest, until t_0 - 2 W. Of an epoch in which others rest already, it
   takes no start.
3. Who lacks a word that lets it pass the phase b says Hold(b), W before it is there: for b = beta_P if cell P
   has not been begun by all, for b = sigma_0 if not all have taken the start.
4. Its monitor asks for a hold at the next brake phase that it reaches in W or later; a departure that grows,
   at the phase that it reaches in W; above the second threshold, without samples, or when its drives'
   watchdog has run out: at once by all drives, Hold(-infinity), which ends in rest where it is. A stamp that
   is ahead by more than 2 eps is an alarm of the first kind. A robot of which nothing newer than W has been
   heard is one of the second kind: a hold may have been missed. Inside the delay that cannot be, since words
   are never older than W - T.
5. The smallest hold wins. At its phase everybody brakes, or at once where that has passed; never back to run.
   Before t_0 a hold at sigma_0 or less calls the start off.
6. It rests where the stop or the motion ends, and says so. One that measures there that it is at the goal
says that it is fit by 2 instead of 1.

At a sample at k T a robot hears what others said at samples before k T (at (k - 1) T, where words are not
late), decides by what its monitor said at the sample before, measures, commands, and says its row.

**Rules of the supervisor,** the only author of starts: when all rest in the same epoch, are fit, and sigma_0,
the largest of their phases, is at most x_(c+1), c being the least cell begun, it says the start of the next
epoch at t_0 = now + C + 3 W, C being the longest time to creep. The team has arrived when all rest at the
motion's end and measure that they are at the goal. A supervisor that was started again during a run skips an
epoch, which its predecessor may have used.

**What is guaranteed.**
- Inside delay and eps: |sigma_j - sigma_k| <= 2 eps at every moment, since all run S of the same numbers,
  brake at the same phase, and S' p <= 1. One cell holds all of them, since x_i - e_(i+1) >= 2 eps. They rest
  at the same phase to the last bit. No hold is said but those that monitors or people ask for.
- Whatever is late or lost for ever: sigma_k <= x_P of each robot, and P <= 1 + the least cell begun. So all
  phases lie between tau_c and x_(c+1). Nobody runs unless all have taken the start.
- Whatever is late or lost, and whoever dies: of an epoch's holds let that at b be reached first, at c. It was
  said before c - W + T. By c + 2 T everybody has heard it, or else nothing new of the one who said it for W,
  and brakes by itself before c + W + 2 T. So all that live begin to brake within W + 2 T by their clocks;
  after a hold of all drives, within 2 W + 2 T. Meanwhile their phases differ by at most that and 2 eps; where
  they rest, by the difference of their ways h more. In the last cell, who is past its brake phase goes on to
  the end of the motion.
- Rest is said for ever, so once words arrive again, and nobody is dead, all rest in one epoch, and a start
  follows unless a monitor or a person objects. A start that is called off leaves all at rest in its epoch.

A new plan that is entered on the way has its place in the column PLAN: words of other plans are not heard.
"""

from __future__ import annotations

from math import inf, sqrt, tanh
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray

EPOCH, PLAN, STAMP, KIND, CELL, HOLD, PHASE, TIME, FIT = range(9)
"""Columns of words: number of the start that they belong to, number of the plan, when they were said by the
sender's clock [s], what the sender does, the cell that it has begun, where the team shall brake [s], where
the sender rests [s], nothing, and 0 for an alarm, 1 for none, 2 for none at the goal. Of the supervisor CELL
has been begun by all, PHASE is sigma_0 and TIME t_0 [s]."""

WORD_SIZE = 9
"""Number of columns of words."""

START, ARMED, RUN, BRAKE, REST = range(5)
"""Kinds of words: the supervisor's, and what a robot does, in the order in which it does them in an epoch."""

THERE, QUIET, ASKS, GROWS, BRAKES = range(-1, 4)
"""What a robot's monitor says: that the robot is at the goal, nothing, that the team be held, soon, or by all
drives at once."""

GOES, WAITS, DEPARTS, HELD, ARRIVED = range(5)
"""What the supervisor sees: the team is under way or about to start, or a robot is not yet at the goal where
the motion has ended; it waits for a robot's words; a robot's monitor keeps it from starting; a person does;
it has arrived."""

ORIGIN, FIRST, BEGIN, CREEP, BRAKE_AT, WAY, END, LAST = range(8)
"""Columns of a robot's motion: where it rests or rested [s], sigma_0 [s], t_0, infinite at rest [s], how long
it creeps [s], w where it brakes, infinite where it does not [s], h and x_i of the stop [s], and w of the last
sample in which it ran [s]."""

MOTION_SIZE = 8
"""Number of columns of a robot's motion."""

WORD_PERIOD, CLOCK_ERROR = 0.005, 0.002
"""T of a team that is not sampled, and eps of all teams [s]."""

UNKNOWN = -1.0
"""Epoch of a supervisor that was started again during a run."""

ROUNDING = 1e-9
"""By how much stamps may be ahead of what clocks allow, and a hold too late [s]: sums of times round."""

SHORTENING = 10
"""Steps in which a stop during a start is made shorter [-]; each way that they give is long enough."""


class Schedule(NamedTuple):
    """What a plan states of its nominal motion, for M cells, and what is assumed of words and clocks.

    Attributes:
        plan: Number of the plan.
        entries: e_i, where the motion enters every cell, shape (M,) [s].
        begins: tau_i, where every cell is begun, shape (M,) [s].
        brakes: beta_i, the last phase at which a stop may begin, shape (M,) [s]. In the last cell it may be
            that of the cell before: then none begins there.
        ends: x_i, where the motion leaves every cell, the last one its duration, shape (M,) [s].
        ramp: r, in which rho' reaches its largest value [s].
        start_rate: alpha [1/s].
        period: T [s].
        clock_error: eps [s].
        window: W [s].
    """

    plan: float
    entries: FloatArray
    begins: FloatArray
    brakes: FloatArray
    ends: FloatArray
    ramp: float
    start_rate: float
    period: float
    clock_error: float
    window: float


def schedule_of(
    entries: FloatArray, begins: FloatArray, brakes: FloatArray, ends: FloatArray, *, ramp: float,
    start_rate: float, period: float, delay: float, clock_error: float, plan: int = 0,
) -> Schedule:  # fmt: skip
    """Return a schedule.

    Args:
        entries: See ``Schedule``, as all arguments.
        begins: tau_i.
        brakes: beta_i of all cells, or of all but the last one.
        ends: x_i.
        ramp: r.
        start_rate: alpha.
        period: T.
        delay: Largest age of a word when it arrives, repeats included [s].
        clock_error: eps.
        plan: Number of the plan.

    Raises:
        ValueError: The motion does not keep what the guarantees need; says in which cell.
    """
    entries, begins, brakes, ends = (np.array(each, float) for each in (entries, begins, brakes, ends))
    cells, window = len(ends), delay + 2.0 * clock_error + 2.0 * period
    if len(brakes) == cells - 1:
        brakes = np.append(brakes, brakes[-1] if cells > 1 else -inf)
    if not cells == len(entries) == len(begins) == len(brakes) or cells == 0:
        raise ValueError("a schedule needs entry, begin, brake phase and end of every cell")
    if not (ramp > 0.0 and start_rate > 0.0 and period > 0.0 and delay >= 0.0 and clock_error >= 0.0):
        raise ValueError("ramp, start rate and period must be positive, delay and clock error not negative")
    if not entries[0] == begins[0] == 0.0:
        raise ValueError("cell 0 must be entered and begun at phase 0")
    for i in range(cells):
        last = i == cells - 1
        if not (entries[i] <= begins[i] < ends[i] and (last or begins[i + 1] <= ends[i])):
            raise ValueError(
                f"cell {i} must be begun after its entry, and be left after the next one is begun"
            )
        if not last and not begins[i] + 2.0 * window - ROUNDING <= brakes[i] < ends[i]:
            raise ValueError(
                f"the brake phase of cell {i} must be at least {2.0 * window:g} s after its begin, and "
                "before its end"
            )
        if not last and not ends[i] - entries[i + 1] >= 2.0 * clock_error - ROUNDING:
            raise ValueError(f"cells {i} and {i + 1} must overlap for at least {2.0 * clock_error:g} s")
        if last and not (brakes[i] < ends[i] and (i == 0 or brakes[i] >= brakes[i - 1])):
            raise ValueError(
                "the last brake phase must be before the motion's end, and not before the others"
            )
    if not (np.diff(entries) > 0.0).all() or not (np.diff(begins) > 0.0).all():
        raise ValueError("cells must be entered and begun one after the other")
    if not (np.diff(brakes[:-1]) > 0.0).all() or not (np.diff(ends) > 0.0).all():
        raise ValueError("brake phases and ends must grow from cell to cell")
    return Schedule(
        float(plan), entries, begins, brakes, ends, ramp, start_rate, period, clock_error, window
    )  # fmt: skip


def first_words(schedule: Schedule, robots: int, phase: float = 0.0, again: bool = False) -> FloatArray:
    """Return what everybody knows before the first word: all rest in epoch 0, none known to be fit.

    Args:
        schedule: The schedule.
        robots: Number of robots N.
        phase: Where they rest [s].
        again: Whether it is the supervisor, started again during a run: it knows nothing.

    Returns:
        Rows of all robots, then that of the supervisor, shape (N + 1, WORD_SIZE).
    """
    words = np.zeros((robots + 1, WORD_SIZE))
    words[:, PLAN], words[:, STAMP], words[:, KIND] = schedule.plan, -inf, REST
    words[:, HOLD], words[:, PHASE], words[robots, KIND], words[robots, TIME] = inf, phase, START, inf
    if again:
        words[:, EPOCH], words[:, KIND] = UNKNOWN, START
    return words


def first_motion(phase: float = 0.0) -> FloatArray:
    """Return the motion of a robot that rests at a phase [s], shape (MOTION_SIZE,)."""
    motion = np.zeros(MOTION_SIZE)
    motion[[ORIGIN, FIRST]], motion[[BEGIN, BRAKE_AT]] = phase, inf
    return motion


@compiled
def started(schedule: Schedule, first: float, w: float) -> tuple[float, float, float]:
    """Return S(w) [s], S' [-] and S'' [1/s], sigma_0 being ``first``; before the start those of rest."""
    if not w > 0.0:
        return first, 0.0, 0.0
    if not first > 0.0:
        return first + w, 1.0, 0.0
    alpha = schedule.start_rate
    s = tanh(alpha * w)
    return first + w - s / alpha, s * s, 2.0 * alpha * s * (1.0 - s * s)


@compiled(borrows=True)
def next_brake(schedule: Schedule, phase: float) -> int:
    """Return the first cell whose brake phase is not before a phase, M for none."""
    i = 0
    while i < schedule.brakes.size and schedule.brakes[i] < phase:
        i += 1
    return i


@compiled
def creep_time(schedule: Schedule, way: float) -> float:
    """Return how long a robot creeps along a way in phase [s].

    The phase is way (10 u^3 - 15 u^4 + 6 u^5). With this time C, rho <= 1.88 way / C < 0.47 and |rho'| <=
    5.78 way / C^2 < 0.73 alpha, so that rho^2 + |rho'| / alpha < 1, as at a start.
    """
    return max(4.0 * way, sqrt(8.0 * way / schedule.start_rate)) if way > 0.0 else 0.0


@compiled(borrows=True)
def phase_at(schedule: Schedule, motion: FloatArray, clock: float) -> tuple[float, float, float]:
    """Return the phase sigma [s], the pace rho [-] and its rate rho' [1/s] at a time.

    Args:
        schedule: The schedule.
        motion: The robot's motion, shape (MOTION_SIZE,).
        clock: What its clock shows, from the last sample on until W later [s].
    """
    first, w = motion[FIRST], clock - motion[BEGIN]
    if not w > 0.0:
        left, time, way = -w - 2.0 * schedule.window, motion[CREEP], first - motion[ORIGIN]
        if not left < time:
            return motion[ORIGIN], 0.0, 0.0
        if not left > 0.0:
            return first, 0.0, 0.0
        u = 1.0 - left / time
        v = u * (1.0 - u)
        phase = motion[ORIGIN] + way * u * u * u * (10.0 + u * (6.0 * u - 15.0))
        return phase, 30.0 * way / time * v * v, 60.0 * way / (time * time) * v * (1.0 - 2.0 * u)
    p, rate, end, u = 1.0, 0.0, schedule.ends[-1], w - motion[BRAKE_AT]
    if u > 0.0:
        h = motion[WAY]
        r, end = min(schedule.ramp, h), motion[END]
        kappa, left = 1.0 / (2.0 * h - r), max(2.0 * h - u, 0.0)
        if u < r:
            p, rate = 1.0 - 0.5 * kappa / r * u * u, -kappa / r * u
            w = motion[BRAKE_AT] + u - kappa / (6.0 * r) * u * u * u
        elif left > r:
            p, rate = 1.0 - kappa * (u - 0.5 * r), -kappa
            w = motion[BRAKE_AT] + u - 0.5 * kappa * (u * (u - r) + r * r / 3.0)
        else:
            p, rate = 0.5 * kappa / r * left * left, -kappa / r * left
            w = motion[BRAKE_AT] + h - kappa / (6.0 * r) * left * left * left
    phase, pace, bend = started(schedule, first, w)
    if phase >= schedule.ends[-1]:
        return schedule.ends[-1], 0.0, 0.0
    return min(phase, end), pace * p, bend * p * p + pace * rate


@compiled(borrows=True)
def hear(words: FloatArray, sender: int, word: FloatArray) -> None:
    """Take in words of somebody else; late and repeated ones change nothing.

    Args:
        words: What has been heard of all robots and the supervisor, shape (N + 1, WORD_SIZE).
        sender: Its row.
        word: What it says, shape (WORD_SIZE,).
    """
    known = words[sender]
    if word[PLAN] != known[PLAN] or word[EPOCH] < known[EPOCH]:
        return
    if word[EPOCH] > known[EPOCH]:
        known[EPOCH], known[KIND], known[HOLD] = word[EPOCH], START, inf
        known[PHASE], known[TIME] = word[PHASE], word[TIME]
    # A cell begun is never withdrawn, a hold neither.
    known[CELL], known[HOLD] = max(known[CELL], word[CELL]), min(known[HOLD], word[HOLD])
    if word[KIND] > known[KIND]:
        known[KIND], known[PHASE], known[TIME] = word[KIND], word[PHASE], word[TIME]
    if word[STAMP] > known[STAMP]:
        known[STAMP], known[FIT] = word[STAMP], word[FIT]


@compiled(borrows=True)
def robot_step(
    schedule: Schedule, clock: float, alarm: int, robot: int, motion: FloatArray, words: FloatArray
) -> tuple[float, float, float]:
    """Let a robot decide at a sample; its row of ``words`` is then what it says.

    All drives shall brake while the hold in its row is minus infinity.

    Args:
        schedule: The schedule.
        clock: What its clock shows [s].
        alarm: What its monitor says, see ``QUIET``.
        robot: Its row.
        motion: Its motion, which is changed, shape (MOTION_SIZE,).
        words: What it has heard, and says itself, shape (N + 1, WORD_SIZE).

    Returns:
        What ``phase_at`` gives now.
    """
    own, order, robots = words[robot], words[-1], words.shape[0] - 1
    window, cells, brakes = schedule.window, schedule.ends.size, schedule.brakes
    quiet = alarm <= QUIET
    own[STAMP] = clock
    for k in range(robots + 1):
        if words[k, STAMP] > clock + 2.0 * schedule.clock_error + ROUNDING:
            alarm = max(alarm, ASKS)
        if k < robots and words[k, STAMP] < clock - window:
            alarm = max(alarm, GROWS)
    own[FIT] = 2.0 if alarm == THERE else 1.0 if alarm == QUIET else 0.0
    begun = own[CELL]
    for k in range(robots):
        begun = min(begun, words[k, CELL])
    may = 1 + int(max(begun, order[CELL]))

    # A start is taken or refused; an epoch that others have given up is over.
    if own[KIND] == REST:
        phase, first = own[PHASE], order[PHASE]
        if order[EPOCH] > own[EPOCH]:
            creep = creep_time(schedule, first - phase)
            own[EPOCH] = order[EPOCH]
            if (
                alarm <= QUIET and clock <= order[TIME] - 2.0 * window - creep
                and phase <= first <= schedule.ends[min(may, cells - 1)] and order[HOLD] > first
            ):  # fmt: skip
                own[KIND], own[HOLD] = ARMED, inf
                motion[ORIGIN], motion[FIRST], motion[BEGIN], motion[CREEP] = phase, first, order[TIME], creep
                motion[BRAKE_AT], motion[LAST] = inf, 0.0
            else:
                own[HOLD] = phase
        for k in range(robots):
            if own[KIND] == REST and words[k, KIND] == REST and words[k, EPOCH] > own[EPOCH]:
                own[EPOCH], own[HOLD] = words[k, EPOCH], phase

    hold = -inf if alarm == BRAKES else own[HOLD]
    for k in range(robots + 1):
        if words[k, EPOCH] == own[EPOCH]:
            hold = min(hold, words[k, HOLD])
    first, w = motion[FIRST], clock - motion[BEGIN]
    ahead, running = started(schedule, first, w + window)[0], own[KIND] in (ARMED, RUN)
    if running:
        # Words that lack, and what the monitor asks for.
        limit = max(brakes[may], first) if may < cells - 1 else inf
        for k in range(robots):
            if own[KIND] == ARMED and words[k, EPOCH] != own[EPOCH]:
                limit = first
        if w + window >= 0.0 and ahead >= limit:
            hold = min(hold, limit)
        if alarm == ASKS and w + window > 0.0:
            i = next_brake(schedule, ahead)
            hold = min(hold, brakes[i] if i < cells else inf)
        elif alarm in (ASKS, GROWS):
            hold = min(hold, ahead)
    own[HOLD] = hold

    if own[KIND] == ARMED and w >= 0.0:
        own[KIND] = RUN if hold > first else REST
        if own[KIND] == REST:  # called off
            own[PHASE], motion[ORIGIN], motion[BEGIN] = first, first, inf
    running = own[KIND] == RUN or (own[KIND] == ARMED and hold > first)
    if running and ahead >= hold:
        at, better, last = 0.0, hold - first + 1.0 / schedule.start_rate, motion[LAST]
        if hold > first:  # Newton's method from above, as S is convex
            at = inf
            while better < at:
                at = better
                phase, pace, _ = started(schedule, first, at)
                better = at - (phase - hold) / pace
        phase = max(hold, first)
        if last > at + ROUNDING:  # heard too late
            at, phase = last, started(schedule, first, last)[0]
        i = next_brake(schedule, phase)
        if i < cells:
            way = schedule.ends[i] - brakes[i]
            ramp = min(schedule.ramp, way)
            time = 2.0 * way - ramp  # 1 / kappa
            for _ in range(SHORTENING):
                way = min(way, 0.5 * (started(schedule, first, at + way)[1] * time + ramp))
            motion[BRAKE_AT], motion[WAY], motion[END] = at, way, schedule.ends[i]
            if started(schedule, first, w)[0] >= hold:
                own[KIND] = BRAKE
    if own[KIND] in (RUN, BRAKE) and running:
        motion[LAST] = w

    phase, pace, rate = phase_at(schedule, motion, clock)
    stops = own[KIND] == BRAKE and w >= motion[BRAKE_AT] + 2.0 * motion[WAY]
    ends = own[KIND] == RUN and phase >= schedule.ends[-1]
    if own[KIND] != REST and (stops or ends or hold == -inf):
        own[KIND], own[PHASE], pace, rate = REST, phase, 0.0, 0.0
        motion[ORIGIN], motion[BEGIN] = phase, inf
    if quiet:
        while own[CELL] < cells - 1 and schedule.begins[int(own[CELL]) + 1] <= phase:
            own[CELL] += 1.0
    return phase, pace, rate


@compiled(borrows=True)
def supervisor_step(schedule: Schedule, clock: float, wanted: bool, words: FloatArray) -> tuple[int, int]:
    """Let the supervisor decide at a sample; the last row of ``words`` is then what it says.

    Args:
        schedule: The schedule.
        clock: What its clock shows [s].
        wanted: Whether the team shall go on; otherwise it is held at the next brake phase.
        words: What it has heard, and says itself, shape (N + 1, WORD_SIZE).

    Returns:
        What it sees, see ``GOES``, and the robot that it is about, -1 for none.
    """
    own, robots, window, cells = words[-1], words.shape[0] - 1, schedule.window, schedule.ends.size
    own[STAMP] = clock
    lowest, unfit, away, behind, resting, epoch = 0, -1, -1, -1, 0, words[0, EPOCH]
    first, last = words[0, PHASE], words[0, PHASE]
    for k in range(robots):
        if words[k, EPOCH] == own[EPOCH]:
            own[HOLD] = min(own[HOLD], words[k, HOLD])
        if words[k, KIND] == REST and words[k, EPOCH] == max(own[EPOCH], epoch):
            resting += 1
        elif behind < 0:
            behind = k
        if not words[k, FIT] > 0.0 and unfit < 0:
            unfit = k
        if words[k, FIT] < 2.0 and away < 0:
            away = k
        if words[k, CELL] < words[lowest, CELL]:
            lowest = k
        first, last = min(first, words[k, PHASE]), max(last, words[k, PHASE])
    if resting < robots:
        if not wanted and own[EPOCH] != UNKNOWN:
            w = clock - own[TIME] + window
            ahead = started(schedule, own[PHASE], w)[0]
            i = next_brake(schedule, ahead)
            named = schedule.brakes[i] if i < cells else inf
            own[HOLD] = min(own[HOLD], named if w > 0.0 else ahead)
        # Robots end the motion one after the other, by their clocks: nobody waits there for who is heard.
        ends = last >= schedule.ends[-1] and words[behind, STAMP] >= clock - window
        return (WAITS, behind) if resting > 0 and not ends else (GOES, -1)
    if unfit >= 0:
        return DEPARTS, unfit
    if first >= schedule.ends[-1]:
        return (GOES, away) if away >= 0 else (ARRIVED, -1)
    if not wanted:
        return HELD, -1
    cell = words[lowest, CELL]
    if last > schedule.ends[min(int(cell) + 1, cells - 1)]:
        return WAITS, lowest
    own[EPOCH] = epoch + (2.0 if own[EPOCH] == UNKNOWN else 1.0)
    own[CELL], own[HOLD], own[PHASE] = cell, inf, last
    own[TIME] = clock + 3.0 * window + creep_time(schedule, last - first)
    return GOES, -1
