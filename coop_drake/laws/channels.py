"""What channels hold that lose and delay what they carry: reports of robots, and measurements."""

from __future__ import annotations

from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

NOTHING = -1.0
"""First number of a message or measurement that is none; cells and measurements are numbered from 0 [-]."""


def channel_rows(delay: int) -> int:
    """Return how many reports a channel holds: the one heard, and those of so many periods to come.

    Args:
        delay: Periods that a report travels; a repeated one travels twice as long, at least one period more.
    """
    return 1 + delay + max(delay, 1)


@compiled(borrows=True)
def carry_reports(
    kept: FloatArray, sent: FloatArray, arrives: bool, repeated: bool, delay: int, arrivals: FloatArray
) -> None:
    """Write what a channel holds a period later: the report heard, then those of the next periods.

    A report that arrives is there ``delay`` periods later, a repeated one again in the last row, unless a
    newer one arrives then.

    Args:
        kept: What the channel holds, shape (``channel_rows``, 2): the report heard, then what arrives in each
            of the next periods, beginning with ``NOTHING`` where nothing does.
        sent: Report of this period, shape (2,).
        arrives: Whether it is not lost.
        repeated: Whether it arrives twice.
        delay: Periods that it travels.
        arrivals: Receives what the channel holds then, of the same shape.
    """
    last = kept.shape[0] - 1
    for i in range(last):
        arrivals[i, 0], arrivals[i, 1] = kept[i + 1, 0], kept[i + 1, 1]
    arrivals[last, 0], arrivals[last, 1] = NOTHING, NOTHING
    if arrives:
        arrivals[delay, 0], arrivals[delay, 1] = sent[0], sent[1]
        if repeated:
            arrivals[last, 0], arrivals[last, 1] = sent[0], sent[1]
    if arrivals[0, 0] < 0.0:
        arrivals[0, 0], arrivals[0, 1] = kept[0, 0], kept[0, 1]


@compiled(borrows=True)
def carry_measurements(
    kept: FloatArray, number: int, measured: FloatArray, lost: bool, late: bool, following: FloatArray
) -> None:
    """Write what a line of measurements holds a period later: the newest that arrived, then late ones.

    A measurement that is lost leaves the newest one standing; a late one is the newest when it arrives,
    unless a newer one has arrived.

    Args:
        kept: Numbers and values of the newest that has arrived, then of what arrives in each of the next
            periods, with the number ``NOTHING`` where nothing does, shape (r, 1 + n).
        number: Of the present measurement.
        measured: Its values, shape (n,).
        lost: Whether it is lost.
        late: Whether it is late, by r periods, if it is not lost.
        following: Receives what the line holds then, shape (r, 1 + n).
    """
    rows = kept.shape[0]
    for i in range(rows - 1):
        _copy(kept[i + 1], following[i])
    for i in range(following.shape[1]):
        following[rows - 1, i] = NOTHING
    if late and not lost:
        following[rows - 1, 0] = number
        _copy(measured, following[rows - 1, 1:])
    if following[0, 0] <= kept[0, 0]:
        _copy(kept[0], following[0])
    if not (lost or late) and number > following[0, 0]:
        following[0, 0] = number
        _copy(measured, following[0, 1:])


@compiled(borrows=True)
def _copy(values: FloatArray, place: FloatArray) -> None:
    """Write values at a place; numba's own way also compiles a message for other shapes, which takes long."""
    for i in range(place.size):
        place[i] = values[i]
