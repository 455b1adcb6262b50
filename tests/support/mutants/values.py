"""Scenarios with numbers that are not allowed: each key with values outside what its documentation allows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from tests.support.mutants.mutant import Mutant, Place, block, dotted, put, without

_GAINS = [
    "governor_gain",
    "stiffness",
    "damping",
    "angle_decay_rate",
    "joint_decay_rate",
    "log_gain",
    "wall_stiffness",
    "min_stiffness",
    "max_stiffness",
    "damping_factor",
    "governor_factor",
    "funnel_acceleration",
    "goal_acceleration",
    "turning_coupling",
    "turning_acceleration",
    "min_decay_rate",
    "decay_fraction",
    "max_log_gain",
    "log_fraction",
    "log_acceleration",
    "saturation",
    "command_age",
    "age_phase",
    "max_rate_gain",
    "position_fraction",
    "ramp_fraction",
    "entry_rate",
    "position_gain",
    "rate_gain",
    "limit_gain",
    "energy_factor",
    "energy_allowance",
]
_POSITIVE = [
    "goal.tolerances.position",
    "goal.tolerances.angle",
    "goal.tolerances.joint",
    "planner.angle_resolution",
    "planner.length_resolution",
    "planner.max_slices",
    "planner.min_clearance",
    "planner.max_transition_time",
    "maps.tolerance",
    "simulator.max_time",
    "simulator.max_step_size",
    "simulator.accuracy",
    "visualization.frames_per_second",
    "visualization.wall_height",
    "deployment.measurements.waves.joint_rates.period",
]
_NOT_NEGATIVE = [
    "planner.margin",
    "planner.slice_overlap",
    "deployment.seed",
    "deployment.measurements.position_noise",
    "deployment.measurements.angle_noise",
    "deployment.measurements.rate_noise",
    "deployment.measurements.delay",
    "deployment.messages.loss",
    "deployment.messages.repeat",
    "deployment.messages.delay",
    "deployment.actuators.lag",
    "deployment.measurements.loss",
    "deployment.measurements.late",
    "deployment.measurements.late_by",
    "deployment.measurements.waves.angle.size",
    "deployment.floor.coulomb_friction",
    "deployment.floor.viscous_friction",
    "deployment.joint_friction.coulomb",
    "deployment.joint_friction.viscous",
]
_BEYOND = {
    "planner.slice_overlap": (1.5, "slices overlap by a part of their width"),
    "maps.tolerance": (0.5, "the error would be half the disk"),
    "simulator.accuracy": (1.0, "an error as large as the value is none"),
    "deployment.mass_error": (-1.5, "masses would be negative"),
    "limits": ({"nobody": {"base_speed": 1.0}}, "no robot has this name"),
    "deployment.control_rate": (-100.0, "time does not run backwards"),
    "deployment.budget": ("half", "there is none of that name"),
    "deployment.messages.loss": (1.5, "it is a probability"),
    "deployment.messages.repeat": (2, "it is a probability"),
    "deployment.measurements.delay": (1e5, "nothing is measured a day late"),
    "deployment.messages.delay": (1e5, "no message travels for a day"),
    "deployment.actuators.base_force": (0.0, "nothing would move"),
    "deployment.actuators.base_torque": (-5.0, "limits are magnitudes"),
    "deployment.actuators.joint_effort": (0.0, "nothing would move"),
    "deployment.actuators.lag": (60.0, "a motor does not take minutes"),
    "deployment.measurements.loss": (1.5, "it is a probability"),
    "deployment.measurements.waves.x.phase": (1.5, "it is a part of a period"),
    "deployment.start_offset.joints": ([0.1] * 9, "the team has fewer joints"),
    "deployment.floor.slope": (30.0, "it is an angle in radians"),
    "planner.strategy": ("astar", "no strategy has this name"),
    "simulator.integration_scheme": ("runge_kutta7", "no integrator has this name"),
    "gains.selected": ("table_3", "no gain set has this name"),
}
_NEEDS_RATE = (
    "measurements.position_noise",
    "measurements.delay",
    "measurements.loss",
    "messages.loss",
    "messages.delay",
)
_OF_ROBOT = {
    "pose_bias": ({"x": "left"}, "it is a length"),
    "odometry_scale": (-1.5, "rates would be negative"),
    "sample_offset": (0.01, "there is no sampling, and at 200 Hz it would be the next sample"),
    "clock_error": (100.0, "no clock is minutes ahead"),
    "switch_delay": (-0.1, "nothing is heard before it is said"),
    "silence": ({"duration": 1.0}, "it begins at some time"),
    "blocked": ({"begin": 1.0, "duration": -1.0}, "it lasts for a while"),
    "slip": ({"begin": 1.0, "share": 1.5}, "no more than all can be lost"),
}
_PUSH = {"body": "object", "force": [1.0, 2.0], "time": 1.0, "duration": 1.0}
_OF_PUSH = {
    "body": ("nobody", "no body has this name"),
    "force": ([1.0], "it has two coordinates"),
    "time": (-1.0, "the run begins at zero"),
    "duration": (0.001, "a step of the simulation may miss it"),
    "torque": ("much", "it is a number"),
}


def value_mutants(data: dict[str, Any]) -> Iterator[Mutant]:
    """Values out of range in a scenario that spells out every section."""
    for key in _POSITIVE:
        for value in (0, -1) if key == "planner.max_slices" else (0.0, -0.5):
            yield _mutant("not positive", data, _path(key), value, "it is a size, a time or a count")
    for key in _NOT_NEGATIVE:
        value = -1 if key == "deployment.seed" else -0.25
        yield _mutant("negative", data, _path(key), value, "it is a length, a fraction or a count")
    for key, (value, because) in _BEYOND.items():
        yield _mutant("out of range", data, _path(key), value, because)
    for name in _NEEDS_RATE:
        because = "controllers in continuous time neither measure nor report at instants"
        yield _mutant("without a control rate", data, _path(f"deployment.{name}"), 0.001, because)
    yield from _departures(data)
    yield from _gains(data)
    yield from _load_shares(data)


def joint_mutants(data: dict[str, Any]) -> Iterator[Mutant]:
    """Joint values that do not fit the robots: wrong counts, unknown robots, beyond every limit, degrees."""
    data = put(data, ("goal", "joints"), {})
    for robot, values in data["start"]["joints"].items():
        for section, because in (
            ("start", "every joint has one value"),
            ("goal", "every joint has one entry"),
        ):
            place = (*_path(f"{section}.joints"), robot)
            yield _mutant("a value too many", data, place, [*values, 0.1], because)
            yield _mutant("a value too few", data, place, values[:-1], because)
            degrees = [45.0, *values[1:]]
            yield _mutant("degrees for radians", data, place, degrees, "seven turns are beyond every limit")
        place = ("start", "joints", robot)
        yield Mutant(
            "robot without a start", dotted(place), "its joints must stand somewhere",
            block(without(data, place)).encode(), dotted(place),
        )  # fmt: skip
        unknown = ("start", "joints", f"{robot}_b")
        yield _mutant("unknown robot", data, unknown, values, "no robot has this name")
        yield _mutant("nothing as a start", data, place, [None] * len(values), "a start is a number")
        unknown = ("goal", "joints", f"{robot}_b")
        yield _mutant("unknown robot", data, unknown, values, "no robot has this name")


def place_mutants(
    data: dict[str, Any], outside: tuple[float, float], wall: tuple[float, float]
) -> Iterator[Mutant]:
    """Starts and goals off the floor or in a wall, and in another unit than the floor.

    Args:
        data: The scenario.
        outside: A point off the floor, further than any body reaches.
        wall: A point of the floor's boundary.
    """
    for section in ("start", "goal"):
        place, pose = (section, "object"), data[section]["object"]
        centimetres = {**pose, "x": 100.0 * pose["x"], "y": 100.0 * pose["y"]}
        names = "start" if section == "start" else "goal.object"
        for what, value, because in (
            ("off the floor", {**pose, "x": outside[0], "y": outside[1]}, "the floor does not reach there"),
            ("in a wall", {**pose, "x": wall[0], "y": wall[1]}, "the object's centre lies on the wall"),
            ("centimetres for metres", centimetres, "the floor does not reach there"),
        ):
            yield Mutant(
                f"{section} {what}", dotted(place), because, block(put(data, place, value)).encode(), names
            )


def _gains(data: dict[str, Any]) -> Iterator[Mutant]:
    for name, gains in data["gains"]["sets"].items():
        for gain in _GAINS:
            if gain in gains:
                for value in (0.0, -1.0):
                    path = ("gains", "sets", name, gain)
                    yield _mutant("gain not positive", data, path, value, "the loop would not be stable")
        path = ("gains", "sets", name)
        yield _mutant("negative smoothing", data, (*path, "smoothing"), -0.1, "it is a length")
        yield _mutant("unknown funnel", data, (*path, "funnel"), "square", "no funnel has this shape")
        yield _mutant("energy below rest", data, (*path, "energy_factor"), 0.5, "no transition could begin")
        unknown = {**gains, "_tag": "!OtherGains"}
        yield _mutant("unknown tag", data, path, unknown, "no class has this name")
        bare = {key: value for key, value in gains.items() if key != "_tag"}
        yield _mutant("missing tag", data, path, bare, "it could be either class")
        if "min_stiffness" in gains:
            value, why = 2.0 * gains["max_stiffness"], "the least is above the most"
            yield _mutant("bounds exchanged", data, (*path, "min_stiffness"), value, why)


def _departures(data: dict[str, Any]) -> Iterator[Mutant]:
    robot = next(iter(data["start"]["joints"]))
    entries = [
        ("robots", f"{robot}.{key}", {robot: {key: value}}, because)
        for key, (value, because) in _OF_ROBOT.items()
    ]
    entries.append(("robots", "nobody", {"nobody": {}}, "no robot has this name"))
    for key, (value, because) in _OF_PUSH.items():
        entries.append(("pushes", f"[0].{key}", [{**_PUSH, key: value}], because))
    for section, key, value, because in entries:
        mutant = _mutant("departure", data, ("deployment", section), value, because)
        yield replace(mutant, key=f"deployment.{section}.{key}".replace(".[", "["))


def _load_shares(data: dict[str, Any]) -> Iterator[Mutant]:
    robots = list(data["start"]["joints"])
    even = dict.fromkeys(robots, 1.0 / len(robots))
    for what, shares, because in (
        ("shares below one", {**even, robots[0]: 0.1}, "they do not sum to one"),
        ("shares above one", {**even, robots[-1]: 0.9}, "they do not sum to one"),
        ("negative share", {**even, robots[0]: -0.5, robots[1]: 1.5}, "a part of the work is none less"),
        ("share of nobody", {**even, "robot_9": 0.0}, "no robot has this name"),
        ("robot without a share", {robots[0]: 1.0}, "the others have none"),
        ("share of no number", {**even, robots[0]: float("nan")}, "it is no number"),
    ):
        yield _mutant(what, data, ("load_shares",), shares, because)


def _path(key: str) -> Place:
    return tuple(key.split("."))


def _mutant(kind: str, data: dict[str, Any], path: Place, value: Any, because: str) -> Mutant:
    return Mutant(
        kind, f"{dotted(path)} = {value}"[:80], because, block(put(data, path, value)).encode(), dotted(path)
    )
