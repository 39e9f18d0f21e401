"""`wsph view`: show or save a picture of a run."""

# pyright: strict

import argparse
from pathlib import Path

from wsph.cli.command import Command


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument(
        "--field", default="", help="field to draw, e.g. stress_xx (default: velocity, or the first that there is)"
    )
    parser.add_argument(
        "--save", type=Path, metavar="FILE", help="a .png, .pdf or .svg of the last frame, a .gif or .mp4 of all"
    )
    parser.add_argument(
        "--curve",
        metavar="COLUMNS",
        help="draw columns of history.csv or of probes (PROBE.COLUMN) instead: --curve=a,b",
    )
    parser.add_argument("--against", metavar="COLUMN", help="what curves are drawn over (default: time)")
    parser.add_argument("--body", metavar="NAME", help="draw this body alone")
    parser.add_argument("--time", metavar="T|FROM:TO", help='the frame nearest to a time ("2 ms"), or those in a range')
    parser.add_argument(
        "--warp", type=float, metavar="FACTOR", help="draw displacements times a factor (0: the body as it was)"
    )
    parser.add_argument(
        "--camera", choices=["xy", "xz", "yz", "iso"], help="from where to look (default: flat bodies xy)"
    )
    parser.add_argument("--slice", metavar="AXIS[=AT]", help="a slice across an axis, in the middle or at a coordinate")
    parser.add_argument("--clip", metavar="AXIS[<AT]", help="keep the half behind the middle, or what is <AT or >AT")
    parser.add_argument("--range", metavar="LOW:HIGH", help='values from which to which colours go, e.g. "0:80 MPa"')
    parser.add_argument(
        "--smooth", action="store_true", help="values recovered at nodes, not those of the cells as computed"
    )
    parser.add_argument("--mesh", action="store_true", help="draw the edges of the cells")
    parser.add_argument(
        "--broken", type=float, metavar="DAMAGE", help="leave out what is damaged beyond this, e.g. 0.9"
    )
    parser.add_argument("--colours", default="viridis", choices=["viridis", "cividis", "gray"], help="default: viridis")


def _act(options: argparse.Namespace) -> int:
    from wsph.output.view.look import Look, plane, span
    from wsph.output.view.pictures import view
    from wsph.output.view.tables import view_curves

    if options.curve is not None:
        view_curves(options.folder, options.curve, options.against, options.save)
        return 0
    slice, clip = plane(options.slice) if options.slice else None, plane(options.clip, "<>") if options.clip else None
    limits = span(options.range) if options.range else None
    shown = options.field, options.body, options.warp, options.camera
    look = Look(*shown, slice, clip, limits, options.smooth, options.mesh, options.colours, options.broken)
    view(options.folder, look, options.save, options.time)
    return 0


VIEW = Command("view", "show or save a picture of a run", _declare, _act)
