"""Watching the planner search: the events of a search, as pictures and as a scene in space."""

from coop_drake.watching.keyframes import Keyframe, keyframes
from coop_drake.watching.pictures import keyframe_figure, write_pictures
from coop_drake.watching.recording import SearchRecording, Strategy, record_search
from coop_drake.watching.scene import scene_page, write_scene
from coop_drake.watching.search_states import ChannelCell, Leaf, SearchState, search_states

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
