"""What a clone of the repository has and an installed package lacks: benchmarks and the paper's report."""

from __future__ import annotations

from pathlib import Path

import coop_drake
from coop_drake.errors import CoopDrakeError


def root_of_clone(package: str) -> Path:
    """Return the folder of the clone that coop_drake runs from, where a top-level package stands beside it.

    Raises:
        CoopDrakeError: The package is not there, as in an installed coop_drake.
    """
    root = Path(coop_drake.__file__).resolve().parent.parent
    if not (root / package / "__init__.py").is_file():
        raise CoopDrakeError(
            f"{root}: {package}: not found: an installed package comes without it; expected a clone of the "
            f"repository, whose folder {package} holds what this command runs"
        )
    return root
