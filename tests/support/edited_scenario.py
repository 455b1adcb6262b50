"""Shipped files with a few words exchanged, written into a folder of their own."""

from pathlib import Path

import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.errors import ScenarioError
from coop_drake.plant import TeamPlant, build_team_plant
from coop_drake.scenario import Scenario, load_scenario

MODELS = Path(__file__).parents[2] / "models"


def exchanged(text: str, *pairs: tuple[str, str]) -> str:
    """The text with the first occurrence of every old part exchanged; all of them must be there."""
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def write_edited(folder: Path, *pairs: tuple[str, str], case: str = "base", **files: str) -> Path:
    """Write a shipped scenario with parts exchanged, and other files beside it.

    Args:
        folder: Where to write.
        pairs: Old and new part, each exchanged once.
        case: The shipped scenario.
        files: Further files; what follows the last underscore becomes the ending, ``arm_sdf`` is arm.sdf.
    """
    for name, text in files.items():
        stem, _, ending = name.rpartition("_")
        (folder / f"{stem}.{ending}").write_text(text)
    path = folder / "edited.scenario.yaml"
    path.write_text(exchanged((MODELS / f"{case}.scenario.yaml").read_text(), *pairs))
    return path


def write_with_robot(folder: Path, text: str, ending: str = "sdf", *pairs: tuple[str, str]) -> Path:
    """The base scenario with another robot_0, given as the text of its model."""
    (folder / f"other.{ending}").write_text(text)
    return write_edited(folder, ("package://coop_drake_models/long_blue.sdf", f"other.{ending}"), *pairs)


def shipped(name: str) -> Scenario:
    """A shipped scenario by name."""
    return load_scenario(MODELS / f"{name}.scenario.yaml")


def team_of(scenario: Scenario) -> tuple[TeamPlant, DiagramBuilder]:
    """The team's plant; keep the builder as long as it is used."""
    builder = DiagramBuilder()
    return build_team_plant(scenario, builder), builder


def check_refusal(folder: Path, pair: tuple[str, str], key: str, value: object, allowed: str) -> None:
    """Check that an edited scenario is refused with file, key, value (`...` for any) and what is allowed."""
    path = write_edited(folder, pair)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert caught.value.file == str(path)
    assert caught.value.key == key
    if value is not ...:
        assert caught.value.value == value
    assert allowed in caught.value.allowed
    assert str(caught.value).startswith(f"{path}: {key}: ")
