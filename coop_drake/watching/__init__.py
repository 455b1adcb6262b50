"""Watching the planner search: the events of a search, as pictures and as a scene in space."""

from coop_drake.watching.keyframes import Keyframe, keyframes
from coop_drake.watching.pictures import keyframe_figure, write_pictures
from coop_drake.watching.recording import (
    ChannelCell,
    Leaf,
    SearchRecording,
    SearchState,
    Strategy,
    record_search,
    search_states,
)
from coop_drake.watching.scene import scene_page, write_scene

__all__ = [
    "ChannelCell",
    "Keyframe",
    "Leaf",
    "SearchRecording",
    "SearchState",
    "Strategy",
    "keyframe_figure",
    "keyframes",
    "record_search",
    "scene_page",
    "search_states",
    "write_pictures",
    "write_scene",
]
