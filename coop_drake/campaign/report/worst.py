"""The runs that came nearest to a limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.campaign.report.columns import MARGINS, SHARE, Runs

LISTED = 10
"""Runs that are listed [-]."""


@dataclass(frozen=True)
class WorstRun:
    """A run that was lost, or had little of a margin left.

    Attributes:
        run: Its number in the campaign.
        scenario: Name of the scenario.
        tier: Which loop simulated it.
        seed: Seed of its noise.
        arrived: Whether it arrived.
        reason: Why not; empty if it arrived.
        measure: Name of the margin of which it had least, compared with other runs of its scenario.
        margin: What it had of this, in the unit of the column.
        share: The same over the median of its scenario and tier [-].
        used: Share that it used of what the budget states; NaN without a budget [-].
        values: JSON of the keys that vary.
    """

    run: int
    scenario: str
    tier: str
    seed: int
    arrived: bool
    reason: str
    measure: str
    margin: float
    share: float
    used: float
    values: str


def worst_runs(runs: Runs, count: int = LISTED) -> tuple[WorstRun, ...]:
    """Return lost runs, then those that used more than the budget states, then those with the least margins.

    Margins count relative to the median of their scenario and tier.
    """
    margins = np.array([runs.floats(measure.name) for measure in MARGINS])
    shares = np.full_like(margins, np.inf)
    for _, _, rows in runs.groups:
        for k in range(len(MARGINS)):
            known = margins[k, rows][np.isfinite(margins[k, rows])]
            if known.size and (typical := float(np.median(known))) > 0.0:
                shares[k, rows] = margins[k, rows] / typical
    shares[np.isnan(shares)] = np.inf
    numbers, used = runs.integers("run"), runs.floats(SHARE)
    beyond = np.where(used > 1.0, -used, 0.0)
    order = np.lexsort((numbers, shares.min(axis=0), beyond, ~runs.lost))[:count]
    seeds, found = runs.integers("seed"), []
    for row in order:
        k = int(np.argmin(shares[:, row]))
        known_share = bool(np.isfinite(shares[k, row]))
        found.append(
            WorstRun(
                int(numbers[row]),
                runs.text("scenario", row),
                runs.text("tier", row),
                int(seeds[row]),
                not runs.lost[row],
                runs.text("reason", row),
                MARGINS[k].name if known_share else "",
                float(margins[k, row]) if known_share else float("nan"),
                float(shares[k, row]) if known_share else float("nan"),
                float(used[row]),
                runs.text("values", row),
            )
        )
    return tuple(found)
