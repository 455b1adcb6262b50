"""Watching the planner think: what it tells while it searches, as pictures and as a scene in space."""

from coop_drake.watching.film import Film, Strategy, record
from coop_drake.watching.moments import Leaf, Link, Moment, moments
from coop_drake.watching.scene import scene_page, write_scene
from coop_drake.watching.sequence import write_sequence
from coop_drake.watching.storyboard import Shot, storyboard

__all__ = [
    "Film",
    "Leaf",
    "Link",
    "Moment",
    "Shot",
    "Strategy",
    "moments",
    "record",
    "scene_page",
    "storyboard",
    "write_scene",
    "write_sequence",
]
