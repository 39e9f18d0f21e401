"""`wsph calibrate`: fit parameters of a scene to measured curves."""

# pyright: strict

import argparse
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from wsph.cli.command import Command
from wsph.cli.options import declare_out, declare_set, declare_workers, folder_of, overrides

if TYPE_CHECKING:
    from wsph.study.fitting.parameters import Parameter

OUT = ("scene", "fit")
"""What the output folder is called after, and its ending."""


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path)
    parser.add_argument(
        "data", type=Path, help="measured curves: time [s], then PROBE.COLUMN, ... in the units of probes"
    )
    parser.add_argument(
        "--free",
        action="append",
        default=[],
        metavar="KEY=LOW..HIGH",
        help='what is fitted, e.g. "bodies.0.material.youngs_modulus=100..300 GPa @200", where @ is the start',
    )
    declare_set(parser)
    declare_out(parser, *OUT)
    declare_workers(parser)
    parser.add_argument("--overwrite", action="store_true", help="replace an earlier calibration in the folder")


def _act(options: argparse.Namespace) -> int:
    from wsph.output.claim import Claim
    from wsph.ranks.world import refuse_copies
    from wsph.scene.load import load
    from wsph.study.cluster import MPI, executor_at
    from wsph.study.fitting import report
    from wsph.study.fitting.curves import check_curves, read_curves
    from wsph.study.fitting.fit import fit
    from wsph.study.fitting.mesh import mesh_bar
    from wsph.study.fitting.parameters import check_parameters, read_parameter
    from wsph.study.fitting.runs import Runs

    if options.scheduler != MPI:
        refuse_copies("wsph calibrate")
    scene = load(options.scene, overrides(options.set))
    parameters = [read_parameter(text, scene) for text in options.free]
    check_parameters(parameters, scene)
    curves = read_curves(options.data)
    check_curves(curves, scene, options.data)
    folder = folder_of(options, *OUT)
    warnings.simplefilter("ignore")  # the same ones for each of the runs
    with Claim(folder, options.overwrite, kind=report.CALIBRATION) as claim:
        with (
            executor_at(options.scheduler) as executor,
            Runs(curves.names, curves.times, options.workers, executor) as runs,
        ):
            found = fit(scene, curves, parameters, runs)
            mesh = mesh_bar(scene, curves, found, runs)
        claim.make()
        words = [*report.in_words(found, mesh), *report.following_in_words(found, curves)]
        report.write(folder, found, mesh, curves, words)
    print("\n".join(words))
    given = " ".join(_setting(each, value) for each, value in zip(parameters, found.values, strict=True))
    print(f"{found.runs} runs; calibration.json, fit.csv in {folder}; wsph run {options.scene} {given}")
    return 0


def _setting(parameter: "Parameter", value: float) -> str:
    """What sets a scene to a value."""
    written = f'"{value:.6g} {parameter.unit}"' if parameter.unit else f"{value:.6g}"
    return f"--set {parameter.key}={written}"


CALIBRATE = Command("calibrate", "fit parameters of a scene to measured curves", _declare, _act)
