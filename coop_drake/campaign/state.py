"""How far a campaign is: for every scenario and tier what is done, what was lost, and the least margins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isnan, nan
from typing import Any

import numpy as np

from coop_drake.campaign.batches import Batch
from coop_drake.campaign.results import CampaignFolder
from coop_drake.campaign.settings import Campaign
from coop_drake.campaign.variation import Variation


@dataclass(frozen=True)
class State:
    """Runs of one scenario in one tier.

    Attributes:
        scenario: Name of the scenario.
        tier: The tier.
        runs: How many there shall be.
        done: How many are there.
        lost: How many of these did not arrive.
        funnel_margin: Least distance of an axis to a bound of its funnel, NaN if none is known [rad or m].
        clearance: Least distance to walls and between bodies, NaN if none is known [m].
        budget_share: Largest share used of what the plan's budget states, NaN if none is known [-].
        cpu_seconds: Processor time of a run, with its share of starting processes, NaN if not known [s].
    """

    scenario: str
    tier: str
    runs: int
    done: int
    lost: int
    funnel_margin: float
    clearance: float
    budget_share: float
    cpu_seconds: float

    def facts(self) -> dict[str, Any]:
        """Return all by name; null where nothing is known."""
        content = asdict(self)
        return {key: None if isinstance(v, float) and isnan(v) else v for key, v in content.items()}

    def cells(self) -> tuple[str, ...]:
        """Return a row of a table: distances in rad and m, and seconds."""
        margins = (
            f"{self.funnel_margin:.4f}",
            f"{self.clearance:.4f}",
            f"{100.0 * self.budget_share:.1f} %",
            f"{self.cpu_seconds:.3f}",
        )
        shown = ("" if text.startswith("nan") else text for text in margins)
        return f"{self.scenario}, {self.tier}", str(self.runs), str(self.done), str(self.lost), *shown


def state_of(campaign: Campaign, folder: CampaignFolder, batches: Sequence[Batch]) -> tuple[State, ...]:
    """Return the state of every scenario and tier that a campaign has runs of."""
    rows = []
    for key in dict.fromkeys((batch.scenario, batch.tier) for batch in batches):
        mine = [batch for batch in batches if (batch.scenario, batch.tier) == key]
        table = folder.table(mine)
        column = {name: table.column(name).to_numpy() for name in _COLUMNS}
        rows.append(
            State(
                Variation(campaign).scenarios[key[0]].name,
                key[1],
                sum(batch.stop - batch.first for batch in mine),
                table.num_rows,
                int((~column["arrived"]).sum()),
                _least(column["funnel_margin"]),
                _least(np.concatenate([column[name] for name in _CLEARANCES])),
                -_least(-column["budget_share"]),
                folder.cpu_seconds(mine),
            )
        )
    return tuple(rows)


_CLEARANCES = ("wall_clearance", "body_clearance")
_COLUMNS = ("funnel_margin", "arrived", "budget_share", *_CLEARANCES)


def _least(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.min()) if known.size else nan
