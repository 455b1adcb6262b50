"""The channel of a robot's reports, and the seeds of what is drawn for each robot."""

from __future__ import annotations

import numpy as np
from pydrake.systems.primitives import LinearSystem

from coop_drake.scenario import Deployment, Messages
from coop_drake.systems import MessageChannel, clear_channel


def build_radio(deployment: Deployment, robot: int, use: int = 0) -> MessageChannel | LinearSystem:
    """Build the channel of a robot's reports in a sampled team.

    The use of the seed is 3 for its requests to the hold supervisor, and 4 for what it hears of this.
    """
    messages, period = deployment.messages, deployment.period or 0.0
    if messages == Messages():
        return clear_channel(period)
    return MessageChannel(
        period,
        delay=messages.delay,
        loss=messages.loss,
        repeat=messages.repeat,
        seed=seed_of(deployment, robot, use),
    )


def seed_of(deployment: Deployment, robot: int, use: int = 0) -> int:
    """Return the seed of what is drawn for a robot; each use has its own.

    The use is 0 for losses of reports, 1 and 2 for those of measurements of the object and of the robot, 3
    and 4 for those of messages about holds, 5 and 6 for the noise of these measurements, 7 for the clock.
    """
    words = [deployment.seed, robot, use] if use else [deployment.seed, robot]
    return int(np.random.SeedSequence(words).generate_state(1)[0])
