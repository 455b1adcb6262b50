"""``python -m benchmarks.files``: the files of the package that a reader opens to follow each answer.

Files are counted whose functions run while one function, the window, is running. Of compiled functions no
call is seen: those count that a function which ran, or another one of them, names. Every question is asked in
a process of its own. A whole table takes some minutes.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import CodeType, FrameType, ModuleType
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

PACKAGE = str(Path(__file__).parents[1] / "coop_drake") + os.sep
CLOSED = str(Path(__file__).parent / "scenarios" / "three_closed.scenario.yaml")
DEPLOYED = "deployment: {preset: mobile_base, budget: all}"
APART = ("apart",)
"""Folders that only robots as processes of their own need."""
_SIMULATED_SECONDS = 2.0
"""Simulated time in which the team of ``base`` enters its second cell [s]."""
COMPILER = ("jit.py", "compiling.py")
"""Files that load machine code; they answer no question."""


class Question(NamedTuple):
    """A question, the function that answers it, the scenario, and the most files there should be."""

    name: str
    window: str
    scenario: str
    most: int


QUESTIONS = {
    "channel": Question("a channel of base is found", "find_path", "base", 15),
    "proof": Question("a proof is made", "find_path", CLOSED, 15),
    "gains": Question("gains of a cell", "transition_gains", "base", 3),
    "budget": Question("a budget is decided", "tolerant_motion", "base", 6),
    "simulate": Question("a transport is simulated", "simulate", "base", 25),
}


def main() -> None:
    """Count the files for every question, or for those named, and show them in a table."""
    names = sys.argv[1:] or [*QUESTIONS, "apart"]
    table = Table("question", "files", "aim")
    listed: dict[str, list[str]] = {}
    with TemporaryDirectory() as folder:
        for name in names:
            if name == "apart":
                listed[name] = [
                    str(file)[len(PACKAGE) :] for part in APART for file in Path(PACKAGE, part).rglob("*.py")
                ]
                table.add_row("robots apart (files of their folders)", str(len(listed[name])), "12")
                continue
            question = QUESTIONS[name]
            listed[name] = _counted(name, Path(folder))
            table.add_row(f"{question.name} ({question.window})", str(len(listed[name])), str(question.most))
    for name, files in listed.items():
        sys.stdout.write(f"{name}: {' '.join(sorted(files))}\n")
    Console(highlight=False).print(table)


def _counted(name: str, folder: Path) -> list[str]:
    """Ask in a process of its own."""
    module = [sys.executable, "-m", "benchmarks.files"]
    given = folder / f"{name}.given"
    subprocess.run([*module, "--prepare", name, given], check=True)
    answer = subprocess.run([*module, "--ask", name, given], check=True, stdout=subprocess.PIPE, text=True)
    return answer.stdout.split()


def _prepare(name: str, given: Path) -> None:
    """Compute what the question begins with: for a simulation the plan."""
    import coop_drake

    scenario = coop_drake.load_scenario(QUESTIONS[name].scenario)
    ideal = (Path(PACKAGE).parent / "models" / "base.scenario.yaml").read_text()
    given.with_suffix(".scenario.yaml").write_text(f"{ideal}\n{DEPLOYED}")
    plan = coop_drake.plan(scenario).plan if name == "simulate" else None  # type: ignore[union-attr]
    given.write_bytes(pickle.dumps(plan))


def _ask(name: str, given: Path) -> None:
    """Answer the question and print the files whose functions ran inside the window."""
    import coop_drake

    window = QUESTIONS[name].window
    deployed = given.with_suffix(".scenario.yaml")
    scenario = coop_drake.load_scenario(deployed if name == "budget" else QUESTIONS[name].scenario)
    scenario = replace(scenario, simulator=replace(scenario.simulator, max_time=_SIMULATED_SECONDS))
    plan = pickle.loads(given.read_bytes())
    maps = () if plan is None else coop_drake.build_maps(plan)
    ran: dict[CodeType, dict[str, Any]] = {}
    depth = 0

    def count(frame: FrameType, event: str, _: Any) -> None:
        nonlocal depth
        code = frame.f_code
        if not code.co_filename.startswith(PACKAGE):
            return
        if event == "call":
            depth += code.co_name == window
            # Numba shows its functions with no globals; they are found by the names of those that call them.
            if depth and code.co_name != "<module>" and frame.f_globals:
                ran[code] = frame.f_globals
        elif event == "return" and code.co_name == window:
            depth -= 1
            if depth == 0 and name in ("channel", "proof", "budget"):
                raise _AnsweredError

    sys.setprofile(count)
    try:
        if plan is None:
            coop_drake.plan(scenario, effort=0.0)
        else:
            coop_drake.simulate(scenario, plan, maps)
    except _AnsweredError:
        pass
    finally:
        sys.setprofile(None)
    files = {code.co_filename[len(PACKAGE) :] for code in _with_compiled(ran)}
    sys.stdout.write("\n".join(files.difference(COMPILER)))


def _with_compiled(ran: dict[CodeType, dict[str, Any]]) -> set[CodeType]:
    """Add the compiled functions that functions name, and those that these name, to functions and globals."""
    found, new = set[CodeType](), list(ran.items())
    while new:
        code, known = new.pop()
        if code in found:
            continue
        found.add(code)
        named = [known[name] for name in code.co_names if name in known]
        modules = [vars(value) for value in named if isinstance(value, ModuleType)]
        named += [names[name] for names in modules for name in code.co_names if name in names]
        kernels = [value.py_func for value in named if hasattr(value, "py_func")]
        new += [(kernel.__code__, kernel.__globals__) for kernel in kernels]
    return found


class _AnsweredError(Exception):
    """The window's first call has returned: what follows answers other questions."""


if __name__ == "__main__":
    step = {"--prepare": _prepare, "--ask": _ask}.get(sys.argv[1] if len(sys.argv) > 1 else "")
    if step is None:
        main()
    else:
        step(sys.argv[2], Path(sys.argv[3]))
