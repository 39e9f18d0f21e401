"""Movies of figures: GIF by pillow, MP4 by imageio with ffmpeg (the extra "video")."""

# pyright: strict
# pyright: reportMissingTypeStubs=false, reportMissingImports=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false

import importlib
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wsph.errors import OutputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOVIES = (".gif", ".mp4")

PAUSE = 0.1
"""Between two pictures [s]."""

LAST = 1.0
"""How long a GIF stays with its last picture [s]."""


Pages = Iterable[np.ndarray]


def writer(path: Path) -> "Callable[[Iterable[Figure]], None]":
    """A function that saves figures of one size as a movie. It raises OutputError, and so does this where what writes it is
    not installed."""
    save = _gif(path) if path.suffix == ".gif" else _mp4(path)

    def movie(figures: "Iterable[Figure]") -> None:
        try:
            save(map(_pixels, figures))
        except OSError as error:
            raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error

    return movie


def _pixels(made: "Figure") -> np.ndarray:
    """A figure as (height, width, 3) uint8, both even, as MP4 has them."""
    canvas: Any = made.canvas
    canvas.draw()
    whole = np.asarray(canvas.buffer_rgba())[..., :3]
    return whole[: whole.shape[0] // 2 * 2, : whole.shape[1] // 2 * 2].copy()


def _gif(path: Path) -> Callable[[Pages], None]:
    try:
        from PIL import Image
    except ImportError:
        raise OutputError('a .gif needs pillow: pip install "wsph[view]"') from None

    def save(pages: Pages) -> None:
        # One palette for all, that of the last, which has most colours: they do not flicker.
        whole = [Image.fromarray(page) for page in pages]
        last = whole[-1].quantize(128, dither=Image.Dither.NONE)
        found = [page.quantize(128, dither=Image.Dither.NONE, palette=last) for page in whole]
        waits = [round(1000 * PAUSE)] * (len(found) - 1) + [round(1000 * LAST)]
        found[0].save(path, save_all=True, append_images=found[1:], duration=waits, loop=0, optimize=True)

    return save


def _mp4(path: Path) -> Callable[[Pages], None]:
    try:
        importlib.import_module("imageio_ffmpeg")
        imageio: Any = importlib.import_module("imageio.v2")
    except ImportError:
        raise OutputError('an .mp4 needs imageio with ffmpeg: pip install "wsph[video]", or save a .gif') from None

    def save(pages: Pages) -> None:
        with tempfile.TemporaryDirectory() as folder:
            whole = Path(folder) / "movie.mp4"
            with imageio.get_writer(whole, fps=round(1.0 / PAUSE), macro_block_size=2) as made:
                for page in pages:
                    made.append_data(page)
            path.write_bytes(whole.read_bytes())

    return save
