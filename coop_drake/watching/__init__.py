"""Watching the planner think: what it tells while it searches, as pictures and as a scene in space."""

from coop_drake.watching.film import Film, Strategy, record
from coop_drake.watching.frames import frame_figure
from coop_drake.watching.moments import Leaf, Link, Moment, moments
from coop_drake.watching.scene import scene_page, write_scene
from coop_drake.watching.sequence import write_sequence
from coop_drake.watching.slice_view import slice_figure
from coop_drake.watching.storyboard import Shot, storyboard

__all__ = [
    "Film",
    "Leaf",
    "Link",
    "Moment",
    "Shot",
    "Strategy",
    "frame_figure",
    "moments",
    "record",
    "scene_page",
    "slice_figure",
    "storyboard",
    "write_scene",
    "write_sequence",
]
