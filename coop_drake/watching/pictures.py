"""Pictures of a recorded search: one per keyframe, a sheet of a few of them, and a moving picture."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import IO

import numpy as np
from PIL import Image

from coop_drake.drawing.canvas import save_figure
from coop_drake.drawing.colours import PAPER
from coop_drake.files import write_atomically
from coop_drake.progress import Progress
from coop_drake.watching.keyframe_figure import keyframe_figure
from coop_drake.watching.keyframes import Keyframe
from coop_drake.watching.recording import SearchRecording

_ON_SHEET, _SHEET_COLUMNS = 6, 2
"""Number of pictures on the sheet, and of its columns."""

_MOVING_WIDTH = 960
"""Width of the moving picture [pixels]: three quarters of the pictures', which keeps the file small."""

_COLOURS = 64
"""Number of colours of the moving picture."""

_SHOWN, _LAST_SHOWN = 240, 4000
"""How long the moving picture shows a keyframe, and the last one with the verdict [ms]."""


def write_pictures(
    recording: SearchRecording, frames: Sequence[Keyframe], directory: Path, progress: Progress | None = None
) -> list[Path]:
    """Write ``think_0001.png`` and so on, a sheet ``think.png``, and a moving picture ``think.gif``.

    Returns:
        The files written, pictures first, then sheet and moving picture.
    """
    histories = {frame.state.question: frame.state.history for frame in frames}
    pictures = []
    for number, frame in enumerate(frames, start=1):
        if progress is not None:
            progress(f"picture {number}", (number - 1) / len(frames))
        path = directory / f"think_{number:04d}.png"
        save_figure(keyframe_figure(recording, frame, histories[frame.state.question]), path, dpi=100)
        pictures.append(path)
    sheet = _write_sheet([pictures[index] for index in on_sheet(frames)], directory / "think.png")
    return [*pictures, sheet, _write_moving(pictures, directory / "think.gif")]


def on_sheet(frames: Sequence[Keyframe]) -> list[int]:
    """Return the indices of a few keyframes: the first, the last, and others evenly by the slices made."""
    made = np.array([frame.state.slices for frame in frames])
    questions = [frame.state.question for frame in frames]
    begun = np.cumsum([0, *[first != second for first, second in pairwise(questions)]])
    work = made + begun * made.max()
    wanted = np.linspace(work[0], work[-1], min(_ON_SHEET, len(frames)))[1:-1]
    between = [int(np.abs(work - one).argmin()) for one in wanted]
    return sorted({0, *between, len(frames) - 1})


def _write_sheet(pictures: Sequence[Path], path: Path) -> Path:
    images = [_opened(picture) for picture in pictures]
    width, height = images[0].size
    columns = min(_SHEET_COLUMNS, len(images))
    rows = -(-len(images) // columns)
    sheet = Image.new("RGB", (columns * width, rows * height), PAPER)
    for number, image in enumerate(images):
        sheet.paste(image, (number % columns * width, number // columns * height))
    return write_atomically(path, lambda file: sheet.save(file, "PNG", optimize=True))


def _write_moving(pictures: Sequence[Path], path: Path) -> Path:
    images = []
    for picture in pictures:
        image = _opened(picture)
        size = (_MOVING_WIDTH, round(image.height * _MOVING_WIDTH / image.width))
        small = image.resize(size, Image.Resampling.LANCZOS)
        images.append(small.quantize(_COLOURS, dither=Image.Dither.NONE))
    durations = [_SHOWN] * (len(images) - 1) + [_LAST_SHOWN]

    def save(file: IO[bytes]) -> None:
        images[0].save(file, "GIF", save_all=True, append_images=images[1:], duration=durations, loop=0)

    return write_atomically(path, save)


def _opened(path: Path) -> Image.Image:
    with Image.open(path) as image:
        return image.convert("RGB")
