"""Commands round the chain: help, examples, old names, completion, doctor, schema, show; quiet when piped."""

from __future__ import annotations

import json
import os
import pty
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import typer
from PIL import Image

import coop_drake
from coop_drake.answers import save_plan
from coop_drake.answers.document import problem_digest
from coop_drake.cli import app, doctor, options, show
from coop_drake.cli.app import _OLD_NAMES, _PANELS
from coop_drake.cli.options import complete_gains, complete_scenario
from coop_drake.cli.task import Task
from coop_drake.scenario import dump_scenario, load_scenario
from coop_drake.scenario.document import parse
from coop_drake.scenario.json_schema import scenario_schema
from tests.support.cases import case
from tests.support.cli import invoke
from tests.support.mutants import sampled, typed_mutants
from tests.support.small_plan import GOAL_POSE, ROOM, START_POSE, small_plan

MODELS = Path(__file__).parents[1] / "models"
SCENARIOS = sorted(MODELS.glob("*.scenario.yaml"))
TYPED = [Path("real.scenario.yaml"), *(Path("models") / path.name for path in SCENARIOS)]
"""Scenarios in examples: that of the guide to processes of their own, and the shipped ones."""
COMMAND = typer.main.get_command(app)
BLIND = ("nan", "inf", "-inf")
"""What JSON has no words for; loading refuses it all the same."""


def test_every_command_has_examples_and_its_help_shows_them():
    assert len(COMMAND.commands) == sum(map(len, _PANELS.values()))
    for module in (module for modules in _PANELS.values() for module in modules):
        name = module.__name__.rpartition(".")[2].replace("_", "-")
        text = " ".join(invoke(name, "--help", COLUMNS="300").output.split())
        for line, what in module.EXAMPLES:
            assert f"coop-drake {line}" in text
            assert what in text


@pytest.mark.parametrize(("words", "now"), _OLD_NAMES.items(), ids=lambda value: " ".join(value))
def test_an_old_name_says_the_new_one(words, now):
    command, part = words
    result = invoke(command, *([f"{part}=3" if part == "--workers" else part] if part else ()), COLUMNS="300")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert f"`{' '.join(words).strip()}` {now}." in " ".join(result.stderr.split())


def test_help_keeps_what_stands_in_brackets():
    """Words in brackets are markup to the table of options, which drops them: units are spelt out."""
    named = {**COMMAND.commands}
    for group in [one for one in named.values() if hasattr(one, "commands")]:
        named |= group.commands
    for name, command in named.items():
        for parameter in command.params:
            assert "[" not in (getattr(parameter, "help", None) or ""), (name, parameter.name)


@pytest.mark.parametrize(
    "line", [line for modules in _PANELS.values() for module in modules for line, _ in module.EXAMPLES]
)
def test_examples_are_commands_as_they_are(line):
    name, *arguments = shlex.split(line)
    command = COMMAND.commands[name]
    if hasattr(command, "commands"):
        first = arguments[0] if arguments[0] in command.commands else next(iter(command.commands))
        command, arguments = command.commands[first], arguments[arguments[0] == first :]
    scenario = command.make_context(name, arguments).params.get("scenario")
    assert scenario is None or scenario in TYPED


def test_an_argument_of_a_command_may_be_called_output(capsys):
    def tell(reporter, output: str):
        reporter.facts["told"] = output

    made = options.command(tell)
    assert list(made.__signature__.parameters) == ["output", "machine", "quiet"]
    with pytest.raises(typer.Exit):
        made(output="here", machine=True, quiet=True)
    assert json.loads(capsys.readouterr().out) == {"told": "here"}


def test_a_shell_gets_a_completion_script():
    environment = {**os.environ, "_COOP_DRAKE_COMPLETE": "source_bash"}
    program = "from coop_drake.cli import main; import sys; sys.argv = ['coop-drake']; main()"
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert "complete -o" in done.stdout
    assert "coop-drake" in done.stdout


def test_scenarios_are_completed_from_folders_on_the_way(tmp_path, monkeypatch):
    monkeypatch.chdir(MODELS.parent)
    assert complete_scenario("models/b") == ["models/base.scenario.yaml"]
    assert "models/" in complete_scenario("mod")
    assert complete_scenario("nowhere/b") == []
    assert complete_scenario("ba") == ["base"]


def test_gain_sets_are_completed_from_the_scenario(tmp_path):
    path = tmp_path / "own.scenario.yaml"
    path.write_text("gains: {sets: {gentle: !FixedGains {stiffness: 3}}}\n")
    context = typer.Context(COMMAND.commands["run"])
    context.params["scenario"] = path
    assert complete_gains(context, "") == ["gentle", "scheduled", "table_2"]
    assert complete_gains(context, "g") == ["gentle"]
    path.write_text("gains: [")
    assert complete_gains(context, "") == ["scheduled", "table_2"]


def test_the_schema_holds_for_every_shipped_scenario_and_for_all_that_is_spelt_out():
    validator = jsonschema.Draft202012Validator(scenario_schema())
    validator.check_schema(validator.schema)
    for path in SCENARIOS:
        validator.validate(parse(path.read_text()))
        validator.validate(parse(dump_scenario(load_scenario(path))))


@pytest.mark.slow
def test_the_schema_refuses_what_departs_from_it():
    validator = jsonschema.Draft202012Validator(scenario_schema())
    whole = parse(dump_scenario(load_scenario(MODELS / "base.scenario.yaml")))
    mutants = [one for one in typed_mutants(whole, skip=("directives",)) if not one.kind.startswith(BLIND)]
    for mutant in sampled(mutants, 60, 1):
        assert not validator.is_valid(parse(mutant.content.decode())), mutant


def test_every_key_of_the_schema_says_what_it_means():
    def silent(schema, path):
        for name, inner in schema.get("properties", {}).items():
            if "description" not in inner and name != "_tag":
                yield (*path, name)
            yield from silent(inner, (*path, name))

    assert list(silent(scenario_schema(), ())) == []


def test_the_schema_in_the_repository_is_that_of_the_types():
    """`python -m coop_drake.scenario.json_schema` prints it."""
    assert json.loads((MODELS / "scenario.schema.json").read_text()) == scenario_schema()


def test_the_doctor_finds_nothing_wrong_here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = invoke("doctor", "--json")
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    assert facts["healthy"] is True
    states = {finding["what"]: finding["state"] for finding in facts["findings"]}
    assert "opens port" in states["Meshcat"]
    assert states.keys() >= {"Python", "drake", "numpy", "shapely", "numba", "Drake", "fonts", "memory"}
    assert list(tmp_path.iterdir()) == []


def test_the_doctor_says_what_is_wrong_and_what_to_do(monkeypatch):
    def broken():
        raise ImportError("libdrake.so is not there")

    monkeypatch.setattr(doctor, "_CHECKS", (("Drake", broken, "install drake anew"),))
    monkeypatch.setattr("importlib.metadata.requires", lambda name: ["no-such-package>=1"])
    result = invoke("doctor", "--json")
    assert result.exit_code == 1
    facts = json.loads(result.stdout)
    assert facts["healthy"] is False
    for words in ("libdrake.so is not there: install drake anew", "no-such-package: missing: pip install"):
        assert words in facts["error"]


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_scenarios_and_plans_are_shown(ending, tmp_path, monkeypatch):
    goal, start = np.array(GOAL_POSE), np.array([*START_POSE, 0.0, 0.0])
    problem = replace(case("base"), workspace=ROOM, start=start, goal_pose=goal)
    names = tuple(joint.name for joint in problem.tree.joints)
    plan = replace(small_plan(names), problem=problem_digest(problem))
    file = save_plan(plan, tmp_path / "plan.json")
    task = Task(load_scenario("base"), problem)
    monkeypatch.setattr(show, "read_task", lambda *_, **__: task)
    target = tmp_path / "pictures" / f"room.{ending}"
    assert invoke("show", "room.scenario.yaml", "--out", target).exit_code == 0
    bare = target.read_bytes()
    assert invoke("show", "room.scenario.yaml", "--plan", file, "--out", target).exit_code == 0
    assert target.read_bytes() != bare
    if ending == "png":
        with Image.open(target) as picture:
            assert picture.size[0] > 600
    else:
        assert "<svg" in target.read_text()
    assert list(target.parent.iterdir()) == [target]


def test_no_other_kind_of_picture(tmp_path):
    result = invoke("show", MODELS / "base.scenario.yaml", "--out", tmp_path / "room.gif")
    assert result.exit_code == 2
    assert "neither in .png nor in .svg" in " ".join(result.output.split())


def test_what_only_a_clone_has_is_an_error_that_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(coop_drake, "__file__", str(tmp_path / "coop_drake" / "__init__.py"))
    result = invoke("reproduce")
    assert result.exit_code == 2
    assert "paper: not found" in result.stderr
    assert "a clone of the repository" in " ".join(result.stderr.split())


SHOWS = """
import sys, time
from coop_drake.cli.reporter import Reporter
reporter = Reporter(machine=False, quiet="-q" in sys.argv)
with reporter.stage("planning") as progress:
    progress("searching", 0.5)
reporter.say("[bold red]found[/]")
"""


def shown(*arguments, terminal, **environment):
    """What a reporter writes to a terminal or to a pipe."""
    clean = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "FORCE_COLOR")}
    env = {**clean, "TERM": "xterm-256color", **environment}
    command = [sys.executable, "-c", SHOWS, *arguments]
    if not terminal:
        return subprocess.run(command, env=env, capture_output=True, text=True, check=True).stdout
    master, slave = pty.openpty()
    with subprocess.Popen(command, env=env, stdout=slave, stderr=slave) as process:
        os.close(slave)
        chunks = []
        while chunk := _read(master):
            chunks.append(chunk)
    os.close(master)
    assert process.returncode == 0
    return b"".join(chunks).decode()


def _read(master: int) -> bytes:
    try:
        return os.read(master, 4096)
    except OSError:  # Linux says so where the other end is closed.
        return b""


def test_bars_and_colours_are_for_terminals():
    assert shown(terminal=False) == "found\n"
    seen = shown(terminal=True)
    assert "planning" in seen
    assert "\x1b[1;31mfound" in seen
    assert shown("-q", terminal=True) == ""
