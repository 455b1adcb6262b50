"""More than two thousand malformed files: each gets exit code 2 and one message with file, key and remedy.

Malformed is what a mutation makes so, and each says why (`Mutant.because`); none is tried first. Every group
begins with its sound file, which is accepted: what is refused is the mutation.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers import load_plan, save_plan
from coop_drake.answers.digest import problem_digest
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.proof import save_proof
from coop_drake.cli import simulate, verify
from coop_drake.cli.task import Task, read_task
from coop_drake.errors import PlanError
from coop_drake.floor_plans import read_floor_plan
from coop_drake.planning import find_channel
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import dump_scenario, load_scenario
from coop_drake.scenario.document import parse
from coop_drake.verification import verify_file
from tests.support.cases import case
from tests.support.certificates import GAINS, bent_corridor
from tests.support.mutants import documents, floor_plans, models, schema, text
from tests.support.mutants.mutant import REMEDY, Mutant, block, faults, sampled
from tests.support.robot_models import urdf_arm
from tests.support.small_plan import small_plan
from tests.support.small_scenario import small_scenario
from tests.support.synthetic_log import synthetic_log

MODELS = Path(__file__).parents[1] / "models"
ROBOT = "directives[1]"
LONG_BLUE = (MODELS / "long_blue.sdf").read_bytes()
FORKED = urdf_arm().encode()
CORRIDORS = (bent_corridor(0.58), bent_corridor(0.45), bent_corridor(1.2, goal=(5.6, 5.0, 0.1)))
"""No way between slices, by a disc alone, and with a blocked goal."""


def shipped(name: str):
    return parse((MODELS / f"{name}.scenario.yaml").read_text())


@cache
def spelt_out():
    """The base scenario with every section that it leaves to its default."""
    return parse(dump_scenario(load_scenario(MODELS / "base.scenario.yaml")))


@cache
def planned():
    """A sound plan as a document, and the task that it belongs to."""
    scenario = small_scenario()
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    names = tuple(joint.name for joint in problem.tree.joints)
    plan = replace(small_plan(names), problem=problem_digest(problem))
    return plan, Task(scenario, problem)


def document_of(save: Callable[[Path], object], path: Path):
    save(path)
    return json.loads(path.read_text())


SCENARIOS: dict[str, Callable[[], list[Mutant]]] = {
    "schema": lambda: [
        *sampled(schema.schema_mutants(spelt_out()), 330, 1),
        *sampled(schema.schema_mutants(shipped("elbow")), 60, 2),
    ],
    "text": lambda: [
        *text.encoding_mutants(block(shipped("tight")).encode(), 60, 5),
        *text.yaml_mutants(shipped("closed"), 6),
    ],
}
MODEL_FILES: dict[str, Callable[[], list[Mutant]]] = {
    "sdf": lambda: [
        *models.xml_mutants(LONG_BLUE, ROBOT, 9),
        *sampled(models.number_mutants(LONG_BLUE, ROBOT), 50, 10),
        *sampled(models.element_mutants(LONG_BLUE, ROBOT), 10, 11),
        *models.edited_mutants(LONG_BLUE, models.SDF_EDITS, ROBOT),
    ],
    "urdf": lambda: [
        *models.xml_mutants(FORKED, ROBOT, 12),
        *sampled(models.number_mutants(FORKED, ROBOT), 45, 13),
        *sampled(models.element_mutants(FORKED, ROBOT), 35, 14),
    ],
}
"""Model files by their ending."""
GEOJSON, MAP = json.dumps(floor_plans.GEOJSON).encode(), block(floor_plans.MAP).encode()
DRAWINGS: dict[str, tuple[bytes, Callable[[], list[Mutant]]]] = {
    "hall.svg": (floor_plans.SVG, lambda: list(floor_plans.svg_mutants(24))),
    "hall.dxf": (floor_plans.DXF, lambda: list(floor_plans.dxf_mutants(31))),
    "hall.wkt": (
        floor_plans.WKT,
        lambda: [*floor_plans.wkt_mutants(25), *text.encoding_mutants(floor_plans.WKT, 10, 26)],
    ),
    "hall.geojson": (
        GEOJSON,
        lambda: [*floor_plans.geojson_mutants(27), *text.encoding_mutants(GEOJSON, 10, 28)],
    ),
    "map.yaml": (MAP, lambda: [*floor_plans.map_mutants(), *text.encoding_mutants(MAP, 10, 29)]),
    "map.pgm": (floor_plans.PICTURE, lambda: list(floor_plans.picture_mutants(30))),
}
"""Floor plans, each with what it holds when it is sound."""
COUNTS = {
    "schema": 390,
    "text": 270,
    "sdf": 122,
    "urdf": 130,
    "hall.svg": 46,
    "hall.dxf": 150,
    "hall.wkt": 62,
    "hall.geojson": 162,
    "map.yaml": 88,
    "map.pgm": 16,
    "plan": 477,
    "proof 0": 138,
    "proof 1": 116,
    "proof 2": 73,
    "log": 197,
}
"""At least so many different files in each group."""


@dataclass
class Bench:
    """A folder for mutants, and what was found wrong with the answers to them."""

    folder: Path

    def judge(self, mutants: list[Mutant], group: str, file: str, *arguments: str) -> None:
        """Every mutant gets the answer that it must, and there are as many as promised."""
        check_count(mutants, group)
        out = self.folder / "out"
        command = [*arguments, "--out", str(out)] if arguments[0] != "verify" else list(arguments)
        wrong = [
            f"{mutant.kind} at {mutant.place} ({mutant.because}): {fault}"
            for mutant in mutants
            for fault in faults(mutant, self.folder / file, command, out)
        ]
        assert not wrong, f"{len(wrong)} of {len(mutants)}:\n" + "\n".join(wrong[:20])


def check_count(mutants: list[Mutant], group: str) -> None:
    assert len({mutant.content for mutant in mutants}) >= COUNTS[group]
    assert all(mutant.because for mutant in mutants)


@pytest.fixture
def bench(tmp_path) -> Iterator[Bench]:
    return Bench(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("group", SCENARIOS)
def test_malformed_scenarios_are_refused(group, bench):
    load_scenario(MODELS / "base.scenario.yaml")
    file = bench.folder / "mutant.scenario.yaml"
    bench.judge(SCENARIOS[group](), group, file.name, "plan", str(file))


@pytest.mark.parametrize("ending", MODEL_FILES)
def test_malformed_models_are_refused(ending, bench):
    base = (MODELS / "base.scenario.yaml").read_text()
    team = base.replace("package://coop_drake_models/long_blue.sdf", f"robot.{ending}")
    scenario = bench.folder / "team.scenario.yaml"
    scenario.write_text(team if ending == "sdf" else team.replace("robot_0: [0.0]", "robot_0: [0.0, 0.0]"))
    (bench.folder / f"robot.{ending}").write_bytes(LONG_BLUE if ending == "sdf" else FORKED)
    read_task(scenario, None)
    bench.judge(MODEL_FILES[ending](), ending, f"robot.{ending}", "plan", str(scenario))


@pytest.mark.parametrize("name", DRAWINGS)
def test_malformed_floor_plans_are_refused(name, tmp_path):
    for other, (content, _) in DRAWINGS.items():
        (tmp_path / other).write_bytes(content)
    read_floor_plan(tmp_path / ("map.yaml" if name == "map.pgm" else name))
    mutants, file = DRAWINGS[name][1](), tmp_path / name
    check_count(mutants, name)
    command = ["floor-plan", str(tmp_path / ("map.yaml" if name == "map.pgm" else name))]
    wrong = [
        (mutant, found)
        for mutant in mutants
        if (found := faults(mutant, file, command, tmp_path / "out", "; "))
    ]
    assert not wrong, wrong[:10]


def plan_mutants(folder: Path) -> list[Mutant]:
    plan, _ = planned()
    document = document_of(lambda path: save_plan(plan, path), folder / "plan.json")
    return [
        *sampled(documents.document_mutants(document, 7), 300, 15),
        *sampled(documents.plan_mutants(document), 60, 16),
        *documents.digest_mutants(document),
        *documents.unsigned_mutants(document, 17, 40),
        *documents.json_mutants(document, 18),
        *text.encoding_mutants(json.dumps(document).encode(), 20, 19),
    ]


def test_malformed_plans_are_refused(bench, monkeypatch):
    plan, task = planned()
    monkeypatch.setattr(simulate, "read_task", lambda *_, **__: task)
    file = save_plan(plan, bench.folder / "mutant.json")
    assert load_plan(file).joint_names == plan.joint_names
    bench.judge(
        plan_mutants(bench.folder), "plan", file.name, "simulate", "small.scenario.yaml", "--plan", str(file)
    )


@cache
def proved(index: int):
    """A question of a kind and its answer."""
    answer, _ = find_channel(CORRIDORS[index])
    return answer.proof


def proof_mutants(index: int, folder: Path) -> list[Mutant]:
    problem = CORRIDORS[index]
    document = document_of(lambda path: save_proof(proved(index), problem, path), folder / "proof.json")
    return [
        *sampled(documents.document_mutants(document, (60, 12, 1)[index]), (140, 60, 50)[index], 20),
        *(documents.json_mutants(document, 21) if index == 1 else ()),
        *(text.encoding_mutants(json.dumps(document).encode(), 10, 22) if index == 2 else ()),
    ]


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("index", range(len(CORRIDORS)))
def test_malformed_proofs_are_refused(index, bench, monkeypatch):
    problem = CORRIDORS[index]
    task = Task(load_scenario("base"), problem)
    monkeypatch.setattr(verify, "read_task", lambda *_, **__: task)
    file = bench.folder / "mutant.json"
    save_proof(proved(index), problem, file)
    assert verify_file(file, problem, GAINS).answer == "infeasible"
    bench.judge(
        proof_mutants(index, bench.folder),
        f"proof {index}",
        file.name,
        "verify",
        str(file),
        "corridor.scenario.yaml",
    )


def log_mutants(folder: Path) -> list[Mutant]:
    path = folder / "sound.npz"
    synthetic_log(case("base"), samples=5).save(path)
    return list(documents.archive_mutants(path.read_bytes(), 23))


def test_malformed_logs_are_refused(tmp_path):
    """No command reads a log; who does gets an error that a command would answer with exit code 2."""
    mutants, file = log_mutants(tmp_path), tmp_path / "mutant.npz"
    check_count(mutants, "log")
    assert SimulationLog.load(tmp_path / "sound.npz").reached
    for mutant in mutants:
        file.write_bytes(mutant.content)
        with pytest.raises(PlanError) as caught:
            SimulationLog.load(file)
        message = str(caught.value)
        assert file.name in message, mutant
        assert mutant.key in message, mutant
        assert REMEDY in message, mutant
