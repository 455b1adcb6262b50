"""The record of a run of Drake's loop, measured from its log."""

from __future__ import annotations

from contextlib import suppress
from math import nan

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.campaign.records import RunRecord
from coop_drake.campaign.variation import Run
from coop_drake.errors import RefusalError
from coop_drake.tuning.objective import CRITERIA
from coop_drake.verification.runs import Rows, budget_share


def record_of_log(run: Run, scenario: str, log: SimulationLog, plan: Plan, digest: str) -> RunRecord:
    """Return the record of a run by Drake's loop.

    Args:
        run: The run.
        scenario: Name of its scenario.
        log: Its log.
        plan: The plan that it followed.
        digest: Digest of what was run.
    """
    arrived = log.reached and not log.violation
    axes = np.column_stack([log.object_pose[:, 2], log.joints])
    kept = np.minimum(axes - log.funnel_lower, log.funnel_upper - axes)
    row, axis = np.unravel_index(np.argmin(kept), kept.shape)
    share = nan
    with suppress(RefusalError):  # A run that was lost may lack samples.
        share = budget_share(Rows(log, plan))
    return RunRecord(
        run=run.index,
        scenario=scenario,
        tier="drake",
        seed=run.seed,
        values=run.text,
        arrived=arrived,
        reason="" if arrived else log.violation or "the goal was not reached",
        time=float(log.times[-1]),
        steps=len(log.times),
        funnel_margin=float(kept[row, axis]),
        funnel_axis=("angle", *log.joint_names)[axis],
        funnel_cell=int(log.cell_index[row]),
        cell_margin=CRITERIA["cell_margin"].measure(log),
        wall_clearance=float(log.workspace_clearance.min()),
        body_clearance=float(log.body_clearance.min()),
        budget_share=share,
        peak_force=CRITERIA["peak_force"].measure(log),
        peak_torque=CRITERIA["peak_torque"].measure(log) if log.joint_names else nan,
        held=int((np.diff(log.held, prepend=0.0) > 0.0).sum()),
        digest=digest,
    )
