"""Worlds of words: late, lost and reordered ones between robots and a supervisor with clocks of their own."""

from __future__ import annotations

from itertools import product
from math import cos, floor, inf
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws import words as w

DEAF, MUTE, CUT, DEAD, FORGETS = range(5)
"""Faults of a robot or the supervisor (the last row): it hears nothing; nothing that it says reaches anybody;
both, also of words that are under way; it does nothing any more; it forgets all (the supervisor alone)."""

ARRIVAL, SPREAD, NOWHERE, BEYOND, OVERRUN, LIES, ROUGH, UNEQUAL, EPOCHS, HELD, STILL = range(11)
"""What a run gives: when it arrived [s]; the largest difference of phases of robots that live [s]; in how
many periods no cell held all of these; how far a robot was beyond the cell after the last one that all had
begun, and beyond cell P by what it had heard [s]; in how many samples a robot was before a cell that it said
to have begun, and its pace was not continuous or its rate out of bounds; in how many periods robots rested at
different phases; the number of epochs; in how many periods robots had heard of a hold, for each of them; how
long nothing moved at most [s]."""


def schedule_of_steps(clock_error=0.0, delay=1.0):
    """Three cells for whole steps of time."""
    begins, brakes, ends = np.array([0.0, 8.0, 18.0]), np.array([9.0, 17.0]), np.array([12.0, 21.0, 26.0])
    return w.schedule_of(
        begins, begins, brakes, ends, ramp=0.5, start_rate=50.0, period=1.0, delay=delay,
        clock_error=clock_error,
    )  # fmt: skip


def even_schedule(cells, *, delay=0.05, period=0.005, clock_error=0.002, start_rate=1.0 / 0.74):
    """Cells that are begun in even times; 0.74 m/s are stopped and reached again at 1 m/s^2."""
    window = delay + 2.0 * clock_error + 2.0 * period
    begins = 0.4 * np.arange(cells)
    brakes = begins + 2.0 * window
    return w.schedule_of(
        begins, begins, brakes[:-1], brakes + 0.42, ramp=0.1, start_rate=start_rate, period=period,
        delay=delay, clock_error=clock_error,
    )  # fmt: skip


def random_schedule(generator, cells, *, delay=0.05, period=0.01, clock_error=0.002):
    """Cells of all lengths, with short and long overlaps."""
    window = delay + 2.0 * clock_error + 2.0 * period
    begins = np.append(0.0, np.cumsum(generator.uniform(0.08, 0.5, cells - 1)))
    entries = begins - np.append(0.0, generator.uniform(0.0, 0.06, cells - 1))
    brakes = np.maximum.accumulate(
        begins + 2.0 * window + generator.choice([0.0, 1.0]) * generator.uniform(0, 0.2, cells)
    )
    brakes += 1e-4 * np.arange(cells)
    ends = np.append(begins[1:], begins[-1] + 0.5) + generator.uniform(2.0 * clock_error, 0.4, cells)
    ends = np.maximum.accumulate(np.maximum(ends, brakes + generator.uniform(0.03, 0.6, cells)))
    ends += 1e-4 * np.arange(cells)
    return w.schedule_of(
        entries, begins, brakes[: cells - generator.integers(2)], ends, ramp=generator.uniform(0.02, 0.2),
        start_rate=generator.uniform(0.7, 4.0), period=period, delay=delay, clock_error=clock_error,
    )  # fmt: skip


@compiled
def sample(schedule, motion, times):
    """Return the phases, paces and their rates of a robot, shape (3, times)."""
    found = np.empty((3, times.size))
    for i in range(times.size):
        found[0, i], found[1, i], found[2, i] = w.phase_at(schedule, motion, times[i])
    return found


@compiled(borrows=True)
def put(target, source):
    """Copy a row: numba takes long to compile assignments to slices."""
    for i in range(target.size):
        target[i] = source[i]


@compiled(borrows=True)
def suffers(faults, fault, node, t):
    """Whether somebody has a fault at a time."""
    for i in range(len(faults)):
        if int(faults[i, 0]) == fault and int(faults[i, 1]) == node and faults[i, 2] <= t < faults[i, 3]:
            return True
    return False


@compiled
def run(
    schedule, first_words, again_words, clocks, offsets, order, delay, loss, faults, alarms, pauses, limit,
    until_rest, seed,
):  # fmt: skip
    """Run a team and return what ``ARRIVAL`` and the others name.

    Args:
        schedule: Its schedule.
        first_words: What all know first.
        again_words: What a supervisor knows that was started again.
        clocks: Of everybody: a clock is wrong by eps cos(a + b t), rows (a, b).
        offsets: When everybody samples in a period, as a share of it.
        order: Everybody in the order of these.
        delay: Largest delay [s]. A word of which no repeat is in time arrives after just this time.
        loss: Share of words that are lost [-].
        faults: Rows (fault, row of the one, begin, end).
        alarms: Rows (robot, alarm, begin, end).
        pauses: Rows (begin, end) in which nobody wants the team to go on.
        limit: When to give up [s].
        until_rest: Whether to stop as soon as all that live rest for a second.
        seed: Of random numbers.
    """
    np.random.seed(seed)  # noqa: NPY002 - numba's own
    nodes, period, cells = first_words.shape[0], schedule.period, schedule.ends.size
    robots = nodes - 1
    slots = int(delay / period) + 4
    words = np.empty((nodes, nodes, w.WORD_SIZE))
    motions, episodes = np.zeros((robots, w.MOTION_SIZE)), np.zeros((robots, w.MOTION_SIZE))
    boxes, due = np.zeros((nodes, slots, w.WORD_SIZE)), np.zeros((nodes, nodes, slots))
    taken = np.ones((nodes, nodes, slots))
    for node in range(nodes):
        for k in range(nodes):
            put(words[node, k], first_words[k])
    for k in range(robots):
        motions[k, w.BEGIN] = motions[k, w.BRAKE_AT] = inf
        motions[k, w.ORIGIN] = motions[k, w.FIRST] = first_words[k, w.PHASE]
        put(episodes[k], motions[k])
    found = np.zeros(11)
    found[ARRIVAL] = inf
    now, before = np.zeros((robots, 3)), np.zeros((robots, 3))
    forgot, code, still = False, 0, 0.0
    hardest = schedule.start_rate
    for i in range(cells):
        h = schedule.ends[i] - schedule.brakes[i]
        if i == 0 or schedule.brakes[i] > schedule.brakes[i - 1]:
            hardest = max(hardest, 1.0 / (2.0 * h - min(schedule.ramp, h)))
    for m in range(int(limit / period)):
        for node in order:
            t = (m + offsets[node]) * period
            clock = t + schedule.clock_error * cos(clocks[node, 0] + clocks[node, 1] * t)
            if suffers(faults, DEAD, node, t):
                continue
            if suffers(faults, FORGETS, node, t) and not forgot:
                forgot = True
                for k in range(nodes):
                    put(words[node, k], again_words[k])
            cut = suffers(faults, CUT, node, t)
            deaf, mute = cut or suffers(faults, DEAF, node, t), cut or suffers(faults, MUTE, node, t)
            for sender in range(nodes):
                oldest = floor((t - delay) / period - offsets[sender] + 1e-6) % slots
                passes = not deaf and not suffers(faults, CUT, sender, t)
                for slot in range(slots):
                    if taken[sender, node, slot] == 0.0 and (due[sender, node, slot] <= t or slot == oldest):
                        taken[sender, node, slot] = 1.0
                        if passes:
                            w.hear(words[node], sender, boxes[sender, slot])
            if node < robots:
                alarm = w.THERE
                for i in range(len(alarms)):
                    if int(alarms[i, 0]) == node and alarms[i, 2] <= t < alarms[i, 3]:
                        alarm = max(alarm, int(alarms[i, 1]))
                begin, origin = motions[node, w.BEGIN], motions[node, w.ORIGIN]
                put(before[node], now[node])
                now[node, 0], now[node, 1], now[node, 2] = w.robot_step(
                    schedule, clock, alarm, node, motions[node], words[node]
                )
                own = words[node, node]
                if motions[node, w.BEGIN] < inf or begin < inf:
                    put(episodes[node], motions[node])
                if not motions[node, w.BEGIN] < inf and begin < inf:
                    episodes[node, w.BEGIN], episodes[node, w.ORIGIN] = begin, origin
                found[EPOCHS] = max(found[EPOCHS], own[w.EPOCH])
                # Pace and phase from sample to sample, and the bounds of the rate.
                step = period * (1.0 + 1e-3) + 1e-9
                rough = now[node, 0] < before[node, 0] - 1e-12 or now[node, 0] > before[node, 0] + step
                rough = rough or not -hardest - 1e-9 <= now[node, 2]
                rough = rough or not now[node, 2] <= schedule.start_rate * (1.0 - now[node, 1] ** 2) + 1e-9
                jumps = motions[node, w.FIRST] == 0.0 and before[node, 1] == 0.0  # a start at phase 0
                rough = rough or (not jumps and abs(now[node, 1] - before[node, 1]) > hardest * 1.001 * step)
                if rough and own[w.HOLD] > -inf and m > 0:
                    # At the end the motion itself is at rest, whatever the pace.
                    found[ROUGH] += 1.0 if now[node, 0] < schedule.ends[-1] else 0.0
                begun = own[w.CELL]
                for k in range(robots):
                    begun = min(begun, words[node, k, w.CELL])
                may = 1 + int(max(begun, words[node, robots, w.CELL]))
                found[OVERRUN] = max(found[OVERRUN], now[node, 0] - schedule.ends[min(may, cells - 1)])
                found[LIES] += 1.0 if now[node, 0] < schedule.begins[int(own[w.CELL])] else 0.0
            else:
                wanted = True
                for i in range(len(pauses)):
                    wanted = wanted and not pauses[i, 0] <= t < pauses[i, 1]
                code = w.supervisor_step(schedule, clock, wanted, words[node])[0]
                if code == w.ARRIVED and found[ARRIVAL] == inf:
                    found[ARRIVAL] = t
            slot = m % slots
            put(boxes[node, slot], words[node, node])
            for receiver in range(nodes):
                taken[node, receiver, slot] = 1.0 if mute or receiver == node else 0.0
                lost, age = np.random.random() < loss, delay * np.random.random()  # noqa: NPY002
                due[node, receiver, slot] = inf if lost else t + age
        # What holds at the instant m T, for which everybody has decided.
        t, low, high, least, moves, known = m * period, inf, -inf, inf, False, True
        lowest, highest = inf, -inf
        for k in range(robots):
            least = min(least, words[k, k, w.CELL])
            if suffers(faults, DEAD, k, t):
                continue
            clock = t + schedule.clock_error * cos(clocks[k, 0] + clocks[k, 1] * t)
            phase, rest = w.phase_at(schedule, episodes[k], clock)[0], words[k, k, w.PHASE]
            if words[k, k, w.KIND] == w.REST:
                phase = min(phase, rest)
                lowest, highest = min(lowest, rest), max(highest, rest)
            known = known and words[k, k, w.KIND] == w.REST and words[k, k, w.EPOCH] == words[0, 0, w.EPOCH]
            moves = moves or now[k, 1] > 0.0
            low, high = min(low, phase), max(high, phase)
            found[HELD] += 1.0 if words[k, k, w.HOLD] < inf else 0.0
        common = False
        for i in range(cells):
            common = common or (schedule.entries[i] <= low and high <= schedule.ends[i])
        found[NOWHERE] += 0.0 if common else 1.0
        found[SPREAD] = max(found[SPREAD], high - low)
        found[BEYOND] = max(found[BEYOND], high - schedule.ends[min(int(least) + 1, cells - 1)])
        found[UNEQUAL] += 1.0 if known and highest > lowest else 0.0
        still = 0.0 if moves else still + period
        found[STILL] = max(found[STILL], still)
        if code == w.ARRIVED or (until_rest and still > 1.0):
            break
    return found


def run_world(schedule, seed, *, robots=3, delay=0.05, loss=0.2, faults=(), alarms=(), pauses=(), limit=30.0,
              until_rest=False):  # fmt: skip
    """Run a team in a world drawn from a seed."""
    generator = np.random.default_rng(seed)
    clocks = np.zeros((robots + 1, 2))
    if generator.random() < 0.5:  # as wrong as they may be, for ever
        clocks[:, 0] = generator.choice([0.0, np.pi], robots + 1)
    else:  # corrected by a thousandth of their rate at most
        clocks[:, 0] = generator.uniform(0.0, 2.0 * np.pi, robots + 1)
        clocks[:, 1] = generator.uniform(0.0, 1e-3 / schedule.clock_error, robots + 1)
    offsets = generator.choice([0.0, 1.0]) * generator.uniform(0.0, 1.0, robots + 1)
    known = w.first_words(schedule, robots), w.first_words(schedule, robots, again=True)
    events = (
        np.array(rows, float).reshape(-1, columns)
        for rows, columns in ((faults, 4), (alarms, 4), (pauses, 2))
    )
    return run(
        schedule, *known, clocks, offsets, np.argsort(offsets), delay, loss, *events, limit, until_rest, seed,
    )  # fmt: skip


# All that can happen to three robots in whole steps of time.


class Moment(NamedTuple):
    """A state of the team and of the words under way.

    Attributes:
        words: What everybody has heard and says, shape (nodes, nodes, WORD_SIZE).
        motions: Of the robots, shape (robots, MOTION_SIZE).
        past: What everybody said a step ago, two steps ago and so on, shape (ages, nodes, WORD_SIZE).
        broken: Number of what is broken, -1 for nothing yet, -2 for nothing any more.
        asked: Whether a monitor has asked, so that none asks again.
    """

    words: np.ndarray
    motions: np.ndarray
    past: np.ndarray
    broken: int
    asked: bool

    def key(self):
        """Bytes that are the same where all that follows is: stamps only tell which of two words is newer."""
        words, past = self.words.copy(), self.past.copy()
        same = (past[:, None, :, w.FIT] == words[:, :, w.FIT]).all(axis=0)
        words[:, :, w.STAMP], past[:, :, w.STAMP] = np.where(same, 0.0, words[:, :, w.STAMP]), 0.0
        return (
            words.tobytes() + self.motions.tobytes() + past.tobytes() + bytes([self.broken + 2, self.asked])
        )


@compiled
def choices(words, past, passes):
    """Return which ages of words have different effects on every link, as bits, shape (nodes, nodes)."""
    nodes, ages = words.shape[0], past.shape[0]
    bits = np.zeros((nodes, nodes), np.int64)
    table = np.empty((ages, nodes, w.WORD_SIZE))
    for sender in range(nodes):
        for receiver in range(nodes):
            if sender == receiver or not passes[sender, receiver]:
                continue
            for age in range(ages):
                for node in range(nodes):
                    put(table[age, node], words[receiver, node])
                w.hear(table[age], sender, past[age, sender])
                new = True
                for other in range(age):
                    same = True
                    for i in range(w.WORD_SIZE):
                        if i != w.STAMP and table[age, sender, i] != table[other, sender, i]:
                            same = False
                    new = new and not same
                if new:
                    bits[sender, receiver] |= 1 << age
    return bits


@compiled
def advance(schedule, clocks, step, words, motions, past, picks, alarms, wanted):
    """Let everybody hear the words of the ages picked (-1 for none), decide and speak; changes all arrays."""
    nodes, code = words.shape[0], 0
    for receiver in range(nodes):
        for sender in range(nodes):
            if picks[sender, receiver] >= 0:
                w.hear(words[receiver], sender, past[picks[sender, receiver], sender])
    for node in range(nodes):
        clock = step + schedule.clock_error * clocks[node]
        if node < nodes - 1:
            w.robot_step(schedule, clock, alarms[node], node, motions[node], words[node])
        else:
            code = w.supervisor_step(schedule, clock, wanted, words[node])[0]
    for age in range(past.shape[0] - 1, 0, -1):
        for node in range(nodes):
            put(past[age, node], past[age - 1, node])
    for node in range(nodes):
        put(past[0, node], words[node, node])
    return code


@compiled
def judge(schedule, clocks, step, words, motions):
    """Return the difference of phases [s], whether a cell holds all, how far one is beyond its cells [s]."""
    low, high, least, cells = inf, -inf, inf, schedule.ends.size
    for k in range(words.shape[0] - 1):
        phase = w.phase_at(schedule, motions[k], step + schedule.clock_error * clocks[k])[0]
        low, high, least = min(low, phase), max(high, phase), min(least, words[k, k, w.CELL])
    common = False
    for i in range(cells):
        common = common or (schedule.entries[i] <= low and high <= schedule.ends[i])
    return high - low, common, high - schedule.ends[min(int(least) + 1, cells - 1)]


HORIZON = 150
"""The step by which everybody must have arrived."""


class Explored(NamedTuple):
    """What can happen: numbers of different states and of steps between them, and the worst of ``judge``."""

    states: int
    steps: int
    spread: float
    nowhere: int
    beyond: float


def explore(
    schedule, ages, *, timely=(), clocks=(0.0, 0.0, 0.0, 0.0), breaks=(), until=0, asks=(), ask_until=0
):
    """Follow all interleavings until all have arrived.

    Args:
        schedule: The schedule, in whole steps.
        ages: By how many steps words may be old; each link carries any of them at any step.
        timely: Links that always carry the newest words.
        clocks: By how many eps clocks are ahead.
        breaks: What may break once, at any step, and be repaired at any later one: lists of links.
        until: The step by which what is broken is repaired.
        asks: Robots and alarms: one of these monitors may give its alarm once, for one step.
        ask_until: The last step at which it may.
    """
    nodes, clocks = 4, np.array(clocks, float)
    words = np.array([w.first_words(schedule, 3)] * nodes)
    start = Moment(words, np.array([w.first_motion()] * 3), np.array([words[0]] * ages), -1, False)
    layer, states, steps, spread, nowhere, beyond = {b"": start}, 1, 0, 0.0, 0, -inf
    for step in range(HORIZON):
        found = {}
        for moment in layer.values():
            broken = [moment.broken]
            if moment.broken == -1 and step < until:
                broken += range(len(breaks))
            elif moment.broken >= 0:
                broken = [-2] if step >= until else [moment.broken, -2]
            alarms = [(w.THERE,) * 3]
            if asks and not moment.asked and step < ask_until:
                alarms += [tuple(a if k == one else w.THERE for k in range(3)) for one, a in asks]
            for now_broken in broken:
                passes = ~np.eye(nodes, dtype=bool)
                for link in breaks[now_broken] if now_broken >= 0 else ():
                    passes[link] = False
                bits = choices(moment.words, moment.past, passes)
                picks = np.where(bits > 0, 0, -1)
                for link in timely:
                    bits[link] &= 1
                links = [tuple(link) for link in np.argwhere(bits > 1)]
                for chosen in product(
                    *([age for age in range(ages) if bits[link] >> age & 1] for link in links)
                ):
                    for link, age in zip(links, chosen, strict=True):
                        picks[link] = age
                    for alarm in alarms:
                        arrays = moment.words.copy(), moment.motions.copy(), moment.past.copy()
                        code = advance(schedule, clocks, step, *arrays, picks, np.array(alarm), True)
                        parted, common, over = judge(schedule, clocks, step, *arrays[:2])
                        spread, beyond = max(spread, parted), max(beyond, over)
                        nowhere, steps = nowhere + (not common), steps + 1
                        if code != w.ARRIVED:
                            then = Moment(*arrays, now_broken, moment.asked or max(alarm) > w.QUIET)
                            found.setdefault(then.key(), then)
        states, layer = states + len(found), found
        if not layer:
            return Explored(states, steps, spread, nowhere, beyond)
    raise AssertionError(f"{len(layer)} states had not arrived after {HORIZON} steps")


class Team:
    """A team whose words take one step, on links that a test may close.

    Args:
        schedule: The schedule.
        phases: Where the robots rest.
        again: Whether the supervisor was started again.

    Attributes:
        closed: Links (sender, receiver) that carry nothing; the supervisor is the last one.
        alarms: What the robots' monitors say.
        wanted: Whether the team shall go on.
        gone: Who does nothing any more.
        clocks: By how many eps clocks are ahead.
        code: What the supervisor sees, and the robot that it is about.
    """

    def __init__(self, schedule, phases, again=False):
        self.schedule, self.robots = schedule, len(phases)
        nodes = self.robots + 1
        known = w.first_words(schedule, self.robots)
        known[: self.robots, w.PHASE] = phases
        for k, phase in enumerate(phases):
            known[k, w.CELL] = np.searchsorted(schedule.begins, phase, side="right") - 1
        self.words, self.motions = np.array([known] * nodes), np.array([w.first_motion(p) for p in phases])
        if again:
            self.words[-1] = w.first_words(schedule, self.robots, again=True)
        self.past = self.words[0][None].copy()
        self.closed, self.gone, self.clocks = set(), set(), np.zeros(nodes)
        self.alarms, self.wanted, self.code, self.number = [w.THERE] * self.robots, True, (w.GOES, -1), 0

    @property
    def time(self):
        """Time of the next step."""
        return self.number * self.schedule.period

    @property
    def kinds(self):
        """What the robots do."""
        return [self.words[k, k, w.KIND] for k in range(self.robots)]

    @property
    def phases(self):
        """Where the robots are after the last step."""
        return np.array([motion[0] for motion in self.now])

    def step(self):
        """Let all hear, decide and speak."""
        nodes, said = self.robots + 1, self.past[0].copy()
        self.now = getattr(self, "now", None) or [(0.0, 0.0, 0.0)] * self.robots
        for node in range(nodes):
            if node in self.gone:
                continue
            for sender in range(nodes):
                if sender != node and not {(sender, node)} & self.closed:
                    w.hear(self.words[node], sender, said[sender])
            clock = self.time + self.clocks[node] * self.schedule.clock_error
            own = self.words[node]
            if node < self.robots:
                self.now[node] = w.robot_step(
                    self.schedule, clock, self.alarms[node], node, self.motions[node], own
                )
            else:
                self.code = w.supervisor_step(self.schedule, clock, self.wanted, own)
            self.past[0, node] = own[node]
        self.number += 1
        return self.now

    def until(self, condition, limit=30.0):
        """Go on until a condition holds; returns phases, paces and their rates, shape (steps, robots, 3)."""
        rows, end = [], self.time + limit
        while not condition(self):
            assert self.time < end, f"not within {limit} s; the supervisor sees {self.code}"
            rows.append(list(self.step()))
        return np.array(rows)
