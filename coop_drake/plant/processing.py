"""Drake's reader of models, with what it says on the way: an error, or warnings that amount to one."""

import logging
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import (
    ModelDirective,
    ModelDirectives,
    PackageMap,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import MultibodyPlant

from coop_drake.plant.read_together import read_together
from coop_drake.scenario import Assembly

_REPLACED = re.compile(r"invalid inertia|inertia matrix|central inertia|Using default value")
"""Warnings by which Drake says that it went on with a mass or a size other than the file's."""


def process(
    assembly: Assembly, indices: Sequence[int], plant: MultibodyPlant, scene_graph: SceneGraph | None
) -> str:
    """Process directives; what Drake complained about, or nothing.

    Warnings that are no complaints are passed on to Drake's logger.
    """
    directives = [assembly.directives[index] for index in indices]
    complaint, done = _process(assembly, directives, plant, scene_graph, together=True)
    if complaint and done:
        # Drake's words about the files themselves, not about the document that they were read in.
        scratch, geometry = MultibodyPlant(0.0), SceneGraph() if scene_graph else None
        if geometry:
            scratch.RegisterAsSourceForSceneGraph(geometry)
        complaint = _process(assembly, directives, scratch, geometry, together=False)[0] or complaint
    return complaint


def _process(
    assembly: Assembly,
    directives: Sequence[ModelDirective],
    plant: MultibodyPlant,
    scene_graph: SceneGraph | None,
    *,
    together: bool,
) -> tuple[str, bool]:
    """The complaint, and whether it is about models that were read together."""
    parser = Parser(plant, scene_graph) if scene_graph else Parser(plant)
    parser.package_map().AddMap(_missing(assembly, parser))
    done = together
    try:
        with _warnings() as records:
            done = together and read_together(directives, parser)
            if not done:
                ProcessModelDirectives(ModelDirectives(directives=list(directives)), parser)
    except (RuntimeError, ValueError, SystemExit) as error:  # pydrake exits where Drake's C++ would abort
        return " ".join(str(error).split()), done
    messages = [" ".join(record.getMessage().split()) for record in records]
    replaced = [message for message in messages if _REPLACED.search(message)]
    if not replaced:
        _pass_on(records)
    return "; ".join(dict.fromkeys(replaced)), done


def _missing(assembly: Assembly, parser: Parser) -> PackageMap:
    """The scenario's packages without those that the parser has already."""
    packages = PackageMap(assembly.packages)
    for name in packages.GetPackageNames():
        if parser.package_map().Contains(name):
            packages.Remove(name)
    return packages


@contextmanager
def _warnings() -> Iterator[list[logging.LogRecord]]:
    """Collect what Drake warns about meanwhile, also while its logger keeps silent or is switched off."""
    records: list[logging.LogRecord] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            records.append(record)

    logger = logging.getLogger("drake")
    ours = {"handlers": [Collector()], "filters": [], "propagate": False, "disabled": False}
    theirs = {name: getattr(logger, name) for name in (*ours, "level")}
    switched_off = logging.root.manager.disable
    vars(logger).update(ours)
    logging.disable(logging.NOTSET)
    logger.setLevel(logging.WARNING)
    try:
        yield records
    finally:
        vars(logger).update(theirs)
        logging.disable(switched_off)  # This lets Drake know of the level put back, too.


def _pass_on(records: Sequence[logging.LogRecord]) -> None:
    logger = logging.getLogger("drake")
    for record in records:
        if logger.isEnabledFor(record.levelno):
            logger.handle(record)
