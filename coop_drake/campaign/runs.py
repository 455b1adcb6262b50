"""Makes single runs of a campaign and measures them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from coop_drake.answers.document import content_digest
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan, plan_digest
from coop_drake.campaign.file import Tier, load_campaign
from coop_drake.campaign.plans import Maps, Plans, versions
from coop_drake.campaign.records import Batch, Batching, CampaignFolder, RunRecord, Task
from coop_drake.campaign.variation import Run, Variation
from coop_drake.errors import CoopDrakeError, RefusalError, ScenarioError
from coop_drake.plant.facts import models_digest, scenario_digest
from coop_drake.scenario.model import Scenario
from coop_drake.tuning.objective import CRITERIA
from coop_drake.typed_data import DataError
from coop_drake.verification.runs import Rows, budget_share

if TYPE_CHECKING:
    from coop_drake.compiled_loop import CompiledTransport, RunOutcome

# The record of a run of Drake's loop, measured from its log.


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
        held=_times_held(log, plan),
        digest=digest,
    )


def _times_held(log: SimulationLog, plan: Plan) -> int:
    """Return how often a team was held, or came to rest on its way where it passes from cell to cell."""
    if plan.motion is None:
        return int((np.diff(log.held, prepend=0.0) > 0.0).sum())
    moves = np.asarray(log.phases[:, :, 1].max(axis=1) > 0.0)
    stops = moves[:-1] & ~moves[1:]
    return int((stops & (log.phases[1:, :, 0].min(axis=1) < plan.motion.duration)).sum())


class RunMaker:
    """Makes the runs of a campaign in one process.

    Args:
        variation: The runs.
        plans: Their plans.
        tier: By which loop they are made.
        logs: Where logs that the campaign keeps are written.
    """

    def __init__(self, variation: Variation, plans: Plans, tier: Tier, logs: Path) -> None:
        self._variation, self._plans, self._tier, self._logs = variation, plans, tier, logs
        self._transport: CompiledTransport | None = None
        self._digest: tuple[Plan, str] | None = None
        self._models: tuple[object, str] | None = None

    def begun(self, run: Run) -> RunRecord:
        """Return the record of a run that has not ended."""
        name = self._variation.scenarios[run.scenario].name
        return RunRecord(run.index, name, self._tier, run.seed, run.text, arrived=False)

    def check(self, scenario: int) -> None:
        """Refuse what a scenario or the campaign wants of a loop that does not know it.

        Raises:
            ScenarioError: The loop refuses a run before it begins.
            PlanError: There is no plan.
            FieldError: A cell cannot be mapped.
        """
        plan = self._plans.with_maps(self._variation.run(scenario * self._variation.runs_of_scenario))
        for run in self._variation.trials(scenario, numbers=self._tier == "compiled"):
            self._check(run, *plan)

    def check_run(self, run: Run) -> None:
        """Refuse a single run; errors are those of ``check``."""
        self._check(run, *self._plans.with_maps(run))

    def _check(self, run: Run, plan: Plan, maps: Maps) -> None:
        """Refuse a run that its loop refuses before it begins; other errors are those of the run alone."""
        try:
            scenario = self._variation.scenario_of(run)
            if self._tier == "compiled":
                from coop_drake.compiled_loop.running import departures_of

                departures_of(self._prepared(scenario, plan, maps), scenario.deployment)
            else:
                from coop_drake.diagram.closed_loop import build_closed_loop

                build_closed_loop(scenario, plan, maps).release()
        except DataError as error:
            raise self._variation.refusal(run.scenario, error) from error
        except ScenarioError:
            raise
        except Exception:
            return

    def record(self, run: Run) -> RunRecord:
        """Make a run; one that cannot be made is lost for the reason that its error names.

        Raises:
            OSError: A log cannot be written, or the system refuses something.
            MemoryError: There is not enough memory.
        """
        begun = self.begun(run)
        try:
            plan, maps = self._plans.with_maps(run)
            scenario = self._variation.scenario_of(run)
            digest = run_digest(scenario, self._digest_of(plan), self._tier, self._models_of(scenario))
            if self._tier == "compiled":
                outcome = vars(self._compiled(scenario, plan, maps))
                return replace(begun, digest=digest, **{n: outcome[n] for n in outcome.keys() & vars(begun)})
            log = self._simulated(scenario, plan, maps)
            record = record_of_log(run, begun.scenario, log, plan, digest)
        except (OSError, MemoryError):
            raise
        except Exception as error:
            return replace(begun, reason=f"{type(error).__name__}: {error}")
        keep = self._variation.runs.keep
        if keep == "all" or (keep == "lost" and not record.arrived):
            log.save(self._logs / f"{run.index}.npz")
        return record

    def _digest_of(self, plan: Plan) -> str:
        """Return the digest of a plan; it takes as long as a compiled run, so that the last one is kept."""
        if self._digest is None or self._digest[0] is not plan:
            self._digest = plan, plan_digest(plan)
        return self._digest[1]

    def _models_of(self, scenario: Scenario) -> str:
        """Return the digest of a run's models; to read them takes longer than a run, so the last is kept."""
        named = scenario.path, scenario.object, scenario.directives, scenario.fixed_joints
        if self._models is None or self._models[0] != named:
            self._models = named, models_digest(scenario)
        return self._models[1]

    def _simulated(self, scenario: Scenario, plan: Plan, maps: Maps) -> SimulationLog:
        """Make a run by Drake's loop."""
        from coop_drake.simulation import simulate

        return simulate(scenario, plan, maps)

    def _compiled(self, scenario: Scenario, plan: Plan, maps: Maps) -> RunOutcome:
        """Make a run by the compiled loop."""
        from coop_drake.compiled_loop import run

        return run(self._prepared(scenario, plan, maps), scenario.deployment)

    def _prepared(self, scenario: Scenario, plan: Plan, maps: Maps) -> CompiledTransport:
        """Return the arrays of a run; runs that differ in their deployments alone share them."""
        from coop_drake.compiled_loop import prepare

        known = self._transport
        if (
            known is None
            or known.plan is not plan
            or replace(known.scenario, deployment=scenario.deployment) != scenario
        ):
            known = self._transport = prepare(scenario, plan, maps)
        return known


def run_digest(scenario: Scenario, plan: str, tier: Tier, models: str | None = None) -> str:
    """Return the digest of what a run of a scenario along a plan depends on.

    Args:
        scenario: The scenario.
        plan: Digest of the plan.
        tier: By which loop the run is made.
        models: Digest of the scenario's models; None to read them.
    """
    parts = {"scenario": scenario_digest(scenario, models), "plan": plan, "tier": tier}
    return content_digest({**parts, "versions": versions()})


def tasks(order: dict[str, Any], alive: Callable[[], None]) -> Iterator[Task]:
    """Yield the runs of a batch that are to be made."""
    folder, batch = CampaignFolder(Path(order["folder"])), order["batch"]
    variation = Variation(load_campaign(folder.campaign, Path(order["campaign"])))
    plans = Plans(variation, folder.plans)
    place = batch["scenario"], batch["tier"], batch["first"], batch["stop"]
    check_unchanged(order, Batching(variation, plans).batch(*place))
    maker = RunMaker(variation, plans, batch["tier"], folder.path / "logs")
    for index in range(order["begin"], batch["stop"]):
        run = variation.run(index)
        yield maker.begun(run), partial(maker.record, run)


def check_unchanged(order: dict[str, Any], batch: Batch) -> None:
    """Check that what files say now gives the batch that was ordered.

    Raises:
        CoopDrakeError: It does not.
    """
    if batch.digest != order["batch"]["digest"]:
        raise CoopDrakeError(f"{order['campaign']}: a scenario or a model was changed while the campaign ran")
