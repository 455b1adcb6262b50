"""Fills Jinja templates; every package has its own in its folder ``templates``."""

from __future__ import annotations

from typing import Any


def rendered(package: str, name: str, **content: Any) -> str:
    """Fill a Jinja template; values in HTML are escaped unless the template says otherwise.

    Args:
        package: The package that holds it, such as ``coop_drake.viz``.
        name: Its name without the suffix ``.j2``.
        content: Values for the names in the template; a name without a value is an error.
    """
    # Imported here because most uses of a package fill no template.
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

    environment = Environment(
        loader=PackageLoader(package),
        autoescape=select_autoescape(("html.j2",)),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(f"{name}.j2").render(content)
