"""Makes the arrays of a transport for the compiled loop, once for all its runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.plan import Plan
from coop_drake.compiled_loop.arrays import LoopCells, LoopNominal, LoopPlant, LoopTeam
from coop_drake.diagram.robot_controller import (
    RobotKnowledge,
    arrival_goal,
    governed_cells,
    robot_knowledge,
)
from coop_drake.errors import ScenarioError
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.laws.ppc import governed_gains
from coop_drake.laws.words import Schedule
from coop_drake.plant import (
    TeamPlant,
    base_chain,
    build_team_plant,
    read_component_tree,
    read_team_tree,
    robot_chain,
)
from coop_drake.robustness.tracking import allowed_departures
from coop_drake.scenario import Scenario
from coop_drake.simulation.clearance import TeamClearance
from coop_drake.simulation.run import PATIENCE_ALLOWANCE, patience
from coop_drake.systems import axis_laws
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import ComponentTree, axis_levers

_NO_CELLS = np.empty(0)

NO_SCHEDULE = Schedule(0.0, _NO_CELLS, _NO_CELLS, _NO_CELLS, _NO_CELLS, 0.0, 0.0, 0.0, 0.0, 0.0)
"""That of a team that rests in every cell."""


@dataclass(frozen=True)
class CompiledTransport:
    """A scenario, a plan and its maps as the compiled loop needs them; departures are given run by run.

    Attributes:
        scenario: The scenario, with the departures with which it was prepared.
        plan: The plan.
        robot_names: Names of the robots.
        cells: The plan's cells.
        team: The robots' models of themselves, with their true masses.
        plant: The simulated team.
        nominal: The nominal motions, their flow for the scenario's control rate.
        start: State of the team at the plan's start, in the order of the plant.
        order: Where (x, y, theta, q...) stand in it, shape (3 + n,).
        first_axes: Where the M axes of all robots rest at the start.
    """

    scenario: Scenario
    plan: Plan
    robot_names: tuple[str, ...]
    cells: LoopCells
    team: LoopTeam
    plant: LoopPlant
    nominal: LoopNominal
    start: FloatArray
    order: IntArray
    first_axes: FloatArray


def prepare(scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap]) -> CompiledTransport:
    """Make the arrays of a transport.

    Args:
        scenario: The scenario; its team must be sampled.
        plan: A plan for it.
        maps: The harmonic map of every transition.

    Raises:
        PlanError: The plan belongs to another team, or the number of maps is not the number of cells.
        ScenarioError: The models do not make a team, or the compiled loop does not know what the scenario
            wants.
    """
    _check(scenario, passes=plan.motion is not None)
    exact = replace(scenario, deployment=replace(scenario.deployment, mass_error=0.0))
    team = build_team_plant(scenario, DiagramBuilder())
    knowledge = robot_knowledge(exact, plan, maps, team)
    if any(known.robot.has_springs for known in knowledge):
        raise _refusal(scenario, "directives", "a robot with springs", "models without springs")
    tree, models = read_component_tree(team), _robots(team, knowledge)
    axes = _axes([robot.q_slice for robot in team.robots])
    return CompiledTransport(
        scenario,
        plan,
        tuple(robot.name for robot in team.robots),
        _cells(scenario, plan, maps, [robot.q_slice for robot in team.robots]),
        models,
        _plant(scenario, team, tree, models),
        _nominal(plan, team, knowledge),
        team.plant_state(plan.start, np.zeros(len(plan.start))),
        team.position_index,
        plan.start[2:][axes],
    )


def with_gains(transport: CompiledTransport, plan: Plan, maps: Sequence[HarmonicMap]) -> CompiledTransport:
    """Return a transport along the same cells with other gains; neither plan may have a budget."""
    ends = transport.team.first[2].tolist()
    joints = [slice(*ends[k : k + 2]) for k in range(len(transport.robot_names))]
    return replace(transport, plan=plan, cells=_cells(transport.scenario, plan, maps, joints))


def _axes(joints: Sequence[slice]) -> IntArray:
    """Return the axes (theta, q_k) of all robots among (theta, q), shape (M,)."""
    return np.array([i for own in joints for i in (0, *range(1 + own.start, 1 + own.stop))])


def _check(scenario: Scenario, *, passes: bool) -> None:
    """Refuse what does not change from run to run and the loop does not know."""
    control = scenario.control
    for key, found, allowed in (
        ("plant.grasps", scenario.plant.grasps if not scenario.plant.ideal else None, "joints"),
        ("control.predictor", control.predictor or None, "false"),
        ("control.observer", control.observer or None, "false"),
        ("control.hold", None if passes else control.hold, "null"),
    ):
        if found is not None:
            raise _refusal(scenario, key, found, allowed)


def _refusal(scenario: Scenario, key: str, found: object, allowed: str) -> ScenarioError:
    return ScenarioError(
        str(scenario.path),
        key,
        found,
        f"{allowed}: the compiled loop supports only teams with rigid grasps, models without springs, and "
        "controllers without predictor, observer and holds",
    )


def _cells(scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap], joints: Sequence[slice]) -> LoopCells:
    """Return all cells of a plan; ``joints`` says where those of every robot stand in q."""
    cells, stacks = governed_cells(plan, maps), tuple[list[FloatArray], ...](([], [], [], []))
    goals = [arrival_goal(scenario, plan, own) for own in joints]
    for cell, region in zip(cells, plan.cells, strict=True):
        field = (np.empty(0), np.empty(0)) if cell.field is None else cell.field.kernel_arguments
        found = cell.clearance.edges, BoundaryDistance(region.tidied).edges, *field
        for stack, entry in zip(stacks, found, strict=True):
            stack.append(entry)
    first = [np.cumsum([0, *(len(entry) for entry in stack)]) for stack in stacks]
    governed, regions, flats, fields = (np.ascontiguousarray(np.concatenate(stack)) for stack in stacks)
    longest = [
        patience(plan, i) if plan.motion is None else PATIENCE_ALLOWANCE for i in range(len(plan.cells))
    ]
    numbers = [
        [each.inradius, governed_gains(cell.row, 0.0)[0], longest[i]]
        for i, (each, cell) in enumerate(zip(plan.transitions, cells, strict=True))
    ]
    return LoopCells(
        np.array(first, dtype=np.int64),
        np.array([cell.row for cell in cells]),
        governed,
        regions,
        flats,
        fields,
        np.array([law.table for law in axis_laws(plan, list(_axes(joints)))]),
        np.array([[cell.lower for cell in plan.cells], [cell.upper for cell in plan.cells]]),
        np.array(numbers),
        np.concatenate([goal.place for goal in goals]),
        np.concatenate([np.array([goal.tolerances, goal.errors]) for goal in goals], axis=1),
    )


def _robots(team: TeamPlant, knowledge: Sequence[RobotKnowledge]) -> LoopTeam:
    """Return the models of all robots as arrays.

    Args:
        team: The simulated team, one tree rooted at the object.
        knowledge: What every robot knows before the run.
    """
    chains = [robot_chain(known.robot) for known in knowledge]
    bases = [base_chain(team, robot) for robot in team.robots]
    counts = [
        [len(chain) for chain in chains],
        [len(base.chain) for base in bases],
        [robot.q_slice.stop - robot.q_slice.start for robot in team.robots],
    ]
    return LoopTeam(
        places=np.array([team.position_index, team.plant.num_positions() + team.velocity_index]),
        first=np.array([[0, *np.cumsum(row)] for row in counts]),
        chains=np.vstack(chains),
        base_chains=np.vstack([base.chain for base in bases]),
        yaws=np.array([base.yaw for base in bases]),
        loads=np.array([known.load for known in knowledge]),
    )


def _plant(scenario: Scenario, team: TeamPlant, tree: ComponentTree, models: LoopTeam) -> LoopPlant:
    whole = read_team_tree(team, tree)
    clearance = TeamClearance(scenario.workspace.polygon, tree)
    rows = [(0, 0)]
    for k, robot in enumerate(team.robots):
        begin = k + int(models.first[2, k])
        rows.extend((begin + 1 + i, k) for i in range(robot.q_slice.stop - robot.q_slice.start))
    return LoopPlant(
        whole.tree,
        whole.bases,
        whole.places,
        clearance.team,
        clearance.walls,
        np.array(axis_levers(tree)),
        np.array(rows, dtype=np.int64).T.copy(),
        whole.strongest,
    )


def _nominal(plan: Plan, team: TeamPlant, knowledge: Sequence[RobotKnowledge]) -> LoopNominal:
    """Return the nominal motion; its schedule follows from the control rate of a run."""
    motion, stated = plan.motion, np.empty((0, 0))
    if motion is not None and plan.budget is not None and plan.departures is not None:
        stated = allowed_departures(motion, plan.budget, plan.departures)
    monitored = [known.monitored for known in knowledge if known.monitored is not None]
    return LoopNominal(
        NO_SCHEDULE,
        np.empty((0, 0)) if motion is None else np.ascontiguousarray(motion.points),
        0.0 if motion is None else motion.period,
        np.zeros(4) if motion is None else np.ravel(motion.gains),
        0.0,
        np.concatenate([base_chain(team, robot).mounting for robot in team.robots]),
        monitored[0].levels if monitored else np.empty(0),
        monitored[0].unseen if monitored else 0.0,
        np.concatenate([np.empty((3, 0)), *(one.axis_alarms for one in monitored)], axis=1),
        stated,
    )
