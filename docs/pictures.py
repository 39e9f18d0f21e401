"""Pictures of the examples, each made by one command: python docs/pictures.py [NAME ...] [--list]

`--list` prints the commands, without a name of all. Pictures of one run share it.
"""

import argparse
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
TARGET = "docs/pictures"

LARGEST = 150_000
"""Size of a picture from which on it gets a palette [bytes]."""

POINTS = "--set run.formulation=stress-points"
"""Bodies of cells, where the example is one of particles."""

RUNS = {
    "shock_bar": "shock_bar.toml --set run.end='6.5 ms'",
    "shock_bar_ul": "shock_bar_ul.toml --set run.end='6.5 ms'",
    "vibrating_bar": "vibrating_bar.toml",
    "magnesium_bar": "magnesium_bar.toml",
    "shear_band": "shear_band.toml",
    "crack_dsif": "crack_dsif.toml --set run.end='0.8 ms' --set bodies.0.spacing=0.05",
    "cantilever": "cantilever.toml",
    "plate_with_void": "plate_with_void.toml",
    "oscillating_beam": "oscillating_beam.toml",
    "twisting_column": "twisting_column.toml --set bodies.0.spacing=0.1",
    "kalthoff_winkler": f"kalthoff_winkler.toml {POINTS} --set output.every='3 us'",
    "kalthoff_links": "kalthoff_links.toml",
    "mode_one_strip": f"mode_one_strip.toml {POINTS}",
    "deep_beam": "deep_beam.toml",
    "taylor_bar": "taylor_bar.toml",
    "two_rods": "two_rods.toml",
    "rigid_plastic_beam": "rigid_plastic_beam.toml --set run.end='0.9 ms'",
    "notched_beam": "notched_beam.toml --set run.end='0.5 ms'",
    "ring": "ring.toml",
    "bracket": "bracket.toml",
    "plastic_hinge": "plastic_hinge.toml",
    "ball_on_plate": "ball_on_plate.toml",
    "indentation": "indentation.toml",
    "stack": "stack.toml",
}
"""What `wsph run` is given, by the name of the run."""

PICTURES = {
    "shock_bar": "--field stress_xx",
    "shock_bar_ul": "--field stress_xx",
    "vibrating_bar": "--field stress_xx",
    "magnesium_bar": "--field stress_xx",
    "shear_band": "--field plastic_strain --range 0:0.02",
    "crack_dsif": "--field stress_yy",
    "cantilever": "--field displacement_y",
    "plate_with_void": "--field stress_yy --smooth",
    "oscillating_beam": "--field stress_xx --smooth",
    "twisting_column": "--field von_mises --time '90 ms'",
    "kalthoff_winkler": "--field damage --warp 3",
    "kalthoff_links": "--field damage",
    "mode_one_strip": "--field stress_yy --warp 20 --broken 0.9 --time '175 us'",
    "deep_beam": "--field damage",
    "taylor_bar": "--field plastic_strain --clip 'y>0'",
    "two_rods": "--field velocity_x --time '20 us'",
    "rigid_plastic_beam": "--field plastic_strain",
    "notched_beam": "--field plastic_strain",
    "ring": "--field von_mises",
    "bracket": "--field von_mises --range '0:300 MPa' --warp 50",
    "plastic_hinge": "--curve=-push.force_y --against=-end.displacement_y",
    "ball_on_plate": "--field von_mises --time '20 us'",
    "indentation": "--field plastic_strain --clip 'y>0'",
    "stack": "--field velocity_x --time '64 ms'",
}
"""The options of the picture of every run."""

OPTIONS = {
    "view_body": ("rigid_plastic_beam", "--field displacement_y --body beam"),
    "view_time": ("rigid_plastic_beam", "--field velocity_y --time '0.2 ms'"),
    "view_warp": ("plate_with_void", "--field stress_xx --warp 500"),
    "view_camera": ("bracket", "--field von_mises --camera xz"),
    "view_slice": ("bracket", "--field von_mises --slice 'y=15 mm'"),
    "view_clip": ("bracket", "--field von_mises --clip 'y>15 mm'"),
    "view_range": ("bracket", "--field pressure --range='-100:100 MPa'"),
    "view_smooth": ("plate_with_void", "--field stress_xx --smooth"),
    "view_mesh": ("ring", "--field stress_xx --mesh"),
    "view_broken": ("kalthoff_winkler", "--field von_mises --warp 3 --broken 0.9"),
    "view_colours": ("shear_band", "--field plastic_strain --range 0:0.02 --colours cividis"),
}
"""Run and options of a picture of every option of `wsph view`."""

MOVIES = {
    "twisting_column": ("twisting_column", "--field von_mises --time '0:120 ms'"),
    "kalthoff_winkler": ("kalthoff_winkler", "--field damage --warp 3 --broken 0.95"),
}
"""Run and options of the movies."""


def commands(names: list[str]) -> list[tuple[str, str, str]]:
    """Of pictures by their names without a suffix, of all without names: the run's folder, the command that runs it, and
    that which draws the picture."""
    wanted = {f"{name}.png": (name, options) for name, options in PICTURES.items()}
    wanted |= {f"{name}.png": rest for name, rest in OPTIONS.items()}
    wanted |= {f"{name}.gif": rest for name, rest in MOVIES.items()}
    found = []
    for file, (run, options) in wanted.items():
        if not names or Path(file).stem in names:
            out = f"{run}-out"
            made = f"wsph run examples/{RUNS[run]} -o {out} --quiet --overwrite"
            found.append((out, made, f"wsph view {out} {options} --save {TARGET}/{file}"))
    return found


def _run(command: str, folder: str) -> str:
    """Run a command of wsph, with folders of runs in `folder`; returns the file that it saves."""
    words = [f"{folder}/{word}" if word.endswith("-out") else word for word in shlex.split(command)]
    subprocess.run([sys.executable, "-m", "wsph", *words[1:]], check=True, cwd=ROOT)
    return words[-1]


def _small(path: Path) -> None:
    from PIL import Image

    with Image.open(path) as page:
        whole = page.convert("RGB")
    whole.save(path, optimize=True)
    if path.stat().st_size > LARGEST:
        whole.quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


def main() -> None:
    """Make the pictures, or print how."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of pictures, without .png")
    parser.add_argument("--list", action="store_true", help="print the commands, and make nothing")
    parser.add_argument("--runs", type=Path, help="keep the folders of the runs here, and use those that are there")
    options = parser.parse_args()
    if unknown := [name for name in options.names if name not in {**PICTURES, **OPTIONS, **MOVIES}]:
        parser.error(f"no picture {unknown[0]!r}; there is {', '.join([*PICTURES, *OPTIONS])}")
    (ROOT / TARGET).mkdir(exist_ok=True)
    done: set[str] = set()
    with tempfile.TemporaryDirectory() as folder:
        place = str(options.runs.resolve()) if options.runs else folder
        for out, run, view in commands(options.names):
            print(f"{run} && {view}", flush=True)
            if options.list:
                continue
            if out not in done and not (Path(place) / out / "summary.json").is_file():
                _run(run, place)
            done.add(out)
            saved = ROOT / _run(view, place)
            if saved.suffix == ".png":
                _small(saved)


if __name__ == "__main__":
    main()
