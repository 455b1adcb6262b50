"""A table of runs of a campaign that nobody simulated."""

import json

import numpy as np

from coop_drake.campaign.records import RunRecord, table_of


def run_table(count=200, scenarios=("base", "tight"), tiers=("drake",), lost=(), seed=1):
    """Runs whose funnel margins fall by 3 mrad from the smallest mass error to the largest; others are noise.

    ``lost`` are the indices of runs that left their funnel.
    """
    generator = np.random.default_rng(seed)
    records = []
    for index in range(count):
        error, loss = generator.uniform(-0.2, 0.2), generator.uniform(0.0, 0.3)
        scenario = scenarios[index % len(scenarios)]
        for tier in tiers:
            away = index in lost
            funnel = 0.009 - 0.0075 * (error + 0.2) + generator.normal(0.0, 2e-4)
            records.append(
                RunRecord(
                    index, scenario, tier, 1000 + index,
                    json.dumps({"deployment.mass_error": error, "deployment.messages.loss": loss}),
                    not away,
                    "left the funnel of the angle" if away else "",
                    time=generator.normal(16.0, 0.4),
                    steps=4000,
                    funnel_margin=-1e-3 if away else funnel,
                    cell_margin=generator.uniform(0.02, 0.03),
                    wall_clearance=generator.normal(0.1, 0.002),
                    body_clearance=generator.normal(0.2, 0.002),
                    peak_force=generator.normal(180.0, 12.0),
                    peak_torque=generator.normal(40.0, 3.0),
                )
            )  # fmt: skip
    return table_of(records, RunRecord)
