"""What a run, a planning question or a search of a campaign leaves: one row of a Parquet file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from math import nan
from typing import TYPE_CHECKING, Any, get_type_hints

from coop_drake.campaign.search.findings import BreakingPoint, Finding

if TYPE_CHECKING:
    import pyarrow


@dataclass(frozen=True)
class RunRecord:
    """One run. Margins are positive where nothing was lost, and NaN where a tier does not compute them.

    Attributes:
        run: Index in the campaign; the tiers' runs of one index have the same values and the same seed.
        scenario: Name of the scenario.
        tier: ``drake`` for the loop of Drake's systems, ``compiled`` for the compiled loop.
        seed: Seed of noise and losses, ``deployment.seed``.
        values: The varied keys and their values, as JSON with sorted keys.
        arrived: Whether the object came to rest at the goal and no invariant was violated.
        reason: Why it did not arrive; empty if it did.
        time: Duration of the transport in simulated time [s].
        steps: Accepted steps of the integrator, or samples of the compiled loop.
        funnel_margin: Smallest distance of an axis to a bound of its funnel [rad or m].
        funnel_axis: Which axis came as near: ``angle`` or a joint's name.
        funnel_cell: In which cell it did.
        cell_margin: Smallest distance of the object's position to the boundary of its cell's region [m].
        wall_clearance: Smallest distance of any body to any wall [m].
        body_clearance: Smallest distance between bodies that must not touch [m].
        budget_share: Largest share used of what the plan's budget states: of the departures of position,
            velocity, axes and their rates from the nominal ones, or the least distance of an axis to its
            funnel's bounds that it states over the one that was kept. NaN for a plan without a budget, and
            where the run does not allow to tell [-].
        peak_force: Largest force of a base [N].
        peak_torque: Largest effort of a joint [N m or N]; NaN for a team without joints.
        held: How often the team was held at rest.
        digest: SHA-256 of what was run: scenario with its values, plan, and versions.
        blocks: Blocks of Drake's loop, ``named`` or ``fused``; empty for the compiled loop and where no run
            could be made.
    """

    run: int
    scenario: str
    tier: str
    seed: int
    values: str
    arrived: bool
    reason: str = ""
    time: float = nan
    steps: int = 0
    funnel_margin: float = nan
    funnel_axis: str = ""
    funnel_cell: int = -1
    cell_margin: float = nan
    wall_clearance: float = nan
    body_clearance: float = nan
    budget_share: float = nan
    peak_force: float = nan
    peak_torque: float = nan
    held: int = 0
    digest: str = ""
    blocks: str = ""


@dataclass(frozen=True)
class QuestionRecord:
    """One planning question. Columns that end in ``_seconds`` were measured, and differ between machines.

    Attributes:
        question: Index in the campaign.
        seed: Seed of the question.
        floor: Kind of floor.
        robots: Number of robots.
        joints: Number of joints of the whole team.
        kind: Shape of the object, and whether any joint slides.
        verdict: ``plan``, ``beyond limits``, ``infeasible``, ``undecided``, or ``failed`` where the planner
            raised an error.
        cpu_seconds: Processor time of the planner [s].
        first_plan_seconds: Processor time until the first plan was certified; NaN if none was [s].
        cells: Cells of the plan.
        verified: Whether the exact checker accepted the answer; false for ``undecided``.
        sampled_margin: Smallest clearance of configurations sampled along the plan; NaN without one [m].
        peer: The other planners that searched for a way; the last one found it if any did. Empty if none did.
        peer_found: Whether one was found.
        peer_seconds: Processor time of the other planners together; NaN if none searched [s].
        reason: Why the question is undecided, beyond limits, or its answer wrong, or that the time limit
            ended the improvement of its plan; else empty.
        corners: Number of corners of the floor.
        width_ratio: Width of the floor's passages over that of the narrowest straight corridor in which the
            team is known to fit; NaN on floors without passages of one width [-].
    """

    question: int
    seed: int
    floor: str
    robots: int
    joints: int
    kind: str
    verdict: str
    cpu_seconds: float = nan
    first_plan_seconds: float = nan
    cells: int = 0
    verified: bool = False
    sampled_margin: float = nan
    peer: str = ""
    peer_found: bool = False
    peer_seconds: float = nan
    reason: str = ""
    corners: int = 0
    width_ratio: float = nan

    @property
    def is_wrong(self) -> bool:
        """Whether the answer is shown to be wrong: refused, refuted by a path, in contact, or an error."""
        if self.verdict == "undecided":
            return False
        refuted = self.verdict == "infeasible" and self.peer_found
        return not self.verified or refuted or self.sampled_margin <= 0.0


Record = RunRecord | QuestionRecord | Finding | BreakingPoint
"""A row of a campaign's results."""

MEASURED = "_seconds"
"""How names of columns end that a second run of the same campaign does not repeat."""


def schema_of(kind: type[Record]) -> pyarrow.Schema:
    """Return the Parquet schema of a kind of record: a column for each field, in their order."""
    import pyarrow

    types = {int: pyarrow.int64(), float: pyarrow.float64(), bool: pyarrow.bool_(), str: pyarrow.string()}
    hints = get_type_hints(kind)
    return pyarrow.schema([(f.name, types[hints[f.name]]) for f in fields(kind)])


def table_of(records: Iterable[Record], kind: type[Record]) -> pyarrow.Table:
    """Return records of one kind as a table."""
    import pyarrow

    schema = schema_of(kind)
    rows = [astuple(record) for record in records]
    columns: list[list[Any]] = [list(column) for column in zip(*rows, strict=True)] or [[] for _ in schema]
    return pyarrow.table(dict(zip(schema.names, columns, strict=True)), schema=schema)
