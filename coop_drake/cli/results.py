"""The folder that a command writes its results into."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from errno import ENOTDIR
from os import strerror
from pathlib import Path

from coop_drake.errors import ScenarioError
from coop_drake.files import remove_unfinished, write_atomically
from coop_drake.viz.drawing_processes import joints_figure_name

_LARGEST_FRAME = 500
_FILES = {
    "plan": ("plan.json", "way.json", "certificate.json", "table_1.md"),
    "simulation": (
        "maps.json",
        "log.npz",
        "transport.html",
        "fig04_start_and_goal.png",
        "fig05_path.png",
        "fig06_position.png",
        "fig07_angle.png",
        "fig08_velocity.png",
        "fig09_angular_velocity.png",
        "fig12_force.png",
        "fig13_torque.png",
        "summary.png",
    ),
    "tuning": ("gains.yaml", "trials.json", "tuning.png"),
    "diagnosis": ("why.png", "why.svg"),
    "diagram": ("diagram.svg",),
    "search": (
        "think.png",
        "think.gif",
        "think.html",
        *(f"think_{frame:04d}.png" for frame in range(_LARGEST_FRAME + 1)),
    ),
}
"""Names of the files of every kind of result."""
_JOINT_FIGURES = "fig1[01]_joints_*.png"
"""A simulation has one for every robot, too."""

_MANIFEST = ".coop_drake_results.json"
"""The names of all files in a folder that this program wrote, or was about to write when it was killed."""


@dataclass(frozen=True)
class ResultFolder:
    """Where results go; every file in it is written under another name first and renamed when it is whole.

    The folder holds a list of the files that this program wrote, so that no other file is ever replaced or
    removed.

    Attributes:
        path: The folder; it is made when the first result is there.
    """

    path: Path

    @classmethod
    def of(cls, scenario: str, out: Path | None, *results: str, below: str = "") -> ResultFolder:
        """Return the folder that was asked for, or ``out/<scenario>`` and a folder below it.

        Args:
            scenario: The scenario's name.
            out: The folder that was asked for.
            results: What the command will write: keys of ``_FILES``.
            below: The folder below ``out/<scenario>``.

        Raises:
            ScenarioError: A file in the folder has the name of a result, and this program did not write it.
            OSError: The folder cannot be written.
        """
        folder = cls(out if out is not None else Path("out") / scenario / below)
        folder._refuse_files_of_others(results)
        _refuse_read_only(folder.path)
        return folder

    @property
    def plan(self) -> Path:
        """The plan."""
        return self.path / "plan.json"

    @property
    def way(self) -> Path:
        """The plan along a way that exists, which limits refuse."""
        return self.path / "way.json"

    @property
    def certificate(self) -> Path:
        """The proof that there is no plan."""
        return self.path / "certificate.json"

    @property
    def recording(self) -> Path:
        """The Meshcat recording."""
        return self.path / "transport.html"

    def begin(self, *results: str, robots: tuple[str, ...] = ()) -> None:
        """Remove the files of older results, so that the folder never mixes two, and note the new ones.

        Args:
            results: Keys of ``_FILES``. The caller writes files of these names next; they are noted before,
                so that a later run knows them even if this one is killed.
            robots: Names of the robots of a simulation.
        """
        noted = self._noted()
        for result in results:
            for name in noted.get(result, ()):
                (self.path / name).unlink(missing_ok=True)
            noted[result] = [*_FILES[result]]
            if result == "simulation":
                noted[result] += (f"{joints_figure_name(k, name)}.png" for k, name in enumerate(robots))
            remove_unfinished(self.path, noted[result])
        write_atomically(self.path / _MANIFEST, json.dumps(noted, indent=1).encode() + b"\n")

    def _noted(self) -> dict[str, list[str]]:
        """Names of the files that this program wrote into the folder; none if the list cannot be read."""
        try:
            noted = json.loads((self.path / _MANIFEST).read_bytes())
            known = {
                result: [Path(name).name for name in noted[result]] for result in _FILES if result in noted
            }
        except (OSError, ValueError, TypeError):
            return {}
        return known

    def _refuse_files_of_others(self, results: tuple[str, ...]) -> None:
        noted = self._noted()
        for result in results:
            figures = self.path.glob(_JOINT_FIGURES) if result == "simulation" else ()
            for name in (*_FILES[result], *(path.name for path in figures)):
                if name not in noted.get(result, ()) and (self.path / name).exists():
                    allowed = f"a folder without {name}, which would be replaced: another program wrote it"
                    raise ScenarioError(str(self.path / name), "--out", str(self.path), allowed)


def _refuse_read_only(folder: Path) -> None:
    """Write a file without a name into a folder, or into the one in which it would be made."""
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        raise NotADirectoryError(ENOTDIR, strerror(ENOTDIR), str(folder))
    with tempfile.TemporaryFile(dir=folder):
        pass
