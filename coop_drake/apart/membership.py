"""Who of a team is missing, and the emergency stop by which the others wait at rest until all are there."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from coop_drake.apart.messages import SUPERVISOR, name_of
from coop_drake.apart.node import ASKS, LATE, OUTSIDE, STANDS

TOLERATED = 0.02
"""How long drives hold the last effort of a robot that gives no other, where the plan has no budget [s]:
shipped transports lose nothing by it."""

_ROUNDING = 1e-6
"""Differences of times that are no difference [s]."""

_STRANDED = {
    OUTSIDE: "cannot begin the current cell anew from there",
    LATE: "cannot go on: measurements are older than the plan allows, or have stamps that cannot be",
}
"""Why a team that rests cannot go on, by the state of its robots."""

PATIENT_AT_REST = 0.5
"""A robot that rests where it cannot begin its cell anew says so for this long before the run ends [s]:
measurements have noise."""


@dataclass
class Stop:
    """One time in which all drives braked.

    Attributes:
        cause: Who was missing.
        since: When the line was opened [s].
        rested: When the team rested, None where it did not [s].
        resumed: When it went on, None where it did not [s].
        returned: Whether it then first went slowly to its cell, on a way that no plan has proved free, as
            teams do that rest in every cell.
    """

    cause: str
    since: float
    rested: float | None = None
    resumed: float | None = None
    returned: bool = False


class Processes:
    """Processes that somebody else starts: nothing is known about them, and none is started again."""

    def gone(self) -> Collection[int]:
        """Return the indices of the processes that are known to have ended."""
        return ()

    def revive(self, index: int) -> bool:
        """Start a process again that has ended; return whether that was done."""
        return False


class Membership:
    """Keeps who is missing, since when, and whether the drives brake.

    The drives of a robot without answers hold its last effort for as long as is tolerated. Then they open the
    line of the emergency stop, which is common to all drives, and all robots brake. The line is closed at a
    sample in which all robots follow the plan again.

    Args:
        tolerated: How long that is [s].
        rejoin: How long a team at rest waits for who is missing [s], by the wall clock.
        processes: Knows which processes have ended, and may start them again.
        tell: Is told what happens.

    Attributes:
        missing: Since which simulated time each missing process is missing [s].
        stopped: Whether the line is open.
        stops: All times in which it was.
        trouble: Why the run cannot go on; empty where it can.
        gone: Returns the processes that are known to have ended.
    """

    def __init__(
        self,
        *,
        tolerated: float = TOLERATED,
        rejoin: float,
        processes: Processes,
        tell: Callable[[str], None],
    ) -> None:
        self.missing, self.stops, self.stopped = dict[int, float](), list[Stop](), False
        self.trouble, self.revived = "", list[int]()
        self.tolerated = tolerated
        self.gone, self._revive, self._rejoin, self._tell = processes.gone, processes.revive, rejoin, tell
        self._deadline: float | None = None
        self._rests: float | None = None

    def too_long(self, since: float, time: float) -> bool:
        """Whether an effort was held from one time to another for longer than is tolerated [s]."""
        return time - since > self.tolerated + _ROUNDING

    def lose(self, since: Mapping[int, float]) -> None:
        """Go on without processes from the last instants that they have answered [s]."""
        for index, time in since.items():
            self.missing[index] = time
            revived = index in self.gone() and self._revived(index)
            self._tell(self._missing_words(index) + ("; it is started again" if revived else ""))

    def back(self, index: int) -> None:
        """A process answers again as it should."""
        if self.missing.pop(index, None) is not None:
            self._tell(f"{name_of(index)} is there again")

    def see(self, time: float, states: Mapping[int, int], *, rests: bool) -> None:
        """Open the line where it must be open; end the run where a team at rest times out waiting.

        Args:
            time: Simulated time [s].
            states: States of the robots that have answered, see ``messages.Effort``.
            rests: Whether the team rests.
        """
        late = [k for k, since in self.missing.items() if k != SUPERVISOR and self.too_long(since, time)]
        waiting = [k for k, state in states.items() if state in (STANDS, ASKS, LATE)]
        if not self.stopped and (late or waiting):
            names = ", ".join(name_of(k) for k in sorted(late or waiting))
            self.stopped = True
            self.stops.append(Stop(names, time))
        self._rests = (time if self._rests is None else self._rests) if rests else None
        if self.stopped and rests and self.stops[-1].rested is None:
            self.stops[-1].rested = time
        if self._stranded(time, states):
            why = LATE if LATE in states.values() else OUTSIDE
            names = " and ".join(name_of(k) for k in sorted(states) if states[k] == why)
            self._end(f"{names} {_STRANDED[why]}")
        if not (self.missing and rests):
            self._deadline = None
        elif self.timed_out():
            self.give_up()

    def close_line(self, time: float, *, returns: bool) -> None:
        """All robots go on."""
        self.stopped, self.stops[-1].resumed, self.stops[-1].returned = False, time, returns
        how = ", and returns slowly to its cell on a way that no plan has proved free" if returns else ""
        self._tell(f"the team goes on at t = {time:.6g} s{how}")

    def timed_out(self) -> bool:
        """Whether a team at rest has waited long enough, or waits for processes that do not come back."""
        if self._deadline is None:
            self._deadline = clocks.monotonic() + self._rejoin
            names = " and ".join(name_of(index) for index in sorted(self.missing))
            self._tell(f"the team rests and waits for {names} for at most {self._rejoin:g} s")
        late = clocks.monotonic() >= self._deadline
        return late or any(not self._revived(index) for index in self.missing if index in self.gone())

    def give_up(self) -> None:
        """End the run without who is missing."""
        self._end("; ".join(self._missing_words(index) for index in sorted(self.missing)))

    def _end(self, why: str) -> None:
        self.trouble = why
        if self._rests is not None:
            self.trouble += f"; the team rests since t = {self._rests:.6g} s"

    def facts(self) -> dict[str, Any]:
        """Return all stops, and how often each process was started again."""
        restarts = {name_of(index): self.revived.count(index) for index in sorted(set(self.revived))}
        return {"stops": [asdict(stop) for stop in self.stops], "restarts": restarts}

    def _stranded(self, time: float, states: Mapping[int, int]) -> bool:
        rested = self.stops[-1].rested if self.stopped else None
        late = rested is not None and time - rested > PATIENT_AT_REST
        return late and not self.missing and any(state in _STRANDED for state in states.values())

    def _missing_words(self, index: int) -> str:
        return f"{name_of(index)} has not answered since t = {self.missing[index]:.6g} s"

    def _revived(self, index: int) -> bool:
        """Start a process again that has ended; return whether that was done."""
        revived = self._revive(index)
        self.revived += [index] * revived
        return revived
