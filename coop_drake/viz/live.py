"""The live view: shows a run in a browser while it is simulated, no faster than in reality."""

from __future__ import annotations

from time import monotonic, sleep

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix

from coop_drake.answers.plan import Plan
from coop_drake.scenario import Scenario
from coop_drake.simulation import Sample
from coop_drake.viz.arrows import ABOVE, arrow_path, arrow_sizes
from coop_drake.viz.cells import cell_paths
from coop_drake.viz.scene import TransportScene
from coop_drake.viz.trail import STEP, set_trail

_FRAMES_PER_SECOND = 25.0
"""Steps shown per simulated second [1/s]: motion looks smooth."""


class LiveView:
    """An observer of ``simulate``: it shows accepted steps and changes nothing.

    Args:
        scenario: What is simulated.
        plan: What is executed.
        meshcat: Where it is shown; ``meshcat.web_url()`` is its address.
        rate: Greatest ratio of simulated time to real time; infinite not to wait at all.

    Attributes:
        scene: What is shown.
    """

    def __init__(self, scenario: Scenario, plan: Plan, meshcat: Meshcat, *, rate: float = 1.0) -> None:
        self.scene = TransportScene(scenario, plan, meshcat)
        self.scene.place_camera()
        self._rate = rate
        self._began: float | None = None
        self._next, self._cell, self._pieces = 0.0, 0, 0
        self._trail = [plan.start[:2].copy()]

    def wait_for_viewer(self, seconds: float) -> bool:
        """Wait for a browser to connect, perhaps for ever; return whether one did."""
        until = monotonic() + seconds
        while self.scene.meshcat.GetNumActiveConnections() == 0 and monotonic() < until:
            sleep(0.1)
        self.scene.meshcat.Flush()
        return bool(self.scene.meshcat.GetNumActiveConnections())

    def __call__(self, sample: Sample) -> None:
        """Show one step, unless another one was shown less than a frame before."""
        if sample.time < self._next and not sample.arrived:
            return
        self._next = sample.time + 1.0 / _FRAMES_PER_SECOND
        self._keep_pace(sample.time)
        self.scene.team.show(sample.z)
        self._show_cell(sample.cell)
        self._show_forces(sample)
        self._show_trail(sample.z[:2])

    def _keep_pace(self, time: float) -> None:
        if self._began is None:
            self._began = monotonic() - time / self._rate
        ahead = time / self._rate - (monotonic() - self._began)
        if ahead > 0.0:
            sleep(ahead)

    def _show_cell(self, cell: int) -> None:
        if cell == self._cell:  # Hiding and showing it again would make it flicker.
            return
        for index, visible in ((self._cell, False), (cell, True)):
            for path in cell_paths(index):
                self.scene.meshcat.SetProperty(path, "visible", visible)
        self._cell = cell

    def _show_forces(self, sample: Sample) -> None:
        meshcat, grasps = self.scene.meshcat, self.scene.team.grasp_points(sample.z)
        for index, wrench in enumerate(sample.measured_wrenches):
            path = arrow_path(index)
            sizes = arrow_sizes(wrench[None, :2], self.scene.of_a_metre)
            direction, scales = (value[0] for value in sizes)
            R_WA = RotationMatrix.MakeZRotation(direction)
            meshcat.SetTransform(path, RigidTransform(R_WA, grasps[index] + ABOVE))
            meshcat.SetProperty(path, "scale", scales.tolist())

    def _show_trail(self, position: np.ndarray) -> None:
        if np.linalg.norm(position - self._trail[-1]) < STEP:
            return
        self._trail.append(position.copy())
        set_trail(self.scene.meshcat, f"/motion/trail/{self._pieces:05d}", np.array(self._trail[-2:]))
        self._pieces += 1
