"""What to install for work that needs packages which coop_drake itself does not install."""

from __future__ import annotations

_EXTRAS = {
    "cma": "tune",
    "collada": "robots",
    "cssselect2": "floor-plans",
    "defusedxml": "robots",
    "distributed": "campaign",
    "ezdxf": "floor-plans",
    "msgspec": "apart",
    "pyarrow": "campaign",
    "svgelements": "floor-plans",
    "tinycss2": "floor-plans",
    "trimesh": "robots",
    "zmq": "apart",
}
"""The extra of coop-drake that installs a package which only some commands import."""


def install_advice(package: str) -> str | None:
    """The command that installs a missing package, with all others of its extra; None for one without extra.

    The packages are named one by one, which helps in a clone and after the installation of a wheel alike.

    Args:
        package: Name under which it is imported.
    """
    extra = _EXTRAS.get(package)
    if extra is None:
        return None
    from importlib.metadata import PackageNotFoundError, requires  # Here: it takes as long as reading a file.

    try:
        lines = requires("coop-drake") or []
    except PackageNotFoundError:
        lines = []
    needed = [
        line.partition(";")[0].strip() for line in lines if f"extra == '{extra}'" in line.replace('"', "'")
    ]
    return "pip install " + " ".join(f"'{name}'" for name in needed or [package])
