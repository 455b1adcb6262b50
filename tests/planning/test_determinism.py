"""The same question has the same plan, byte for byte, whatever the hash seed and the number of threads."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

_SCRIPT = """
import sys
from pathlib import Path
from coop_drake.laws import ScheduledGains
from coop_drake.answers import save_plan
from coop_drake.planning import planner
from tests.support.passages import FoldingArm
problem = FoldingArm().problem(0.6)
result = planner.plan(problem, ScheduledGains(), gain_set_name="scheduled")
save_plan(result.plan, Path(sys.argv[1]))
print(result.report.slices)
"""


def planned(directory: Path, hash_seed: str, threads: str) -> tuple[bytes, str]:
    """Plan in a process of its own; returns the plan file's bytes and what was told."""
    path = directory / f"plan_{hash_seed}_{threads}.json"
    names = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, **dict.fromkeys(names, threads)}
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(path)],
        env=environment,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return path.read_bytes(), done.stdout


@pytest.mark.slow
def test_hash_seeds_and_threads_change_no_byte(tmp_path: Path) -> None:
    first, second = planned(tmp_path, "0", "1"), planned(tmp_path, "4242", "2")
    assert first == second
