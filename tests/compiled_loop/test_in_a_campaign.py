"""A campaign whose runs are made by both loops."""

from dataclasses import asdict, replace

import pytest

from coop_drake.campaign.file import load_campaign
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.records import RunRecord
from coop_drake.campaign.runs import RunMaker
from coop_drake.campaign.variation import Variation
from coop_drake.cli.campaign import _compare, _show_both
from coop_drake.cli.reporter import Reporter
from coop_drake.compiled_loop import preparing
from coop_drake.errors import ProcessError

FILE = """
runs:
  scenarios: [warehouse]
  count: 2
  seed: 5
  tier: both
  set: {deployment.preset: mobile_base, deployment.messages.loss: 0.0}
  vary:
    deployment.mass_error: !Uniform {min: -0.2, max: 0.2}
"""


@pytest.mark.slow
def test_both_tiers_leave_the_same_record(tmp_path, monkeypatch):
    path, prepared = tmp_path / "both.campaign.yaml", []
    path.write_text(FILE)
    variation = Variation(load_campaign(path))
    plans = Plans(variation, tmp_path)
    monkeypatch.setattr(preparing, "_check", prepared.append)
    compiled, drake = (RunMaker(variation, plans, tier, tmp_path) for tier in ("compiled", "drake"))
    records = [compiled.record(variation.run(index)) for index in range(2)]
    assert len(prepared) == 1
    assert records[0].funnel_margin != records[1].funnel_margin
    found, expected = asdict(records[1]), asdict(drake.record(variation.run(1)))
    assert (found.pop("tier"), expected.pop("tier")) == ("compiled", "drake")
    assert found.pop("digest") != expected.pop("digest")
    for name in ("run", "scenario", "seed", "values", "arrived", "reason", "funnel_axis", "held"):
        assert found[name] == expected[name]
    assert found["time"] == pytest.approx(expected["time"], abs=0.0051)
    for name in ("funnel_margin", "wall_clearance", "body_clearance"):
        assert found[name] == pytest.approx(expected[name], abs=5e-4)
    assert found["peak_force"] == pytest.approx(expected["peak_force"], rel=2e-3)


@pytest.mark.slow
def test_a_replay_shows_both_tiers_and_refuses_another_run():
    counted = RunRecord(3, "warehouse", "compiled", 7, "{}", arrived=True, time=10.0, steps=2000)
    drake, reporter = replace(counted, tier="drake", time=10.005), Reporter(machine=True, quiet=True)
    _show_both(drake, counted, reporter)
    assert reporter.facts["tiers"]["time"] == [10.005, 10.0]
    assert reporter.facts["tiers"]["budget_share"] == [None, None]
    _compare(counted, asdict(counted), reporter)
    assert reporter.facts["counted"]
    with pytest.raises(ProcessError, match=r"run 3 of the compiled loop differs .* in steps"):
        _compare(replace(counted, steps=1999), asdict(counted), reporter)
