"""The scene: the stacked configuration space over the floor, moment by moment, in Meshcat."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from meshcat.animation import Animation

from coop_drake.files import write_atomically
from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.tree.pose import FloatArray
from coop_drake.watching import look
from coop_drake.watching.film import Film
from coop_drake.watching.meshes import joined, prism, tube
from coop_drake.watching.props import Paint, place, put_stage, stage_labels
from coop_drake.watching.space import Space
from coop_drake.watching.stack import THETA, Matter, Slab, on_turn, stack
from coop_drake.watching.storyboard import Shot
from coop_drake.watching.way import Leg
from coop_drake.watching.window import offline_visualizer

__all__ = ["scene_page", "write_scene"]

Progress = Callable[[str, float], None]

_RATE = 4  # Moments a second.
_GAP = 0.06  # Share of a slab's thickness that is left open, so that layers show.
_COARSE = (0.002, 0.004, 0.008, 0.016)  # What outlines may move by, as shares of the floor.
_MOST_BYTES = 5_500_000
_LINE = 0.006  # Radius of the channel's line, as another.
_PAINTS = {
    Matter.FREE: Paint(look.FREE, 0.9),
    Matter.UNDECIDED: Paint(look.MIXED, 0.05, lit=False),
    Matter.CHANNEL: Paint(look.FREE, 0.55),
    Matter.REACHED: Paint(look.REACHED, 0.5),
    Matter.OTHERS: Paint(look.OTHERS, 0.5),
}
_KEY = (
    (look.FREE, "proved free for some choice of the joints"),
    (look.MIXED, "undecided"),
    (look.CHANNEL, "channel, proved; frame: halved now"),
    (look.OPEN_CHANNEL, "channel, undecided"),
)
_PARTS_KEY = (
    (look.REACHED, "at the end: may be reached from the start"),
    (look.OTHERS, "at the end: cannot be reached"),
)
_NOTE = (
    "Floor below, the object's angle θ upwards. Joints have no direction here: "
    "a place is solid or haze if any of their values makes it so."
)


def write_scene(film: Film, shots: Sequence[Shot], path: Path, progress: Progress | None = None) -> Path:
    """Write the scene as one self-contained HTML page; an interrupted write leaves no file behind."""
    return write_atomically(path, scene_page(film, shots, progress).encode())


def scene_page(film: Film, shots: Sequence[Shot], progress: Progress | None = None) -> str:
    """The page: positions and theta in space, with play, pause and a slider over the moments.

    Outlines are straightened as far as it takes to keep the page small.

    Args:
        film: The film.
        shots: Its moments.
        progress: Called with a text and the fraction done.
    """
    slabs = sorted(stack(shots), key=_when)
    page = ""
    for number, coarse in enumerate(_COARSE):
        if progress is not None:
            progress("slabs", number / len(_COARSE))
        page = _page(film, shots, slabs, coarse)
        if len(page) <= _MOST_BYTES:
            break
    return page


def _page(film: Film, shots: Sequence[Shot], slabs: Sequence[Slab], coarse: float) -> str:
    space = Space(film.problem.workspace)
    parted = any(shot.parts is not None for shot in shots)
    story = {
        "rate": _RATE,
        "shots": [{"headline": shot.headline, "counters": shot.counters} for shot in shots],
        "key": [*_KEY, *(_PARTS_KEY if parted else ())],
        "note": _NOTE,
        "labels": stage_labels(film, space),
        "camera": space.camera(),
    }
    vis = offline_visualizer("Watching the planner think", story)["/think"]
    put_stage(vis, film, space)
    seen = _Seen(len(shots))
    for _, group in groupby(slabs, key=_when):
        _put_slabs(vis, list(group), space, seen, coarse)
    _put_channels(vis, shots, space, seen)
    _put_frames(vis, shots, space, seen)
    vis.set_animation(seen.animation)
    page: str = vis.static_html()
    return page


def _when(slab: Slab) -> tuple[str, int, int]:
    """What slabs of one object have in common."""
    return slab.matter.value, slab.first, slab.last


class _Seen:
    """The animation: which objects are visible during which shots.

    Args:
        shots: How many there are.
    """

    def __init__(self, shots: int) -> None:
        self.animation = Animation(default_framerate=_RATE)
        self._shots = shots

    def during(self, vis: Any, first: int, last: int) -> None:
        """Show an object from the first to the last of some shots, and never else."""
        shown = {0: first == 0, first: True, last + 1: False}
        # Every track lasts as long as the film: a shorter one would stop before the slider does.
        shown[self._shots] = last == self._shots - 1
        for frame, value in sorted(shown.items()):
            self.animation.at_frame(vis, frame).set_property("visible", "boolean", value)


def _put_slabs(vis: Any, slabs: Sequence[Slab], space: Space, seen: _Seen, coarse: float) -> None:
    vertices, faces = joined(
        prism(slab.section, *space.layer(slab.theta, _GAP), coarse=coarse * space.extent) for slab in slabs
    )
    matter, first, last = _when(slabs[0])
    own = vis[f"{matter}/{first + 1:03d}-{last + 1:03d}"]
    place(own, (space.flat(vertices), faces), _PAINTS[slabs[0].matter])
    seen.during(own, first, last)


def _put_channels(vis: Any, shots: Sequence[Shot], space: Space, seen: _Seen) -> None:
    """Put up the line through every channel, its proved and its undecided stretches apart."""
    radius = _LINE * space.extent * space.scale
    numbers = range(len(shots))
    for _, group in groupby(numbers, key=lambda number: id(shots[number].legs)):
        during = list(group)
        for name, proved, colour in (("proved", True, look.CHANNEL), ("undecided", False, look.OPEN_CHANNEL)):
            legs = [leg for leg in shots[during[0]].legs if (leg.kind is Kind.FREE) == proved]
            mesh = joined(tube(_line(leg, space), radius) for leg in legs)
            if len(mesh[0]):
                own = vis[f"channel/{name}/{during[0] + 1:03d}-{during[-1] + 1:03d}"]
                place(own, mesh, Paint(colour, lit=False, hidden=False))
                seen.during(own, during[0], during[-1])


def _line(leg: Leg, space: Space) -> FloatArray:
    """Points along a leg, broken with NaN where theta passes the end of the turn drawn."""
    theta = THETA[0] + np.mod(leg.angles[:, 0] - THETA[0], 2.0 * pi)
    points = space.points(leg.positions, theta)
    jumps = np.flatnonzero(np.abs(np.diff(theta)) > pi) + 1
    return np.insert(points, jumps, np.nan, axis=0)


def _put_frames(vis: Any, shots: Sequence[Shot], space: Space, seen: _Seen) -> None:
    """Put a frame round the layer of theta that was halved last."""
    radius = 0.25 * _LINE * space.extent * space.scale
    outline = space.outline()
    for number, shot in enumerate(shots):
        if not shot.moment.splits or shot.moment.verdict is not None:
            continue
        theta = on_turn(shot.moment.splits[-1][0].intervals[0])[0]
        heights = space.layer(theta, 0.0)
        rings = [np.column_stack([outline, np.full(len(outline), height)]) for height in heights]
        posts = [np.array([[*corner, height] for height in heights]) for corner in outline[:-1]]
        own = vis[f"looked_at/{number + 1:03d}-{number + 1:03d}"]
        place(own, joined(tube(line, radius) for line in (*rings, *posts)), Paint(look.LOOKED_AT))
        seen.during(own, number, number)
