"""Small floor plans written by code, in every format that can be read."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import numpy as np
import yaml
from PIL import Image

INKSCAPE = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
XLINK = 'xmlns:xlink="http://www.w3.org/1999/xlink"'
DXF = (
    b"0 SECTION 2 HEADER 9 $ACADVER 1 AC1009 9 $INSUNITS 70 4 0 ENDSEC 0 SECTION 2 ENTITIES "
    b"0 LINE 8 walls 10 0 20 0 11 9000 21 0 0 LINE 8 walls 10 9000 20 0 11 9000 21 6000 "
    b"0 LINE 8 walls 10 9000 20 6000 11 0 21 6000 0 LINE 8 walls 10 0 20 6000 11 0 21 0 "
    b"0 CIRCLE 8 walls 10 3000 20 3000 40 500 "
    b"0 ARC 8 walls 10 6000 20 0 40 700 50 0 51 180 0 ENDSEC 0 EOF "
).replace(b" ", b"\n")
"""A hall in millimetres, with a column and an alcove: lines of codes and of values."""
HALL = '<path d="M 0,0 H 10 V 6 H 0 Z"/>'


def write_svg(folder: Path, body: str, head: str = 'width="10cm" height="6cm" viewBox="0 0 10 6"') -> Path:
    """An SVG drawing; by default one user unit is a centimetre."""
    path = folder / "hall.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {INKSCAPE} {XLINK} {head}>{body}</svg>')
    return path


def write_dxf(folder: Path, draw, unit: int = 4) -> Path:
    """A DXF drawing in millimetres; ``draw`` gets the document and its model space."""
    document = ezdxf.new()
    document.header["$INSUNITS"] = unit
    draw(document, document.modelspace())
    path = folder / "hall.dxf"
    document.saveas(path)
    return path


def write_map(folder: Path, shades: np.ndarray, *, ending: str = "pgm", **keys: object) -> Path:
    """An occupancy map of cells of 10 cm; row 0 of ``shades`` is the top of the picture."""
    Image.fromarray(shades.astype(np.uint8)).save(folder / f"map.{ending}")
    content = {
        "image": f"map.{ending}",
        "resolution": 0.1,
        "origin": [0.0, 0.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
        **keys,
    }
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump({key: value for key, value in content.items() if value is not ...}))
    return path


def room_shades(rows: int = 30, columns: int = 40) -> np.ndarray:
    """A free room (254) with an occupied rim of one cell (0)."""
    shades = np.full((rows, columns), 254)
    shades[[0, -1], :] = shades[:, [0, -1]] = 0
    return shades
