"""What robots compute beside the law of the paper."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Control:
    """Additions to the controllers, from what each robot measures and commands itself; no message is needed.

    Attributes:
        predictor: Whether robots compute with the present, predicted from measurements of the known delay
            ``deployment.measurements.delay`` and from their commands since; nothing without a delay.
        observer: Whether robots estimate slow disturbances, such as friction, a slope or a push, and
            compensate them.
    """

    predictor: bool = False
    observer: bool = False
