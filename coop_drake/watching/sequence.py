"""The figure sequence: one picture per moment, a sheet of a few of them, and a moving picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import IO

import numpy as np
from PIL import Image

from coop_drake.drawing.canvas import save_figure
from coop_drake.files import write_atomically
from coop_drake.watching.film import Film
from coop_drake.watching.frames import frame_figure
from coop_drake.watching.storyboard import Shot

__all__ = ["telling", "write_sequence"]

Progress = Callable[[str, float], None]

_ON_SHEET = 6
_SHEET_COLUMNS = 2
_MOVING_WIDTH = 960  # Pixels; the pictures themselves are wider.
_COLOURS = 64  # Colours of the moving picture.
_BEAT = 240  # How long a moment is shown [ms].
_HOLD = 4000  # How long the verdict is shown [ms].


def write_sequence(
    film: Film, shots: Sequence[Shot], directory: Path, progress: Progress | None = None
) -> list[Path]:
    """Write ``think_0001.png`` and so on, a sheet ``think.png``, and a moving picture ``think.gif``.

    Args:
        film: The film.
        shots: Its moments.
        directory: Where to write; missing directories are made.
        progress: Called with a text and the fraction done.

    Returns:
        The files written, pictures first, then sheet and moving picture.
    """
    stories = {shot.moment.question: shot.moment.open_links for shot in shots}
    pictures = []
    for number, shot in enumerate(shots, start=1):
        if progress is not None:
            progress(f"picture {number}", (number - 1) / len(shots))
        path = directory / f"think_{number:04d}.png"
        save_figure(frame_figure(film, shot, stories[shot.moment.question]), path, dpi=100)
        pictures.append(path)
    sheet = _write_sheet([pictures[index] for index in telling(shots)], directory / "think.png")
    return [*pictures, sheet, _write_moving(pictures, directory / "think.gif")]


def telling(shots: Sequence[Shot]) -> list[int]:
    """Indices of a handful of moments: the first, the last, and others evenly by the slices made."""
    made = np.array([shot.moment.slices for shot in shots])
    questions = [shot.moment.question for shot in shots]
    begun = np.cumsum([0, *[first != second for first, second in pairwise(questions)]])
    work = made + begun * made.max()
    goals = np.linspace(work[0], work[-1], min(_ON_SHEET, len(shots)))[1:-1]
    between = [int(np.abs(work - goal).argmin()) for goal in goals]
    return sorted({0, *between, len(shots) - 1})


def _write_sheet(pictures: Sequence[Path], path: Path) -> Path:
    images = [_opened(picture) for picture in pictures]
    width, height = images[0].size
    columns = min(_SHEET_COLUMNS, len(images))
    rows = -(-len(images) // columns)
    sheet = Image.new("RGB", (columns * width, rows * height), "white")
    for number, image in enumerate(images):
        sheet.paste(image, (number % columns * width, number // columns * height))
    return write_atomically(path, lambda file: sheet.save(file, "PNG", optimize=True))


def _write_moving(pictures: Sequence[Path], path: Path) -> Path:
    frames = []
    for picture in pictures:
        image = _opened(picture)
        size = (_MOVING_WIDTH, round(image.height * _MOVING_WIDTH / image.width))
        small = image.resize(size, Image.Resampling.LANCZOS)
        frames.append(small.quantize(_COLOURS, dither=Image.Dither.NONE))
    durations = [_BEAT] * (len(frames) - 1) + [_HOLD]

    def save(file: IO[bytes]) -> None:
        frames[0].save(file, "GIF", save_all=True, append_images=frames[1:], duration=durations, loop=0)

    return write_atomically(path, save)


def _opened(path: Path) -> Image.Image:
    with Image.open(path) as image:
        return image.convert("RGB")
