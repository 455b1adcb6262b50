"""Fills templates: every room keeps its own in its folder ``templates``."""

from __future__ import annotations

from typing import Any

__all__ = ["rendered"]


def rendered(room: str, name: str, **content: Any) -> str:
    """Fill a Jinja template; what goes into HTML is escaped unless the template says otherwise.

    Args:
        room: The package that it belongs to, such as ``coop_drake.viz``.
        name: Its name without the suffix ``.j2``.
        content: What the template may name; a name that it lacks is an error.
    """
    # Here and not above: most who import a room that has templates never fill one.
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

    environment = Environment(
        loader=PackageLoader(room),
        autoescape=select_autoescape(("html.j2",)),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(f"{name}.j2").render(content)
