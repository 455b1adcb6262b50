"""A team's models read in one document, where they need no other file.

Drake's reader prepares itself anew for every SDF file, which takes longer than to read a model.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from itertools import dropwhile, takewhile
from pathlib import Path

from pydrake.math import RigidTransform
from pydrake.multibody.parsing import AddModel, GetScopedFrameByName, ModelDirective, Parser

__all__ = ["read_together"]

_NEEDS_FILES = re.compile(r"<\s*(uri|include|world)\b")
_PLAIN_NAME = re.compile(r"(?!world$)[A-Za-z]\w*")


def read_together(directives: Sequence[ModelDirective], parser: Parser) -> bool:
    """Process directives that are models and then welds, as Drake would.

    The way is open only if all models are plain: SDF without meshes or models from other files, under a
    plain name, at no default positions.

    Args:
        directives: With resolved file addresses.
        parser: Adds the models to its plant.

    Returns:
        Whether everything is done, otherwise nothing is.

    Raises:
        RuntimeError: Drake refuses a model or a weld.
    """
    models = [directive.add_model for directive in takewhile(lambda d: d.add_model, directives)]
    welds = [directive.add_weld for directive in dropwhile(lambda d: d.add_model, directives)]
    if not models or not all(welds) or not all(_is_plain(model) for model in models):
        return False
    included = "".join(
        f"<include><uri>{escape(model.file)}</uri><name>{model.name}</name></include>" for model in models
    )
    parser.AddModelsFromString(f'<sdf version="1.9"><world name="models">{included}</world></sdf>', "sdf")
    plant = parser.plant()
    for weld in welds:
        X_PC = weld.X_PC.GetDeterministicValue() if weld.X_PC else RigidTransform()
        parent, child = (GetScopedFrameByName(plant, name) for name in (weld.parent, weld.child))
        plant.WeldFrames(parent, child, X_PC)
    return True


def _is_plain(model: AddModel) -> bool:
    path = Path(model.file.removeprefix("file://"))
    if path.suffix != ".sdf" or not _PLAIN_NAME.fullmatch(model.name):
        return False
    if model.default_joint_positions or model.default_free_body_pose:
        return False
    text = path.read_text(encoding="utf-8", errors="replace")
    return not _NEEDS_FILES.search(text) and len(re.findall(r"<\s*model\b", text)) == 1
