"""A disturbance observer: what accelerates the object and the joints beside the commands."""

from __future__ import annotations

from coop_drake.tree.pose import FloatArray

PHASE = 0.15
"""The observer's gain times the age of commands [rad]: the age turns the observer's loop by as much, less
than half of the phase that scheduled gains leave to the age."""

FASTEST = 20.0
"""Largest gain of the observer [1/s]: noise of 0.01/s in a rate makes 0.2/s^2 in its estimate."""

LEAK = 0.2
"""Leak over gain [-]: one sixth of a constant disturbance stays. Without a leak, estimates of different
robots would drift apart, which a rigid team does not feel but as forces inside the object."""


def observer_gains(age: float) -> tuple[float, float]:
    """Return the gain l and the leak of ``observe`` for an age of commands [1/s].

    Args:
        age: Mean age of the measurements on which an effort rests [s].
    """
    gain = min(PHASE / age, FASTEST) if age > 0.0 else FASTEST
    return gain, LEAK * gain


def observe(
    rates: FloatArray,
    wanted: FloatArray,
    state: FloatArray,
    gain: float,
    leak: float,
    state_rate: FloatArray,
    disturbance: FloatArray,
) -> None:
    """Write the estimate of the acceleration d that acts beside the command, and the observer's rate.

    With the rate v of a coordinate, the acceleration u that the law wants, and the observer's state z,

        d^ = l (v - z),    z' = u + g (v - z),

    and the command u - d^, the coordinate has v' = u - d^ + d, so that d^' = l (d - d^) - g d^: whatever the
    law is, d^ tends to d l / (l + g) like exp(-(l + g) t), and the law is left with the rest.

    Args:
        rates: v of every coordinate, shape (m,) [m/s or rad/s].
        wanted: u of every coordinate, shape (m,) [m/s^2 or rad/s^2].
        state: z of every coordinate, shape (m,) [m/s or rad/s].
        gain: l [1/s].
        leak: g [1/s].
        state_rate: Receives z', shape (m,).
        disturbance: Receives d^, shape (m,) [m/s^2 or rad/s^2].
    """
    ahead = rates - state
    state_rate[:] = wanted + leak * ahead
    disturbance[:] = gain * ahead
