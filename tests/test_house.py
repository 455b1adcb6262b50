"""The house: captions, sorted names, and a planning side that knows nothing of Drake."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HOUSE = ROOT / "coop_drake"
ROOMS = sorted(path.parent for path in [*HOUSE.glob("*/__init__.py"), ROOT / "paper" / "__init__.py"])
WITHOUT_DRAKE = [
    "errors",
    "tree",
    "geometry",
    "drawing",
    "harmonic_maps",
    "laws",
    "answers",
    "planning",
    "diagnosis",
    "watching",
    "floor_plans",
]


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.name)
def test_a_room_opens_with_a_caption_and_a_sorted_list_of_names(room):
    caption = ast.get_docstring(ast.parse((room / "__init__.py").read_text()))
    assert caption
    assert "\n" not in caption
    assert caption.endswith(".")
    names = listed_names(room)
    assert names
    assert names == sorted(set(names), key=lambda name: (not name.isupper(), not name[0].isupper(), name))


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.name)
def test_every_name_that_a_room_lists_is_there(room):
    package = import_module(".".join(room.relative_to(ROOT).parts))
    assert [name for name in listed_names(room) if not hasattr(package, name)] == []


def listed_names(room):
    """The names in ``__all__``: of the stub where names are loaded when first used, else of the package."""
    stub = room / "__init__.pyi"
    tree = ast.parse((stub if stub.exists() else room / "__init__.py").read_text())
    (names,) = [
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign)
        and any(isinstance(target, ast.Name) and target.id == "__all__" for target in node.targets)
    ]
    return names


def test_the_planning_side_imports_without_drake():
    rooms = "; ".join(f"from coop_drake.{room} import *" for room in WITHOUT_DRAKE)
    code = f"import sys; {rooms}; sys.exit('pydrake' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_laws_import_without_shapes_and_graphs():
    loaded = "{'shapely', 'networkx'} & set(sys.modules)"
    code = f"import sys; from coop_drake.laws import *; sys.exit(bool({loaded}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_picture_of_contributing_has_every_package_and_nothing_else():
    text = (HOUSE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (picture,) = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    packages = {path.parent.name for way in ("*", "*/*") for path in HOUSE.glob(f"{way}/__init__.py")}
    assert set(re.findall(r"(\w+)/", picture)) == packages
    for path in re.findall(r"^- [^`]+: `([\w/]+\.py)`$", text, flags=re.MULTILINE):
        assert (HOUSE / path).is_file()
