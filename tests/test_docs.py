"""The documentation: what it shows works, and what it lists is all there is."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.diagram import build_closed_loop
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import load_scenario
from coop_drake.scenario.model import Scenario
from coop_drake.systems import AxisPpc
from coop_drake.typed_data import field_types
from docs.generate.__main__ import PAGES
from docs.generate.api_pages import api_pages
from docs.generate.links import first_page, for_site
from docs.generate.scenario_page import sections
from tests.support.small_loop import joint_names, small_maps, small_scenario
from tests.support.small_plan import small_plan

ROOT = Path(__file__).parents[1]


def all_shown(page, language):
    """The blocks of code of a language on a page."""
    text = (ROOT / "docs" / "how_to" / page).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def shown(page, language):
    """The first block of code of a language on a page."""
    return all_shown(page, language)[0]


@pytest.fixture(scope="module")
def listed():
    return {section.path: section for section in sections()}


def test_every_key_of_a_scenario_is_listed_with_its_meaning(listed):
    assert [key.name for key in listed[""].keys] == list(field_types(Scenario))
    assert {"start.object", "goal.tolerances", "deployment.messages"} <= set(listed)
    for section in listed.values():
        assert section.about
        for key in section.keys:
            assert key.meaning
            assert key.kind


def test_the_scenario_that_is_shown_can_be_carried_out(tmp_path):
    path = tmp_path / "corridor.scenario.yaml"
    path.write_text(shown("own_scenario.md", "yaml"), encoding="utf-8")
    scenario = load_scenario(path)
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    assert problem.workspace.area == pytest.approx(16.0 - 0.2 * 0.05)


def test_the_robot_that_is_shown_makes_a_team(tmp_path):
    (tmp_path / "short_arm.sdf").write_text(shown("own_robot.md", "xml"), encoding="utf-8")
    path = tmp_path / "corridor.scenario.yaml"
    ours = re.sub(
        r"package://coop_drake_models/long_\w+.sdf", "short_arm.sdf", shown("own_scenario.md", "yaml")
    )
    path.write_text(ours, encoding="utf-8")
    team = build_team_plant(load_scenario(path), DiagramBuilder())
    assert len(team.joint_names) == 2


def test_a_transport_arrives_with_the_block_that_is_shown(capsys):
    block, use = all_shown("controller_block.md", "python")
    assert len([line for line in use.splitlines() if line.strip()]) <= 10
    names = {}
    exec(block, names)
    exec(use, names)
    assert capsys.readouterr().out.strip() == "reached: True"
    log, plan = names["log"], names["plan"]
    assert np.array_equal(log.funnel_lower[-1], plan.cells[-1].lower)  # Those of the block that is shown.


def test_only_named_blocks_that_exist_can_be_replaced():
    scenario = small_scenario()
    plan = small_plan(joint_names(scenario))
    with pytest.raises(ValueError, match="'axis_pcc' is not allowed; expected one of object_estimator"):
        build_closed_loop(scenario, plan, small_maps(), replacements={"axis_pcc": AxisPpc})


def test_links_lead_somewhere_beside_the_sources():
    pages = list((ROOT / "docs").rglob("*.md"))
    links = {
        page: re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text(encoding="utf-8")) for page in pages
    }
    assert sum(map(len, links.values())) > 20
    assert [f"{page}: {to}" for page in pages for to in links[page] if not (page.parent / to).exists()] == []


@pytest.mark.parametrize("name", PAGES)
def test_the_pages_of_files_are_up_to_date(name):
    written = (ROOT / "docs" / "reference" / name).read_text(encoding="utf-8")
    assert written == PAGES[name](), "`make docs` writes it anew"


def test_in_the_site_a_room_is_its_page_of_the_api():
    text = "[funnel](../../coop_drake/systems), [plan](../coop_drake/planning.md)"
    assert for_site(text, PurePosixPath("how_to/page.md")) == (
        "[funnel](../reference/api/systems.md), [plan](../coop_drake/planning.md)"
    )
    assert for_site("[one](../coop_drake/harmonic_maps)", PurePosixPath("page.md")) == (
        "[one](reference/api/harmonic_maps.md)"
    )


def test_every_room_has_a_page():
    pages = {page.title: page.text for page in api_pages(ROOT)}
    rooms = {path.parent.name for path in (ROOT / "coop_drake").glob("*/__init__.py")}
    assert set(pages) == rooms | {"coop_drake"}
    assert "::: coop_drake.harmonic_maps.harmonic_map\n" in pages["harmonic_maps"]
    assert "kernels" not in "".join(pages.values())


def test_the_readme_is_the_first_page_without_links_that_the_site_cannot_follow():
    page = first_page("[a](docs/b.md) ![c](docs/d.png) [e](models/f.md) [g](https://h)")
    assert page == "[a](b.md) ![c](d.png) e [g](https://h)"
