"""Runs Drake's reader of models, and collects its errors and the warnings that are errors to us."""

import logging
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import ModelDirectives, PackageMap, Parser, ProcessModelDirectives
from pydrake.multibody.plant import MultibodyPlant

from coop_drake.scenario import Assembly

_REPLACED = re.compile(r"invalid inertia|inertia matrix|central inertia|Using default value")
"""Warnings by which Drake says that it went on with a mass or a size other than the file's."""


def process(
    assembly: Assembly, indices: Sequence[int], plant: MultibodyPlant, scene_graph: SceneGraph | None
) -> str:
    """Process some of the directives; return what Drake reported as an error, or an empty text.

    Warnings by which Drake says that it replaced a mass or a size count as errors; all others are passed on
    to Drake's logger. The scene graph receives the geometry, if any is wanted.
    """
    directives = ModelDirectives(directives=[assembly.directives[index] for index in indices])
    parser = Parser(plant, scene_graph) if scene_graph else Parser(plant)
    parser.package_map().AddMap(_missing(assembly, parser))
    try:
        with _warnings() as records:
            ProcessModelDirectives(directives, parser)
    except (RuntimeError, ValueError, SystemExit) as error:  # pydrake exits where Drake's C++ would abort
        return " ".join(str(error).split())
    messages = [" ".join(record.getMessage().split()) for record in records]
    replaced = [message for message in messages if _REPLACED.search(message)]
    if not replaced:
        _pass_on(records)
    return "; ".join(dict.fromkeys(replaced))


def _missing(assembly: Assembly, parser: Parser) -> PackageMap:
    """The scenario's packages without those that the parser knows already."""
    packages = PackageMap(assembly.packages)
    for name in packages.GetPackageNames():
        if parser.package_map().Contains(name):
            packages.Remove(name)
    return packages


@contextmanager
def _warnings() -> Iterator[list[logging.LogRecord]]:
    """Collect Drake's warnings in a block, whether or not its logger is silenced or switched off."""
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
        logging.disable(switched_off)  # This also makes Drake notice the level that was put back.


def _pass_on(records: Sequence[logging.LogRecord]) -> None:
    logger = logging.getLogger("drake")
    for record in records:
        if logger.isEnabledFor(record.levelno):
            logger.handle(record)
