"""Which statements of a log are false at some rows, decided by the functions of the product and by Drake.

The checker of logs shares no computation with these: geometry, funnels, reports and mechanics are its own.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.tree import MultibodyForces
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.laws import funnel_bounds, total_wrench
from coop_drake.laws.axis_table import axis_table
from coop_drake.laws.ppc import governed_gains
from coop_drake.plant import base_poses, build_team_plant, planning_problem, set_configuration
from coop_drake.scenario import Scenario
from coop_drake.simulation import Invariants, TeamClearance
from coop_drake.simulation.telemetry import Sample
from coop_drake.systems.kernels import NOTHING, cell_margin, ready_conditions, robot_ready

CLOSE = 2e-6
"""Numbers that differ by less are the same here; the checker's tolerances are smaller [-, m, rad, N]."""


class RunOracle:
    """Decides about logs of one ideal run.

    Args:
        scenario: The scenario.
        plan: The plan.
    """

    def __init__(self, scenario: Scenario, plan: Plan) -> None:
        self.plan, self.problem = plan, planning_problem(scenario)
        self.team = build_team_plant(scenario, DiagramBuilder())
        self.context = self.team.plant.CreateDefaultContext()
        self.grasps = np.array([[robot.X_LE.x, robot.X_LE.y] for robot in self.team.robots])
        self.invariants = Invariants(TeamClearance(self.problem.workspace, self.problem.tree), plan)
        self.edges = [BoundaryDistance(cell.tidied).edges for cell in plan.cells]
        gains = [transition.gains for transition in plan.transitions]
        self.rows = [own.governor_row(before) for own, before in zip(gains, [gains[0], *gains], strict=False)]
        self.tables = [axis_table(plan.funnel(k), t.gains) for k, t in enumerate(plan.transitions)]

    def false_at(self, log: SimulationLog, row: int) -> list[str]:
        """The statements that are false because of what stands in a row, also about its neighbours."""
        if not all(
            np.isfinite(getattr(log, f.name)[row]).all()
            for f in fields(log)
            if np.ndim(getattr(log, f.name)) and np.asarray(getattr(log, f.name)).dtype.kind == "f"
        ):
            return ["a number is not finite"]
        if not 0 <= log.cell_index[row] < len(self.plan.cells):
            return ["there is no such cell"]
        steps = [i for i in (row - 1, row) if 0 <= i < len(log.times) - 1]
        found = [name for i in steps for name in self._between(log, i)]
        found += [name for name, wrong in self._at(log, row).items() if wrong]
        return found + self._ends(log)

    def _between(self, log: SimulationLog, i: int) -> list[str]:
        found = []
        if not log.times[i + 1] > log.times[i]:
            found.append("time passes")
        if not log.cell_index[i] <= log.cell_index[i + 1] <= log.cell_index[i] + 1:
            found.append("cells follow one another")
        entered = log.cell_index[i + 1] != log.cell_index[i]
        if log.transition_start[i + 1] != (log.times[i] if entered else log.transition_start[i]):
            found.append("a cell's time of entry is that of its row")
        if entered != bool((log.ready_margins[i] >= 0.0).all()):
            found.append("a cell is left when all robots are ready")
        h = log.times[i + 1] - log.times[i]
        z, rates = (
            np.hstack(pair) for pair in ((log.object_pose, log.joints), (log.object_twist, log.joint_rates))
        )
        near = np.abs(log.accelerations[max(i - 1, 0) : i + 3]).max(axis=0)
        bound = np.maximum(3.0 * near, 0.02 * np.abs(log.accelerations).max(axis=0))
        if (np.abs(rates[i + 1] - rates[i]) > h * bound + CLOSE).any():
            found.append("rates change as accelerations allow")
        if (
            np.abs(z[i + 1] - z[i] - 0.5 * h * (rates[i] + rates[i + 1])) > 0.25 * h * h * bound + CLOSE
        ).any():
            found.append("positions change as rates say")
        return found

    def _at(self, log: SimulationLog, i: int) -> dict[str, bool]:
        k, z = int(log.cell_index[i]), np.concatenate([log.object_pose[i], log.joints[i]])
        rates = np.concatenate([log.object_twist[i], log.joint_rates[i]])
        margins = self.invariants.check(_sample(log, i, z, rates))
        time = log.times[i] - log.transition_start[i]
        bounds = funnel_bounds(self.plan.funnel(k), time - log.clock_lag[i])
        state = np.concatenate([z[:3], rates[:3]])
        stiffness = governed_gains(self.rows[k], time)[0]
        energy = cell_margin(self.edges[k], stiffness, state, log.governor_position[i])
        wrong = {
            f"{name} is the measured one": _differs(getattr(log, name)[i], getattr(margins, name))
            for name in (
                "workspace_clearance",
                "body_clearance",
                "cell_clearance",
                "funnel_margin",
                "slice_margin",
                "wrench_error",
            )
        }
        wrench = total_wrench(log.commanded_wrenches[i], self.grasps, self.team.object_inertia.p_LLcm, z[2])
        return wrong | {
            f"no invariant is broken: {margins.violation}": bool(margins.violation),
            "the lower funnel bounds are the plan's": _differs(log.funnel_lower[i], bounds.lower),
            "the upper funnel bounds are the plan's": _differs(log.funnel_upper[i], bounds.upper),
            "Delta E is that of the state": _differs(log.energy_margin[i], energy),
            "the team is never held": _differs([log.held[i], log.clock_lag[i]], 0.0),
            "all robots have one p_G": _differs(log.governor_spread[i], 0.0),
            "reports are those of the state": _differs(
                log.ready_margins[i], self._reports(k, time, z, rates, log.governor_position[i])
            ),
            "grasps are rigid": _differs(log.grasp_error[i], 0.0),
            "the object's wrench is the sum of the shares": _differs(log.object_wrench[i], wrench),
            "bases are where the joints put them": self._bases_differ(log.base_poses[i], z),
            "efforts go with the motion": self._efforts_differ(log, i, z, rates),
        }

    def _ends(self, log: SimulationLog) -> list[str]:
        first = np.concatenate([log.object_pose[0], log.joints[0], log.governor_position[0]])
        rates = np.concatenate([log.object_twist[0], log.joint_rates[0]])
        tolerance = self.problem.position_tolerance
        away = np.hypot(*(log.object_pose[-1, :2] - self.plan.goal_pose[:2]))
        turned = abs(log.object_pose[-1, 2] - self.plan.goal_pose[2])
        starts = np.concatenate([self.plan.start, self.plan.start[:2]])
        ends = {
            "the run begins at the start": np.abs(first - starts).max() > 1e-9
            or log.times[0] != 0.0
            or log.cell_index[0] != 0,
            "the run begins at rest": np.abs(rates).max() > 1e-9,
            "the first cell is entered at the beginning": log.transition_start[0] != 0.0,
            "the run ends at the goal": away > tolerance or turned > self.problem.angle_tolerance,
            "the run ends in the last cell": log.cell_index[-1] != len(self.plan.cells) - 1,
            "all robots report arrival": bool((log.ready_margins[-1] < 0.0).any()),
        }
        return [name for name, wrong in ends.items() if wrong]

    def _reports(
        self, k: int, time: float, z: np.ndarray, rates: np.ndarray, governor: np.ndarray
    ) -> list[float]:
        reports, state = [], np.concatenate([z[:3], rates[:3]])
        for robot in self.team.robots:
            axes = [0, *range(1 + robot.q_slice.start, 1 + robot.q_slice.stop)]
            conditions = ready_conditions(
                [table[axes] for table in self.tables], self.edges, self.rows,
                [transition.inradius for transition in self.plan.transitions], self.plan.goal_pose[:2],
                self.problem.position_tolerance,
            )  # fmt: skip
            own = np.concatenate([np.zeros(3), z[3:][robot.q_slice], np.zeros(3), rates[3:][robot.q_slice]])
            reports.append(robot_ready(*conditions[k], time, state, own, governor, NOTHING))
        return reports

    def _bases_differ(self, stated: np.ndarray, z: np.ndarray) -> bool:
        set_configuration(self.team, self.context, z)
        difference = stated - np.array(base_poses(self.team, self.context))
        difference[:, 2] = np.remainder(difference[:, 2] + np.pi, 2.0 * np.pi) - np.pi
        return bool(np.abs(difference).max() > CLOSE)

    def _efforts_differ(self, log: SimulationLog, i: int, z: np.ndarray, rates: np.ndarray) -> bool:
        plant, context = self.team.plant, self.context
        plant.SetPositionsAndVelocities(context, self.team.plant_state(z, rates))
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        for robot, (fx, fy, torque) in zip(self.team.robots, log.base_wrenches[i], strict=True):
            robot.base_body.AddInForceInWorld(
                context, SpatialForce([0.0, 0.0, torque], [fx, fy, 0.0]), forces
            )
        needed = plant.CalcInverseDynamics(
            context, _scattered(log.accelerations[i], self.team.velocity_index), forces
        )
        expected = np.concatenate([np.zeros(3), log.joint_torques[i]])
        return bool(np.abs(needed[self.team.velocity_index] - expected).max() > 10.0 * CLOSE)


def _sample(log: SimulationLog, i: int, z: np.ndarray, rates: np.ndarray) -> Sample:
    names = {field.name for field in fields(Sample)} & {field.name for field in fields(log)}
    arrays = {name: getattr(log, name)[i] for name in names}
    return Sample(
        time=log.times[i],
        cell=int(log.cell_index[i]),
        entry=log.transition_start[i],
        z=z,
        rates=rates,
        causes=np.zeros(0),
        alarms=np.zeros((0, 3)),
        arrived=False,
        **arrays,
    )


def _scattered(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    result = np.zeros(len(values))
    result[places] = values
    return result


def _differs(stated: object, expected: object) -> bool:
    difference = np.abs(np.asarray(stated, dtype=float) - np.asarray(expected, dtype=float))
    return bool((difference > CLOSE * (1.0 + np.abs(np.asarray(expected)))).any())
