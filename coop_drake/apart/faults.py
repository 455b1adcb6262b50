"""What goes wrong between the processes of a team, as a user may try it: typed YAML, and what it does."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np

from coop_drake.apart import messages
from coop_drake.errors import ScenarioError
from coop_drake.laws.measurements import whole_periods
from coop_drake.scenario.deployment import Delay, Probability
from coop_drake.scenario.document import read_file
from coop_drake.typed_data import Limits, NotNegative, Positive

Robot = Annotated[int, Limits(at_least=0, at_most=messages.MOST_ROBOTS - 1)]
"""Index k of a robot."""


@dataclass(frozen=True)
class Gap:
    """An interval in which a channel carries nothing.

    Attributes:
        begin: When it begins, in simulated time [s].
        duration: How long it lasts [s].
        robots: Indices of the robots whose messages are lost; all robots and the supervisor where empty.
    """

    begin: NotNegative
    duration: Positive
    robots: tuple[Robot, ...] = ()


@dataclass(frozen=True)
class ChannelFaults:
    """What happens to the messages of one channel; each message is drawn for by itself.

    Attributes:
        loss: Probability that a message is lost [-].
        repeat: Probability that a message which is not lost is sent a second time [-].
        late: Probability that a message which is not lost is sent late, after others that came later [-].
        late_by: How much later, rounded up to whole samples, at least one [s].
        gaps: Intervals in which nothing is carried.
    """

    loss: Probability = 0.0
    repeat: Probability = 0.0
    late: Probability = 0.0
    late_by: Delay = 0.0
    gaps: tuple[Gap, ...] = ()


@dataclass(frozen=True)
class ClockFault:
    """A robot whose clock is not that of the others.

    Attributes:
        robot: Its index k.
        offset: By how much it is ahead at the start; may be negative [s].
        drift: By how much it runs faster, relative; may be negative [-].
    """

    robot: Robot
    offset: Annotated[float, Limits(at_least=-10.0, at_most=10.0)] = 0.0
    drift: Annotated[float, Limits(at_least=-0.1, at_most=0.1)] = 0.0


@dataclass(frozen=True)
class Faults:
    """Faults of channels and clocks, the same in every run of the same scenario in lock-step.

    Attributes:
        seed: Seed of what is drawn.
        sensors: Faults of the channel of measurements.
        efforts: Faults of the channel of efforts.
        team: Faults of the team's channel, in both directions.
        clocks: Robots with clocks of their own.
    """

    seed: Annotated[int, Limits(at_least=0)] = 0
    sensors: ChannelFaults = field(default_factory=ChannelFaults)
    efforts: ChannelFaults = field(default_factory=ChannelFaults)
    team: ChannelFaults = field(default_factory=ChannelFaults)
    clocks: tuple[ClockFault, ...] = ()

    def clock(self, robot: int, time: float) -> float:
        """Return what the clock of a robot shows at a simulated time [s]."""
        own = next((clock for clock in self.clocks if clock.robot == robot), None)
        return time if own is None else own.offset + (1.0 + own.drift) * time


NO_FAULTS = Faults()
"""Where nothing goes wrong."""


def load_faults(path: Path, robots: int) -> Faults:
    """Read a file with faults.

    Args:
        path: The file.
        robots: Number of robots of the team.

    Raises:
        ScenarioError: The file is wrong, or names a robot that the team does not have.
    """
    faults = read_file(Faults, path)
    named = [(f"clocks[{i}].robot", clock.robot) for i, clock in enumerate(faults.clocks)]
    for channel in ("sensors", "efforts", "team"):
        for i, gap in enumerate(getattr(faults, channel).gaps):
            named += [(f"{channel}.gaps[{i}].robots", robot) for robot in gap.robots]
    for key, robot in named:
        if robot >= robots:
            raise ScenarioError(str(path), key, robot, f"0 to {robots - 1}, robots of the team")
    return faults


_CHANNELS: tuple[messages.Channel, ...] = ("sensors", "efforts", "team")

_ONLY_LOGGED = (messages.Telemetry, messages.Status)
"""Messages that a team without a log would not send."""


class Link:
    """Decides by seed and number of a message whether it is lost, repeated or late.

    Messages that open or close sessions, those that only the log needs, and those of the first sample pass: a
    robot that does not hear of the first sample is one that was started later.

    Args:
        channel: The channel.
        faults: What goes wrong.
        period: Control period [s].
        sender: Index of the sender.
        receiver: Index of the receiver.
    """

    def __init__(
        self, channel: messages.Channel, faults: Faults, period: float, sender: int, receiver: int
    ) -> None:
        self._faults: ChannelFaults = getattr(faults, channel)
        self._words = [faults.seed, _CHANNELS.index(channel), sender, receiver]
        self._robots = {sender, receiver}
        self._period, self._count = period, 0
        self.late_by = max(1, whole_periods(self._faults.late_by, period))

    def fate(self, message: messages.Message, sample: int) -> tuple[int, bool]:
        """Return how often a message is sent, and whether it is sent late.

        Args:
            message: The message.
            sample: Number of the present sample.
        """
        f = self._faults
        opens = isinstance(message, messages.UNNUMBERED) or sample == 0
        if opens or isinstance(message, _ONLY_LOGGED) or not getattr(message, "step", True):
            return 1, False
        self._count += 1
        if any(self._covers(gap, sample) for gap in f.gaps):
            return 0, False
        lost, repeated, late = np.random.default_rng([*self._words, self._count]).random(3)
        return (0 if lost < f.loss else 1 + int(repeated < f.repeat)), bool(late < f.late)

    def _covers(self, gap: Gap, sample: int) -> bool:
        first, last = (round(t / self._period) for t in (gap.begin, gap.begin + gap.duration))
        return first <= sample < last and (not gap.robots or bool(self._robots & {*gap.robots}))
