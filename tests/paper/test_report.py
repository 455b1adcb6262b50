"""The report on the paper's example, the figure of slices, and the picture of errata."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from coop_drake.drawing.colours import BLUE, VERMILLION
from coop_drake.laws import FixedGains
from coop_drake.plant.team import ObjectInertia
from coop_drake.scenario import load_scenario
from paper import (
    Agreement,
    GainFigures,
    Material,
    corridor_scenario,
    exhibits,
    gather,
    pages,
    slice_figure,
    write_report,
)
from paper.approximation import approximations, two_components
from paper.background import ASSUMPTIONS, ERRATA
from paper.errata_figure import errata_figure
from paper.runs import GAIN_SETS, Run
from paper.stated import FIGURE_3_SLICES
from tests.support.cases import case
from tests.support.figure_names import OF_EVERY_RUN, OF_TWO_ROBOTS
from tests.support.synthetic_log import synthetic_log, synthetic_plan

# The report on the paper's example: verdicts follow the runs, and the page stands alone.

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def material():
    problem = case("base")
    log = synthetic_log(problem)
    pose = log.object_pose.copy()
    pose[-1] = problem.goal_pose
    log = replace(log, object_pose=pose, object_twist=0.0 * log.object_twist)
    plan = synthetic_plan(problem)
    return Material(
        problem=problem,
        inertia=ObjectInertia(1.0, 1.0, np.zeros(2)),
        table_2=FixedGains(),
        made=approximations(two_components(problem.tree), FIGURE_3_SLICES),
        runs=tuple(Run(name, plan, log) for name in GAIN_SETS),
        played=tuple(
            GainFigures(name, 20.0, 80.0, 9.0, 1.0, 0.01, 0.1, 1e-13, 1e-12, 0.0, "") for name in GAIN_SETS
        ),
    )


def test_the_papers_team_rests_in_every_cell(monkeypatch):
    asked = []
    monkeypatch.setattr("paper.material.compare_gains", lambda scenario, **_: asked.append(scenario) or ())
    monkeypatch.setattr("paper.material.reproduce_runs", lambda *these, **_: asked.extend(these) or ())
    gather(load_scenario("base"))
    assert [one.passes for one in asked] == [False] * 3
    assert not corridor_scenario(load_scenario("base")).passes


def judged(material):
    return {exhibit.name: exhibit for exhibit in exhibits(material)}


def with_log(material, **changes):
    first, second = material.runs
    return replace(material, runs=(first, replace(second, log=replace(second.log, **changes))))


def test_every_table_and_figure_of_the_example_has_its_exhibit(material):
    found = judged(material)
    figures_of_the_example = [f"Figure {number}" for number in range(3, 14)]
    assert list(found) == ["Table 1", "Table 1, played", "Table 2", *figures_of_the_example]
    assert found["Table 1"].agreement is Agreement.DIFFERS  # Five synthetic cells are not thirty.
    assert {found[name].agreement for name in ("Figure 3", "Figure 5", "Figure 7")} == {Agreement.AGREES}


def test_inputs_that_were_copied_do_not_count_as_agreement(material):
    found = judged(material)
    assert {found[name].agreement for name in ("Table 2", "Figure 4")} == {Agreement.COPIED}
    moved = replace(material.problem, start=material.problem.start + 0.1)
    assert judged(replace(material, problem=moved))["Figure 4"].agreement is Agreement.DIFFERS


def test_other_numbers_than_the_paper_s_differ(material):
    """A plan of five cells agrees neither in how many need a bent arm nor in how far neighbours overlap."""
    differing = {statement.paper for statement in judged(material)["Table 1"].differing}
    assert "In 21 of 30 cells an arm must be bent, in the others both may be straight." in differing
    assert "Their smallest overlap is 0.041 rad." in differing
    assert not any(paper.startswith("Neighbouring cells overlap") for paper in differing)


def test_a_gain_or_mass_that_is_not_the_paper_s_differs(material):
    assert (
        judged(replace(material, table_2=FixedGains(damping=6.0)))["Table 2"].agreement is Agreement.DIFFERS
    )
    heavy = ObjectInertia(2.0, 1.0, np.zeros(2))
    assert judged(replace(material, inertia=heavy))["Table 2"].agreement is Agreement.DIFFERS


@pytest.mark.parametrize(
    ("exhibit", "changes"),
    [
        ("Figure 5", {"reached": False}),
        ("Figure 5", {"workspace_clearance": np.array([-0.01])}),
        ("Figure 7", {"funnel_lower": np.full((400, 3), 9.0)}),
        ("Figure 8", {"object_twist": np.ones((400, 3))}),
        ("Figure 11", {"funnel_upper": np.full((400, 3), -9.0)}),
        ("Figure 12", {"wrench_error": np.array([1e-3])}),
    ],
)
def test_one_run_that_departs_is_enough_to_differ(material, exhibit, changes):
    assert judged(material)[exhibit].agreement is Agreement.AGREES
    assert judged(with_log(material, **changes))[exhibit].agreement is Agreement.DIFFERS


def test_an_approximation_that_leaves_something_out_is_noticed(material):
    first, *others = material.made
    small = replace(first, over=first.over.buffer(-0.01))
    assert first.encloses
    assert not small.encloses
    assert judged(replace(material, made=(small, *others)))["Figure 3"].agreement is Agreement.DIFFERS


@pytest.fixture(scope="module")
def report(material, tmp_path_factory):
    """The report, every picture a dot: what a run leaves is drawn and tested elsewhere."""

    def dot(_figure, path, **_options):
        Image.new("RGB", (1, 1)).save(path)

    def dots(_problem, _plan, _log, directory):
        for name in OF_EVERY_RUN + OF_TWO_ROBOTS:
            dot(None, directory / f"{name}.png")

    folder = tmp_path_factory.mktemp("reproduction")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pages, "save_figure", dot)
        patch.setattr(pages, "write_figures", dots)
        patch.setattr(pages, "write_errata_figure", lambda directory: dot(None, directory / "errata.png"))
        write_report(material, folder)
    return folder


def test_the_page_stands_alone_and_every_reason_is_explained(material, report):
    page = (report / "index.html").read_text()
    found = exhibits(material)
    assert page.count("<section") == len(found) + 1
    assert page.count("<img") == sum(len(exhibit.pictures) for exhibit in found) + 1
    assert set(re.findall(r'src="(.{20})', page)) == {"data:image/png;base64"[:20]}
    links = set(re.findall(r'href="#([^"]+)"', page))
    assert links == set(re.findall(r'id="([^"]+)"', page))
    for file in re.findall(r'href="([^"#]+\.\w+)"', page):
        assert (report / file).is_file()
    for agreement in Agreement:
        count = sum(one.agreement is agreement for exhibit in found for one in exhibit.statements)
        assert f"{count} {agreement.value}" in page


def test_the_markdown_says_the_same_and_its_pictures_are_there(material, report):
    text = (report / "report.md").read_text()
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    found = [picture.file for exhibit in exhibits(material) for picture in exhibit.pictures]
    assert pictures == [*found, "errata.png"]
    assert all((report / picture).is_file() for picture in pictures)


def test_errata_are_those_of_the_documents_and_every_assumption_is_used(material):
    in_documents = set(re.findall(r"^- \*\*(E\w+)\*\*", (DOCS / "errata.md").read_text(), re.MULTILINE))
    assert set(ERRATA) <= in_documents
    used = {key for exhibit in exhibits(material) for key in exhibit.because}
    assert used <= set(ERRATA) | set(ASSUMPTIONS)
    assert set(ASSUMPTIONS) <= used


# The figure of slices: a narrow slice proves more of the floor free, and leaves less undecided.


@pytest.fixture(scope="module")
def figure():
    wide, narrow = (((1.57 - h, 1.57 + h), (-h, h), (-h, h)) for h in (0.4, 0.1))
    return slice_figure(case("base"), [wide, narrow])


def areas(axes):
    texts = [text.get_text() for text in axes.get_legend().get_texts()[:2]]
    return [float(re.search(r": ([\d.]+) m²", text)[1]) for text in texts]


def test_what_is_proved_free_and_what_may_be_free_come_closer_in_a_narrow_slice(figure):
    (free, maybe), (free_in_narrow, maybe_in_narrow) = (areas(figure.axes[row]) for row in (1, 3))
    assert free < free_in_narrow < maybe_in_narrow < maybe


# The picture of errata: every panel shows the printed formula fail where the corrected one holds.


def test_the_picture_of_errata_has_a_panel_for_each_with_both_formulas():
    panels = {ax.get_title().split(":")[0]: ax for ax in errata_figure().axes}
    assert len(panels) > 5
    assert set(panels) <= set(ERRATA)
    for ax in panels.values():
        assert {VERMILLION, BLUE} <= {line.get_color() for line in ax.get_lines()}
