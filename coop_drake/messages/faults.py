"""What goes wrong between the processes of a team, as a user may try it: typed YAML."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from coop_drake.errors import ScenarioError
from coop_drake.messages.schema import MOST_ROBOTS
from coop_drake.scenario.deployment import Delay, Probability
from coop_drake.scenario.reading import read_file
from coop_drake.typed_data import Limits, NotNegative, Positive

Robot = Annotated[int, Limits(at_least=0, at_most=MOST_ROBOTS - 1)]
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
