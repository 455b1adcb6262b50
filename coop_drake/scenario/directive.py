"""A model directive as it stands in a file; Drake's type is made of it when it is asked for."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

from coop_drake.typed_data import Codec

if TYPE_CHECKING:
    from pydrake.multibody.parsing import ModelDirective


@dataclass(frozen=True)
class DirectiveEntry:
    """One entry of a list of model directives. To hold it does not import Drake, to read it does.

    Attributes:
        data: Plain data of the YAML file.
        key: Where it stands in the file.
    """

    data: object
    key: str

    @cached_property
    def drake(self) -> ModelDirective:
        """The directive as Drake's type.

        Raises:
            DataError: The first departure of the data from that type.
        """
        from coop_drake.scenario.drake_types import read_directive

        return read_directive(self.data, self.key)

    @cached_property
    def plain(self) -> object:
        """Plain data of Drake's type with all its defaults, which the many runs of one scenario share."""
        from coop_drake.scenario.drake_types import write_directive

        return write_directive(self.drake)

    def __reduce__(self) -> tuple[type[DirectiveEntry], tuple[object, str]]:
        """Pickle without Drake's type, which cannot be."""
        return type(self), (self.data, self.key)


def _write(entry: DirectiveEntry) -> object:
    return deepcopy(entry.plain)


Directive = Annotated[DirectiveEntry, Codec(DirectiveEntry, _write)]
