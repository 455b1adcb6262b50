"""The log of a run as an animation of bodies, arrows, cells and the object's trail."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import MeshcatAnimation
from pydrake.math import RigidTransform

from coop_drake.answers.log import SimulationLog
from coop_drake.progress import Progress
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.animation_tracks import Tracks
from coop_drake.viz.arrows import ABOVE, arrow_path, arrow_sizes
from coop_drake.viz.cells import cell_paths
from coop_drake.viz.scene import TransportScene
from coop_drake.viz.trail import INDICES, set_trail, trail_points

_TRAIL = "/motion/trail"
_ARROW_ANGLE = 0.06
"""Largest error of an arrow's direction [rad]: arrows turn fast where forces are small."""


def animation_of(
    scene: TransportScene, log: SimulationLog, times: FloatArray, progress: Progress | None
) -> MeshcatAnimation:
    """Return the tracks of all that moves, appears or grows; the trail is put into the scene.

    ``times`` are those of the frames, evenly spaced, shape (F,) [s].
    """
    tracks = Tracks(1.0 / (times[1] - times[0]) if len(times) > 1 else 1.0)
    states = np.hstack([log.object_pose, log.joints])
    grasps = _add_bodies(tracks, scene, _at_times(log, states, times), progress)
    _add_arrows(tracks, scene, log, times, grasps)
    _add_trail(tracks, scene, _at_times(log, log.object_pose[:, :2], times))
    rows = np.searchsorted(log.times, times, side="right") - 1
    for index in np.unique(log.cell_index):
        for path in cell_paths(int(index)):
            tracks.show(path, log.cell_index[rows] == index)
    return tracks.animation


def _at_times(log: SimulationLog, values: FloatArray, times: FloatArray) -> FloatArray:
    """Return logged values of shape (T, k), interpolated at times of shape (F,): shape (F, k)."""
    return np.column_stack([np.interp(times, log.times, column) for column in values.T])


def _add_bodies(
    tracks: Tracks, scene: TransportScene, configurations: FloatArray, progress: Progress | None
) -> FloatArray:
    """Move every body; return the positions of the grasps, shape (F, N, 3) [m]."""
    poses, grasps = [], []
    for frame, z in enumerate(configurations):
        poses.append(scene.team.poses(z))
        grasps.append(scene.team.grasp_points(z))
        if progress and frame % 50 == 0:
            progress("recording", frame / len(configurations))
    for body, paths in enumerate(scene.team.paths):
        own = [at_frame[body] for at_frame in poses]
        positions, angles = np.array([X_WB.translation() for X_WB in own]), _turns(own)
        for path in paths:
            tracks.move(path, positions, angles, own[0].rotation())
    if progress:
        progress("recording", 1.0)
    return np.array(grasps)


def _turns(poses: list[RigidTransform]) -> FloatArray:
    """Return the angles about the vertical since the first pose, unwrapped, shape (F,) [rad]."""
    R_0 = poses[0].rotation().inverse()
    turns = [(X_WB.rotation() @ R_0).matrix() for X_WB in poses]
    return np.unwrap([np.arctan2(turn[1, 0], turn[0, 0]) for turn in turns])


def _add_arrows(
    tracks: Tracks, scene: TransportScene, log: SimulationLog, times: FloatArray, grasps: FloatArray
) -> None:
    for index in range(len(log.robot_names)):
        forces = _at_times(log, log.measured_wrenches[:, index, :2], times)
        directions, scales = arrow_sizes(forces, scene.of_a_metre)
        path = arrow_path(index)
        tracks.move(path, grasps[:, index] + ABOVE, directions, angle_tolerance=_ARROW_ANGLE)
        tracks.vary(path, "scale", scales)


def _add_trail(tracks: Tracks, scene: TransportScene, positions: NDArray[np.float64]) -> None:
    points, behind = trail_points(positions)
    if len(points) > 1:
        set_trail(scene.meshcat, _TRAIL, points)
        tracks.count(f"{_TRAIL}/<object>", "geometry[drawRange].count", INDICES * behind)
