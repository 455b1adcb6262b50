"""A team as one chain whose root is the object, from its tree and the masses of its bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.laws.chain_motion import (
    COLUMNS,
    COM_X,
    COM_Y,
    INERTIA,
    MASS,
    PARENT,
    POSITION,
    RATE,
    ROTOR,
    SLIDE_X,
    SLIDE_Y,
    TURN,
    X,
    Y,
)
from coop_drake.tree.component_tree import Bodies, ComponentTree
from coop_drake.tree.pose import FloatArray, PlanarPose


def team_chain(tree: ComponentTree, bodies: Bodies, rotors: Sequence[float]) -> FloatArray:
    """Return the team as a chain of ``laws/chain_motion.py``; its state is (x, y, theta, q...) and rates.

    Args:
        tree: The team.
        bodies: All bodies.
        rotors: Inertia that its rotor adds to every joint, shape (n,), or empty for none [kg m^2 or kg].
    """
    chain, size, frames = np.zeros((len(tree.components), COLUMNS)), 3 + len(tree.joints), frames_of(tree)
    chain[0, RATE] = size
    for row, component in zip(chain[1:], tree.components[1:], strict=True):
        joint, parent = component.joint, component.parent
        assert joint is not None
        assert parent is not None
        frame = frames[parent] @ joint.X_PJ
        row[[PARENT, X, Y]] = parent, frame.x, frame.y
        row[[POSITION, RATE]] = 3 + joint.index, size + 3 + joint.index
        row[ROTOR] = rotors[joint.index] if len(rotors) else 0.0
        if joint.kind == "revolute":
            row[TURN] = joint.sign
        else:
            row[[SLIDE_X, SLIDE_Y]] = PlanarPose(angle=frame.angle).apply(np.array(joint.axis))
    for body in bodies:
        _add_body(chain[int(body[0])], frames[int(body[0])].apply(np.array(body[2:4])), body[1], body[4])
    return chain


def frames_of(tree: ComponentTree) -> list[PlanarPose]:
    """Return the pose of every component's frame in that of the object, with all joints at zero."""
    frames = [PlanarPose()]
    for component in tree.components[1:]:
        assert component.joint is not None
        assert component.parent is not None
        frames.append(frames[component.parent] @ component.joint.X_PJ)
    return frames


def _add_body(row: FloatArray, centre: FloatArray, mass: float, inertia: float) -> None:
    """Add a body to a link: the centre of mass of both, and their inertia about it."""
    both = row[MASS] + mass
    away = centre - row[[COM_X, COM_Y]]
    row[INERTIA] += inertia + row[MASS] * mass / both * (away @ away)
    row[[COM_X, COM_Y]] += mass / both * away
    row[MASS] = both
