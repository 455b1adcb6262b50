"""What a run of a campaign leaves: one row of a Parquet file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from math import nan
from typing import TYPE_CHECKING, Any, get_type_hints

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


Record = Any
"""A row of a file of results: a frozen dataclass of numbers and texts, such as `RunRecord`."""


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
