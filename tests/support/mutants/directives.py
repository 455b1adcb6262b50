"""Scenarios whose directives make no team: names, files, frames and welds that do not fit each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from tests.support.mutants.mutant import Mutant, Place, at, block, dotted, put, renamed, without

Change = tuple[str, Any, str]


def directive_mutants(data: dict[str, Any]) -> Iterator[Mutant]:
    """Broken directives; those that only Drake can judge come with :func:`frame_mutants`."""
    for index, directive in enumerate(data["directives"]):
        (kind,) = directive
        path: Place = ("directives", index, kind)
        for name in directive[kind]:
            here = (*path, name)
            yield _mutant("directive lacks a key", here, "it has no default", without(data, here), path)
            yield _mutant(
                "misspelt key of a directive",
                here,
                "no key has this name",
                renamed(data, here, name + "s"),
                path,
            )
            for value in (3, [1, 2], {"a": 1}, ""):
                yield _mutant(
                    f"{value!r} in a directive", here, "a name is a text", put(data, here, value), path
                )
        yield from _whole(data, index, kind)
        changes = _of_model if kind == "add_model" else _of_weld
        for what, value, because in changes(directive[kind]):
            yield _mutant(what, path, because, put(data, path, value), ("directives",))
    yield from _teams(data)


def frame_mutants(data: dict[str, Any]) -> Iterator[Mutant]:
    """Welds to frames that no model has."""
    for index, directive in enumerate(data["directives"]):
        for end in ("parent", "child") if "add_weld" in directive else ():
            path: Place = ("directives", index, "add_weld", end)
            value = at(data, path).partition("::")[0] + "::no_such_frame"
            yield _mutant(
                "unknown frame", path, "the model has no such frame", put(data, path, value), path[:2]
            )


def _whole(data: dict[str, Any], index: int, kind: str) -> Iterator[Mutant]:
    path: Place = ("directives", index)
    directive = at(data, path)
    for what, value, because in (
        ("directive of nothing", None, "it says nothing"),
        ("directive of a text", "add_model", "it is a mapping"),
        ("empty directive", {}, "it says nothing"),
        ("unknown directive", {"add_robot": directive[kind]}, "no directive has this name"),
        (
            "two in one",
            {**directive, "add_frame": {"name": "f", "X_PF": {"base_frame": "object::body"}}},
            "one each",
        ),
        ("directive of a list", {kind: [directive[kind]]}, "its content is a mapping"),
    ):
        yield _mutant(what, path, because, put(data, path, value), path)


def _of_model(model: dict[str, Any]) -> Iterator[Change]:
    for file, because in (
        ("package://coop_drake_models/none.sdf", "there is no such file"),
        ("package://no_such_package/object.sdf", "there is no such package"),
        ("package://", "it names no package"),
        ("nowhere/robot.sdf", "there is no such file"),
        ("file:///no/such/robot.urdf", "there is no such file"),
        ("https://example.org/robot.sdf", "it is not on this machine"),
        ("robot.xml", "the ending tells formats apart"),
        (".", "it is a folder"),
        ("robot.sdf\0", "no file has such a name"),
    ):
        yield f"file {file!r}", {**model, "file": file}, because
    yield "scoped name", {**model, "name": "a::b"}, ":: separates models from what is in them"
    yield "joints in a directive", {**model, "default_joint_positions": {"elbow": [0.1]}}, "start says it"
    pose = {"base": {"translation": [0.0, 0.0, 1.0]}}
    yield "pose in a directive", {**model, "default_free_body_pose": pose}, "start says it"


def _of_weld(weld: dict[str, Any]) -> Iterator[Change]:
    for end in ("parent", "child"):
        yield f"{end} of nobody", {**weld, end: "robot_9::gripper"}, "no model has this name"
        yield f"{end} without a model", {**weld, end: "gripper"}, "no model is named"
    yield "weld to itself", {**weld, "child": weld["parent"]}, "it joins a model to itself"
    for value in (math.nan, math.inf, 1e300):
        pose = {"translation": [0.0, value, 0.0]}
        yield f"weld at {value}", {**weld, "X_PC": pose}, "it is nowhere"
    for pose, because in (
        ({"translation": [0.0, 1.0]}, "a place has three coordinates"),
        ({"translation": "far"}, "a place has three coordinates"),
        ({"rotation": {"_tag": "!Rpy", "deg": [0.0, 90.0]}}, "three angles turn a body"),
        ({"rotation": {"_tag": "!Spin", "deg": 3.0}}, "no rotation has this name"),
        ({"rotation": {"_tag": "!Uniform"}}, "a grasp is one pose and no distribution"),
        ({"base_frame": "object::body"}, "the weld's parent is the frame"),
        ({"place": [0.0, 0.0, 0.0]}, "no key has this name"),
    ):
        yield f"weld with {pose}", {**weld, "X_PC": pose}, because


def _teams(data: dict[str, Any]) -> Iterator[Mutant]:
    entries = data["directives"]
    path: Place = ("directives",)
    models = [entry for entry in entries if "add_model" in entry]
    welds = [entry for entry in entries if "add_weld" in entry]
    for what, value, because in (
        ("no directives", [], "there is no team"),
        ("nobody but the object", models[:1], "nobody carries it"),
        ("one robot", [*models[:2], welds[0]], "one robot is no team"),
        ("robots that hold nothing", models, "nobody carries the object"),
        ("everything twice", entries + entries, "names come twice"),
        ("welds before models", welds + models, "they speak of models that are not there yet"),
        (
            "a set of directives in itself",
            [*entries, {"add_directives": {"file": "mutant.scenario.yaml"}}],
            "endless",
        ),
        (
            "directives from nowhere",
            [*entries, {"add_directives": {"file": "none.dmd.yaml"}}],
            "no such file",
        ),
    ):
        yield _mutant(what, path, because, put(data, path, value), path)
    for k in range(len(welds)):
        fewer = models + welds[:k] + welds[k + 1 :]
        yield _mutant("robot that holds nothing", path, "it carries nothing", put(data, path, fewer), path)
        more = models + welds + [welds[k]]
        yield _mutant("robot that holds twice", path, "two grasps close a loop", put(data, path, more), path)
    for k in range(1, len(models)):
        same = [*models[:k], models[k - 1], *models[k + 1 :], *welds]
        yield _mutant(
            "two models of one name", path, "nobody can tell them apart", put(data, path, same), path
        )
    for name in ("robot_9", "", "object::body"):
        because = "no model has this name"
        yield _mutant(
            "object of another name", ("object",), because, put(data, ("object",), name), ("object",)
        )


def _mutant(kind: str, path: Place, because: str, data: Any, key: Place) -> Mutant:
    return Mutant(kind, dotted(path), because, block(data).encode(), dotted(key))
