"""Check the funnels' clock of a run: it lags behind only where the team is held, or was shortly before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from coop_drake.verification.checks import Check
from coop_drake.verification.runs.rows import Rows

RATE = 10.0
"""Rate with which the clock slows down and runs again [1/s]."""

SETTLED = 2.0
"""Time after a change of ``held`` until the clock stands still or runs freely, within ``ROUNDING`` [s]."""

PAUSE = 1.0
"""So long after a hold no cell is left [s]."""

ROUNDING = 1e-6
"""Share of a step by which a clock that stands still may go on, or one that runs may lag [-]."""


def check_clock(rows: Rows, *, one_hold: bool, never_held: bool = False) -> Check:
    """Check that the stated lag grows with time while the team is held, and not where it is free for long.

    Where robots do not hear of a hold at once, the first one's lag is only no more than the time.
    """
    log, h = rows.log, rows.steps
    if never_held:
        for name in ("held", "clock_lag"):
            rows.require_same(name, np.zeros(len(log.times)), 0.0)
    rows.require((log.held == 0.0) | (log.held == 1.0), "held", "is {}; expected 0 or 1", log.held)
    rows.require_same("clock_lag", np.zeros(1), 0.0)
    entered = np.diff(log.cell_index) > 0
    grown = np.where(entered, log.clock_lag[1:], np.diff(log.clock_lag))
    rounding = ROUNDING * h + 1e-12
    text = "grew by {:.9g} s in a step of {:.9g} s"
    allowed = (grown >= -rounding) & (grown <= h + rounding)
    rows.require(allowed, "clock_lag", text, grown, h, first=1)
    long_free = ~_within(rows, log.held > 0.0, SETTLED)[1:] & one_hold
    rows.require(~long_free | (grown <= rounding), "clock_lag", text + " without a hold", grown, h, first=1)
    long_held = ~_within(rows, log.held < 1.0, SETTLED)[1:] & one_hold
    rows.require(~long_held | (grown >= h - rounding), "clock_lag", text + " of a hold", grown, h, first=1)
    count = int((np.diff(log.held, prepend=0.0) > 0.0).sum())
    lost = float(np.where(entered, log.clock_lag[:-1], 0.0).sum() + log.clock_lag[-1])
    arrays = ("held", "clock_lag") if never_held else ()
    return Check("the funnels' clock stands still where the team is held", count, lost, "s lost", arrays)


def paused(rows: Rows) -> NDArray[np.bool_]:
    """Whether the team is held, or was shortly before, in every row, shape (T,)."""
    return _within(rows, rows.log.held > 0.0, PAUSE)


def _within(rows: Rows, happened: NDArray[np.bool_], time: float) -> NDArray[np.bool_]:
    """Whether something happened in a row or less than some time before it, shape (T,)."""
    times = rows.log.times
    last = np.maximum.accumulate(np.where(happened, times, -np.inf))
    return np.asarray(times - last <= time + np.max(rows.steps, initial=0.0), dtype=np.bool_)
