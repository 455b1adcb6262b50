"""What robots compute beside the law of the paper."""

from dataclasses import dataclass
from typing import Annotated

from coop_drake.typed_data import Limits, NotNegative, Positive

EnergyShare = Annotated[float, Limits(at_least=1.0)]
"""A multiple of the energy with which a cell may be entered; below 1 every entry would ask for a hold [-]."""


@dataclass(frozen=True)
class Hold:
    """When the team comes to rest inside its cell, and stays there until the cause is gone.

    Attributes:
        at: Times at which the team is told to hold [s].
        duration: How long it is told so each time [s].
        energy: Largest energy of an axis over the bound with which its cell may be entered; a robot that sees
            more, or that its Delta E is negative, asks for a hold; null for never [-].
        silence: Longest time without a message of a robot, after which the team is held, and of a robot
            without a message of the supervisor, after which it holds by itself and asks for a hold; null to
            wait for ever [s]. Needs a control rate.
    """

    at: tuple[NotNegative, ...] = ()
    duration: Positive = 3.0
    energy: EnergyShare | None = None
    silence: Positive | None = None


@dataclass(frozen=True)
class Control:
    """Additions to the controllers, from what each robot measures and commands itself; no message is needed.

    Attributes:
        predictor: Whether robots compute with the present, predicted from measurements of the known delay
            ``deployment.measurements.delay`` and from their commands since; nothing without a delay.
        observer: Whether robots estimate slow disturbances, such as friction, a slope or a push, and
            compensate them.
        hold: When the team is held; null for never.
    """

    predictor: bool = False
    observer: bool = False
    hold: Hold | None = None
