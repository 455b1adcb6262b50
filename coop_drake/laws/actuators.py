"""How the efforts of actuators follow what is asked of them."""

from __future__ import annotations

from math import copysign, exp, hypot, inf

from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray


@compiled(borrows=True)
def limit_efforts(limits: FloatArray, efforts: FloatArray) -> None:
    """Cut the efforts of one robot to what its actuators can give; a base's force keeps its direction.

    Args:
        limits: Largest length of the base's force, largest torque, largest efforts of the joints, (2 + n,).
        efforts: Base wrench and joint torques, shape (3 + n,) [N, N m]; those that are too large change.
    """
    if hypot(efforts[0], efforts[1]) > limits[0]:
        largest = max(abs(efforts[0]), abs(efforts[1]))
        for i in range(2):  # a lost run may ask for infinite forces
            finite = efforts[i] / largest if largest < inf else 0.0
            efforts[i] = copysign(1.0, efforts[i]) if abs(efforts[i]) == inf else finite
        shorter = limits[0] / hypot(efforts[0], efforts[1])
        efforts[0] *= shorter
        efforts[1] *= shorter
    for i in range(1, limits.size):
        efforts[1 + i] = min(max(efforts[1 + i], -limits[i]), limits[i])


@compiled(borrows=True)
def lag_behind(lag: float, elapsed: float, held: FloatArray, before: FloatArray, given: FloatArray) -> None:
    """Write the efforts of actuators that are first-order low passes: y = u + exp(-t / T) (y_0 - u).

    The formula is exact where the effort asked for is held.

    Args:
        lag: Time constant T [s]; 0 for actuators that follow at once.
        elapsed: Time t since ``before`` acted [s].
        held: Efforts u that are asked for since then, shape (m,) [N, N m].
        before: Efforts y_0 that acted then, shape (m,).
        given: Receives the efforts y that act now, shape (m,).
    """
    left = exp(-elapsed / lag) if lag > 0.0 else 0.0
    for i in range(held.size):
        given[i] = held[i] + left * (before[i] - held[i])
