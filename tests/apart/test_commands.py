"""Address books, keys and the commands of processes: what is read, written, shown and refused."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from coop_drake.apart import team_files
from coop_drake.apart.messages import SUPERVISOR, WORLD
from coop_drake.cli import app
from coop_drake.cli.summary import process_lines
from coop_drake.errors import ScenarioError
from coop_drake.scenario.document import parse, write
from tests.support.cli import invoke

BASE = str(Path(__file__).parents[2] / "models" / "base.scenario.yaml")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", BASE, "--apart"], "deployment.control_rate"),
        (["apart", "world", BASE], "deployment.control_rate"),
        (["apart", "supervisor", BASE], "deployment.control_rate"),
        (["run", BASE, "--free-running"], "--free-running needs --apart"),
        (["run", BASE, "--faults", "faults.yaml"], "--faults needs --apart"),
        (["verify", "plan.json", BASE, "--braked"], "--braked is about the log of a run"),
    ],
)
def test_what_processes_cannot_do_is_bad_input(arguments, said):
    result = CliRunner(env={"COLUMNS": "300"}).invoke(app, arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())


def test_the_closing_lines_tell_of_every_process_and_of_ages():
    processes = [{"name": "robot 0", "state": "gone", "team_messages": 7, "refused": 2}]
    ages = {"median": 0.001, "high": 0.002, "largest": 0.02, "allowed": 0.01}
    ages |= {"late": 1, "count": 90, "slipped": 0.5}
    lines = process_lines({"processes": processes, "refused": {"KIND": 2, "VALUE": 1}, "command_ages": ages})
    assert lines == [
        "robot 0: gone, 7 messages sent to the team, 2 refused",
        "the world: 3 messages refused",
        "Ages of commands: median 1.0 ms, 99.9 % below 2.0 ms, largest 20.0 ms; "
        "allowed 10.0 ms, exceeded by 1 of 90",
        "The wall clock was 0.50 s ahead of the simulated time at the end",
    ]
    assert process_lines({}) == []


TEAM = (0, 1, SUPERVISOR, WORLD)


def test_a_book_comes_back_as_it_was(tmp_path):
    for keys in ({}, {index: team_files.make_keys() for index in TEAM}):
        book = team_files.local_book(2, keys)
        path = tmp_path / "addresses.yaml"
        path.write_text(team_files.dump_address_book(book))
        assert team_files.load_address_book(path, 2) == book
        assert book.secured == bool(keys)
        assert [book.key_of(index) for index in TEAM] == [
            keys[index].public if keys else None for index in TEAM
        ]


def altered(change):
    document = parse(
        team_files.dump_address_book(
            team_files.local_book(2, {index: team_files.make_keys() for index in TEAM})
        )
    )
    change(document)
    return write(document)


def at(address):
    return lambda book: book["world"].update(address=address)


def shared(entry, other):
    return lambda book: book["world"].update({entry: book[other][entry]})


def outside(document):
    for entry in (document["world"], document["supervisor"], *document["robots"]):
        del entry["key"]
    document["supervisor"]["address"] = "tcp://192.168.1.5:5602"


@pytest.mark.parametrize(
    ("change", "key", "allowed"),
    [
        (outside, "world.key", "a public key: supervisor.address is no address of this machine alone"),
        (lambda book: book["robots"][1].pop("key"), "robots[1].key", "because others have one"),
        (at("tcp://localhost:1"), "world.address", "tcp://A.B.C.D:PORT"),
        (at("tcp://1.2.3.400:1"), "world.address", "tcp://A.B.C.D:PORT"),
        (at("tcp://127.0.0.1:0"), "world.address", "port from 1 to 65535"),
        (shared("address", "supervisor"), "supervisor.address", "of its own"),
        (shared("key", "supervisor"), "key", "of its own for each process"),
        (lambda book: book["world"].update(key="short"), "world.key", "40 characters"),
        (lambda book: book["robots"].pop(), "robots", "a list of 2, as in the scenario"),
    ],
)
def test_a_wrong_book_is_refused_with_file_key_and_what_is_allowed(tmp_path, change, key, allowed):
    path = tmp_path / "addresses.yaml"
    path.write_text(altered(change))
    with pytest.raises(ScenarioError) as refused:
        team_files.load_address_book(path, 2)
    assert (refused.value.file, refused.value.key) == (str(path), key)
    assert allowed in refused.value.allowed


def test_private_keys_are_for_their_owner_alone_and_never_shown(tmp_path):
    path, keys = tmp_path / "robot_0.key", team_files.make_keys()
    team_files.save_keys(path, keys)
    assert path.stat().st_mode & 0o777 == 0o600
    assert team_files.load_keys(path) == keys
    assert keys.private not in repr(keys)
    with pytest.raises(FileExistsError):
        team_files.save_keys(path, keys)
    path.chmod(0o640)
    with pytest.raises(ScenarioError, match=r"permissions: '640' is not allowed; expected .* chmod 600"):
        team_files.load_keys(path)


def test_a_file_that_holds_no_pair_of_keys_is_refused_without_showing_it(tmp_path):
    mixed = team_files.KeyPair(team_files.make_keys().public, team_files.make_keys().private)
    team_files.save_keys(tmp_path / "mixed.key", mixed)
    with pytest.raises(ScenarioError, match="secret-key") as refused:
        team_files.load_keys(tmp_path / "mixed.key")
    assert mixed.private not in str(refused.value)
    (tmp_path / "empty.key").touch(mode=0o600)
    for name in ("empty.key", "none.key"):
        with pytest.raises(ScenarioError, match="the file"):
            team_files.load_keys(tmp_path / name)


def test_team_files_fit_together_and_each_process_has_its_own_key(tmp_path):
    book_file, *key_files = team_files.make_team_files(
        tmp_path / "keys", 2, ("192.168.1.10", "192.168.1.11"), 5600
    )
    book = team_files.load_address_book(book_file, 2)
    assert book.world.address == "tcp://192.168.1.10:5600"
    assert book.supervisor.address == "tcp://192.168.1.11:5601"
    assert [path.name for path in key_files] == ["world.key", "supervisor.key", "robot_0.key", "robot_1.key"]
    pair = team_files.load_own_keys(book, SUPERVISOR, key_files[1])
    assert pair is not None
    assert pair.public == book.supervisor.key
    with pytest.raises(ScenarioError, match="the key that the address book has for this process"):
        team_files.load_own_keys(book, 0, key_files[1])
    with pytest.raises(ScenarioError, match=r"--key FILE, as robot_1\.key"):
        team_files.load_own_keys(book, 1, None)
    assert team_files.load_own_keys(team_files.local_book(2), 1, None) is None


def test_the_command_writes_them_once(tmp_path):
    said = invoke("apart", "keys", "--robots", 3, "--out", tmp_path / "keys", "--json", "--quiet")
    assert said.exit_code == 0
    assert len(json.loads(said.stdout)["files"]) == 6
    for wrong, words in (
        (("--out", tmp_path / "keys"), "a new or an empty folder"),
        (("--out", tmp_path / "other", "--world", "here"), "--world and --port"),
        (("--out", tmp_path / "other", "--robots", 0), "--robots"),
    ):
        refused = invoke("apart", "keys", *wrong)
        assert refused.exit_code == 2
        assert words in " ".join(refused.output.split())
    assert not (tmp_path / "other").exists()
