"""The command doctor: checks that everything that the other commands need is there and works."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.task import map_cache

_LEAST_MEMORY = 1.0
"""Memory that a run needs, with a reserve: it peaks at about 0.6 [GB]."""

_PROCESSES = (
    ("coop_drake.planning.warm_up",),
    ("coop_drake.harmonic_maps.warm_up", "coop_drake.compiled_loop.warm_up"),
)
"""Modules that compile kernels, those of a process one after the other; both processes take about as long."""

_MARKS = {True: "[green]ok[/]", False: "[red]wrong[/]", None: "[yellow]note[/]"}

EXAMPLES = (
    ("doctor", "a table of what works"),
    ("doctor --json", "the same for machines"),
    ("doctor --warm", "compile all kernels ahead"),
    ("doctor --maps", "where solved maps are kept; `--clear-maps` forgets them"),
)


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    Attributes:
        what: What was checked.
        state: What was found.
        fine: Whether it is as it should be; None where it works but could be better.
        remedy: What to do where it is not fine.
    """

    what: str
    state: str
    fine: bool | None = True
    remedy: str = ""


def doctor_command(
    reporter: Reporter,
    warm: Annotated[
        bool,
        typer.Option("--warm", help="Compile all kernels ahead, so that the next command starts at once."),
    ] = False,
    maps: Annotated[
        bool, typer.Option("--maps", help="Show where solved maps are kept for later runs.")
    ] = False,
    clear_maps: Annotated[bool, typer.Option("--clear-maps", help="Delete all solved maps.")] = False,
) -> None:
    """Check the installation: versions, Drake, Meshcat, fonts, compiled parts, memory, caches.

    With an option it does what that says instead.
    """
    if warm:
        _compile_kernels(reporter)
    if maps or clear_maps:
        _show_maps(reporter, clear=clear_maps)
    if not (warm or maps or clear_maps):
        _diagnose(reporter)


def _compile_kernels(reporter: Reporter) -> None:
    """Compile all kernels, so that the next command starts at once; `make` does it when it sets up."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}  # They find what this one finds.
    programs = ["".join(f"import {one} as part; part.main()\n" for one in modules) for modules in _PROCESSES]
    processes = [
        subprocess.Popen(
            [sys.executable, "-P", "-c", program],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for program in programs
    ]
    with reporter.stage("compiling") as progress:
        try:
            for count, process in enumerate(processes):
                process.wait()
                progress("", (count + 1) / len(processes))
        finally:
            for process in processes:
                process.kill()
                process.wait()


def _diagnose(reporter: Reporter) -> None:
    """Show the results of all checks; a failed one makes the command fail."""
    findings = examine()
    wrong = [finding for finding in findings if finding.fine is False]
    reporter.facts.update(healthy=not wrong, findings=[asdict(finding) for finding in findings])
    rows = [(finding.what, f"{escape(finding.state)}  {_MARKS[finding.fine]}") for finding in findings]
    reporter.table("coop-drake doctor", rows)
    for finding in findings:
        if finding.fine is None:
            reporter.say(f"{finding.what}: {escape(finding.remedy)}")
    if wrong:
        reporter.complain("; ".join(f"{one.what}: {one.state}: {one.remedy}" for one in wrong))
        reporter.code = ExitCode.FAILED_RUN


def _show_maps(reporter: Reporter, *, clear: bool) -> None:
    """Say where solved maps are kept for later runs, and delete them if asked."""
    store = map_cache()
    count, size = len(store.files()), store.size() / 1e6
    if clear:
        store.clear()
    reporter.facts.update(folder=str(store.folder), maps=count, size_mb=round(size, 3), cleared=clear)
    verb = "Deleted" if clear else "There are"
    reporter.say(f"{verb} {count} maps of {size:.1f} MB in {escape(str(store.folder))}")


def examine() -> list[Finding]:
    """Run every check; an exception counts as a failed check."""
    enough = sys.version_info >= (3, 11)
    findings = [Finding("Python", platform.python_version(), enough, "install 3.11 or newer"), *_versions()]
    for what, check, remedy in _CHECKS:
        try:
            findings.append(check())
        except Exception as error:  # Whatever it is, the other findings help to understand it.
            findings.append(Finding(what, f"{type(error).__name__}: {error}", False, remedy))
    return findings


def _versions() -> Iterator[Finding]:
    from importlib.metadata import PackageNotFoundError, requires, version

    yield Finding("coop-drake", version("coop-drake"))
    core = [line.partition(";")[0] for line in requires("coop-drake") or [] if "extra ==" not in line]
    least = {name: numbers.split(",")[0] for name, _, numbers in (line.partition(">=") for line in core)}
    for name, needed in least.items():
        remedy = f"pip install '{name}>={needed}'"
        try:
            found = version(name)
        except PackageNotFoundError:
            yield Finding(name, "missing", False, remedy)
        else:
            yield Finding(name, found, _numbers(found) >= _numbers(needed), remedy)


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(".") if part.isdigit())


def _drake() -> Finding:
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    plant.Finalize()
    return Finding("Drake", f"imports, {plant.num_bodies()} body in an empty plant")


def _scenarios() -> Finding:
    from coop_drake.scenario import load_scenario
    from coop_drake.shipped import shipped_scenarios

    names = [load_scenario(path).name for path in shipped_scenarios().values()]
    return Finding("shipped scenarios", ", ".join(names) or "none", bool(names), "install coop-drake anew")


def _meshcat() -> Finding:
    from coop_drake.viz.recording import silent_meshcat

    return Finding("Meshcat", f"opens port {silent_meshcat().port()}")


def _fonts() -> Finding:
    from matplotlib import rcParams
    from matplotlib.font_manager import FontProperties, findfont

    path = findfont(FontProperties(family=rcParams["font.family"]), fallback_to_default=False)
    return Finding("fonts", Path(path).stem)


def _kernels() -> Finding:
    from numba import config

    home = Path(__file__).parents[1]
    compiled = sum(1 for _ in (Path(config.CACHE_DIR) if config.CACHE_DIR else home).rglob("*.nbc"))
    remedy = "`coop-drake doctor --warm` compiles them ahead; else the first run does, for a minute"
    return Finding("compiled kernels", f"{compiled} in the cache", True if compiled else None, remedy)


def _memory() -> Finding:
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    remedy = f"a run needs up to {_LEAST_MEMORY:g} GB"
    return Finding("memory", f"{total:.1f} GB", total >= _LEAST_MEMORY, remedy)


def _cores() -> Finding:
    return Finding("cores", str(os.cpu_count() or 1))


def _cache() -> Finding:
    store = map_cache()
    store.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=store.folder):
        pass
    return Finding("cache of maps", f"{len(store.files())} maps in {store.folder}, writable")


def _results() -> Finding:
    with tempfile.TemporaryFile(dir=Path.cwd()):
        pass
    return Finding("folder for results", f"{Path.cwd()}, writable")


_CHECKS: tuple[tuple[str, Callable[[], Finding], str], ...] = (
    (
        "Drake",
        _drake,
        "reinstall with pip install --force-reinstall drake; it needs a 64-bit glibc Linux or macOS",
    ),
    ("shipped scenarios", _scenarios, "install coop-drake anew"),
    ("Meshcat", _meshcat, "free a port from 7000 on; without one there are recordings but no live view"),
    ("fonts", _fonts, "install matplotlib anew"),
    ("compiled kernels", _kernels, "let numba write beside the package, or set NUMBA_CACHE_DIR"),
    ("memory", _memory, ""),
    ("cores", _cores, ""),
    ("cache of maps", _cache, "let COOP_DRAKE_CACHE name a folder that can be written"),
    ("folder for results", _results, "change to a folder that can be written, or use --out"),
)
"""What is checked, by which function, and what to do if that raises an error."""
