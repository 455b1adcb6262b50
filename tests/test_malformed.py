"""Malformed files of every format: each gets exit code 2 and one message with file, key and remedy.

Every group begins with its sound file, which is accepted: what is refused is the mutation.
"""

from __future__ import annotations

import io
import json
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
import typer
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers import load_plan, save_plan
from coop_drake.answers.document import problem_digest
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.proof import save_proof
from coop_drake.cli import app, simulate, verify
from coop_drake.cli.task import Task
from coop_drake.errors import PlanError
from coop_drake.floor_plans import read_floor_plan
from coop_drake.planning import find_channel
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import dump_scenario, load_scenario
from coop_drake.scenario.document import parse
from coop_drake.verification import verify_file
from tests.support import mutants as made
from tests.support.cases import case
from tests.support.certificates import GAINS, bent_corridor
from tests.support.floor_plan_files import DXF
from tests.support.mutants import Mutant, sampled
from tests.support.small_plan import small_plan
from tests.support.small_scenario import small_scenario
from tests.support.synthetic_log import synthetic_log

MODELS = Path(__file__).parents[1] / "models"
COMMAND, REMEDY = typer.main.get_command(app), "; expected "
CORRIDORS = {"slices": bent_corridor(0.45), "blocked goal": bent_corridor(1.2, goal=(5.6, 5.0, 0.1))}


def faults(mutant: Mutant, file: Path, arguments: list[str], remedy: str = REMEDY) -> list[str]:
    """What is wrong with a command's answer to a mutant in the place of a file."""
    file.unlink(missing_ok=True)  # Some file systems write a file that is truncated to the disk at once.
    file.write_bytes(mutant.content)
    before, said, complained = sorted(file.parent.iterdir()), io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(complained):
            code = COMMAND.main([*arguments, "--json"], standalone_mode=False)
    except BaseException as error:
        return [f"raised {type(error).__name__}: {str(error)[:200]}"]
    answers = said.getvalue().splitlines()
    message = json.loads(answers[-1]).get("error", "") if answers else ""
    wrong = {
        f"exit code {code}": code != 2,
        "standard output is no single JSON object with an error": len(answers) != 1 or not message,
        f"the key {mutant.key} is not named": mutant.key not in message,
        "file or remedy are not named": not all(file.name in k and remedy in k for k in message.splitlines()),
        f"the message has {len(message)} characters": len(message) > 2000,
        f"standard error says {complained.getvalue()!r}": complained.getvalue() != f"Error: {message}\n",
        "it is refused for a repeated section, not for its own fault": "planner" in message
        and "at most once" in message,
        "something was written": sorted(file.parent.iterdir()) != before,
    }
    return [f"{mutant.kind}: {fault} -- {message[:240]}" for fault, found in wrong.items() if found]


def assert_refused(mutants: list[Mutant], file: Path, *arguments: str, remedy: str = REMEDY) -> None:
    found = [fault for mutant in mutants for fault in faults(mutant, file, list(arguments), remedy)]
    assert len(mutants) > 10
    assert not found, f"{len(found)} of {len(mutants)}:\n" + "\n".join(found[:20])


def scenario_mutants(group: str) -> list[Mutant]:
    base = parse(dump_scenario(load_scenario(MODELS / "base.scenario.yaml")))
    if group == "types":
        return sampled(made.typed_mutants(base, skip=("directives",)), 150, 1)
    return list(made.yaml_mutants(base, 6))


@pytest.mark.slow
@pytest.mark.parametrize("group", ["types", "text"])
def test_malformed_scenarios_are_refused(group, tmp_path):
    file = tmp_path / "mutant.scenario.yaml"
    assert_refused(scenario_mutants(group), file, "plan", str(file), "--out", str(tmp_path / "out"))


SVG = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="10000mm" height="6000mm" viewBox="0 0 10 6">'
    b'<g transform="translate(0,0)"><path d="M 0 0 H 10 V 6 H 0 Z"/>'
    b'<rect x="2" y="2" width="1" height="0.5"/><circle cx="7" cy="3" r="0.5"/></g></svg>'
)
WKT = b"POLYGON ((0 0, 9 0, 9.5 4, 5 5.25, 0 4, 0 0), (2 2, 3 2, 2.5 3, 2 2))"
GEOJSON = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": None,
            "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]]},
        }
    ],
}
MAP = {
    "image": "map.pgm",
    "resolution": 0.1,
    "origin": [0.0, 0.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}
PICTURE = b"P5\n40 30\n255\n" + bytes(254 for _ in range(40 * 30))
DRAWINGS = {
    "hall.svg": SVG,
    "hall.dxf": DXF,
    "hall.wkt": WKT,
    "hall.geojson": made.in_json(GEOJSON),
    "map.yaml": made.in_yaml(MAP),
    "map.pgm": PICTURE,
}
"""Floor plans, each with what it holds when it is sound."""


def drawing_mutants(name: str) -> list[Mutant]:
    content = DRAWINGS[name]
    if name == "map.pgm":
        return [Mutant(f"cut off at {place}", content[:place]) for place in range(1, len(content) - 1, 90)]
    if name == "hall.dxf":
        return [
            Mutant(f"cut off at {n}", content[:n]) for n in range(9, len(content) - 5, 40)
        ] + dxf_numbers()
    end = {"hall.svg": content.rfind(b"</"), "hall.wkt": content.rfind(b")"), "map.yaml": 16}.get(name)
    broken = list(made.broken_text(content, 15, 10, end=end))
    if name == "hall.svg":  # XML may have another encoding.
        return [one for one in broken if not one.kind.startswith("as utf")]
    if name == "map.yaml":
        wrong = [Mutant(one.kind, one.content, one.key.partition("[")[0]) for one in made.typed_mutants(MAP)]
        return broken + [one for one in wrong if one.key not in ("colour", "image")]
    if name == "hall.geojson":
        places = [
            place for place, _ in made.leaves(GEOJSON) if place and place[-1] in ("type", "coordinates")
        ]
        gone = [
            Mutant(f"missing {place}", made.in_json(made.without(GEOJSON, place)))
            for place in places
            if len(place) != 3  # A feature without a type is caught by its collection alone.
        ]
        wrong = made.typed_mutants(GEOJSON["features"][0]["geometry"], made.in_json, skip=("colour",))
        return broken + gone + [Mutant(one.kind, one.content) for one in wrong if one.key != "colour"]
    return broken


def dxf_numbers() -> list[Mutant]:
    """Every number of an entity as something that is none, and gone with or without its code."""
    tags, found = DXF.decode().splitlines(), []
    for place in range(tags.index("ENTITIES") + 1, len(tags) - 1, 2):
        if tags[place] in ("10", "20", "11", "21", "40", "50", "51"):
            wrong = [[tags[place], word] for word in ("wide", "nan", "inf", "1e400")] + [[], [tags[place]]]
            for tag in wrong:
                lines = [*tags[:place], *tag, *tags[place + 2 :]]
                found.append(Mutant(f"{tag} at {place}", ("\n".join(lines) + "\n").encode()))
    return found


@pytest.mark.parametrize("name", DRAWINGS)
def test_malformed_floor_plans_are_refused(name, tmp_path):
    for other, content in DRAWINGS.items():
        (tmp_path / other).write_bytes(content)
    file = tmp_path / ("map.yaml" if name == "map.pgm" else name)
    read_floor_plan(file)
    assert_refused(drawing_mutants(name), tmp_path / name, "floor-plan", str(file), remedy="; ")


def test_malformed_plans_are_refused(tmp_path, monkeypatch):
    scenario = small_scenario()
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    names = tuple(joint.name for joint in problem.tree.joints)
    plan, file = replace(small_plan(names), problem=problem_digest(problem)), tmp_path / "mutant.json"
    monkeypatch.setattr(simulate, "read_task", lambda *_, **__: Task(scenario, problem))
    assert load_plan(save_plan(plan, file)).joint_names == plan.joint_names
    document = json.loads(file.read_text())
    skip = ("digest", "problem", "gain_set", "format", "version")
    mutants = [
        *sampled(made.typed_mutants(document, made.signed, skip=skip, required=True), 200, 15),
        *made.json_mutants(document, 18),
    ]
    command = ("simulate", "small.scenario.yaml", "--plan", str(file), "--out", str(tmp_path / "out"))
    assert_refused(mutants, file, *command)


@cache
def proved(kind: str):
    answer, _ = find_channel(CORRIDORS[kind])
    return answer.proof


@pytest.mark.parametrize("kind", CORRIDORS)
def test_malformed_proofs_are_refused(kind, tmp_path, monkeypatch):
    problem, file = CORRIDORS[kind], tmp_path / "mutant.json"
    monkeypatch.setattr(verify, "read_task", lambda *_, **__: Task(load_scenario("base"), problem))
    save_proof(proved(kind), problem, file)
    assert verify_file(file, problem, GAINS).answer == "infeasible"
    document = json.loads(file.read_text())
    skip = ("digest", "problem", "format", "version", "squeezes")
    mutants = [
        *sampled(made.typed_mutants(document, made.signed, skip=skip, required=True), 60, 20),
        *made.json_mutants(document, 21),
    ]
    assert_refused(mutants, file, "verify", str(file), "corridor.scenario.yaml")


def test_malformed_logs_are_refused(tmp_path):
    """No command reads a log alone; who does gets an error that a command would answer with exit code 2."""
    file = tmp_path / "mutant.npz"
    synthetic_log(case("base"), samples=5).save(file)
    assert SimulationLog.load(file).reached
    for mutant in made.log_mutants(file.read_bytes(), 23):
        file.write_bytes(mutant.content)
        with pytest.raises(PlanError) as caught:
            SimulationLog.load(file)
        assert all(part in str(caught.value) for part in (file.name, mutant.key, REMEDY)), mutant.kind
