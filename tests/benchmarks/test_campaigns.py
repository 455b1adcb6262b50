"""The command that makes the documentation's campaigns, and its tables."""

from pathlib import Path

import pytest
import typer

from benchmarks.campaigns import __main__ as campaigns
from benchmarks.searches.findings import BreakingPoint
from benchmarks.study import batches_of, load_study
from coop_drake.campaign import load_campaign
from coop_drake.campaign.records import CampaignFolder

FILES = sorted(Path(campaigns.__file__).parent.glob("*.yaml"))


def test_every_campaign_of_the_folder_is_made_and_can_be_read():
    read = [load_study(file) if ".study." in file.name else load_campaign(file) for file in FILES]
    assert sorted(campaigns.NAMES) == sorted(one.name for one in read)


def test_what_is_there_is_shown_as_a_table(tmp_path, capsys):
    campaign = load_study(next(file for file in FILES if file.name.startswith("breaking")))
    folder = CampaignFolder(tmp_path / "breaking")
    batches = batches_of(campaign, folder)
    for batch, kept, lost in ((batches[0], 2.0, 2.25), (batches[8], 64.0, float("inf"))):
        point = BreakingPoint(
            ["base", "warehouse"][batch.scenario], "compiled", "delay", 0.01, kept, lost, 4, ""
        )
        folder.write(batch, [point])
    with pytest.raises(typer.Exit) as ended:
        campaigns.main(["breaking"], tmp_path, None, tables=True)
    assert ended.value.exit_code == 0
    lines = capsys.readouterr().out.splitlines()
    assert "## breaking: 2 of 40 batches" in lines
    assert lines[-5:-1] == [
        "| departure | certified | no loss up to | loss at | multiple without one | the loss |",
        "| --- | --- | --- | --- | --- | --- |",
        "| base, delay | 0.01 | 0.02 | 0.0225 | 2 | none |",
        "| warehouse, delay | 0.01 | 0.64 | not found | 64 or more | none |",
    ]


def test_a_campaign_that_there_is_not_is_refused(capsys):
    with pytest.raises(typer.Exit) as ended:
        campaigns.main(["runs"])
    assert ended.value.exit_code == 2
    assert "allowed is any of breaking, searches" in capsys.readouterr().err
