"""The tables of docs/howto/choose.md, from docs/fronts.json: what is cheapest for what one wants to know.

`python docs/make.py --only choose single` fills them; a study whose rows are not there has no row.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from fronts import ASKED, error, nearest, ranked, two, variants

DOCS = Path(__file__).parent

WANTED = {
    "shock_bar": "a shock in 1D",
    "viscoplastic_bar": "a shock in 1D, in a law that flows",
    "vibrating_bar": "a smooth vibration in 1D",
    "beam": "bending, a frequency",
    "plate_with_void": "stress beside a hole, on a mapped lattice",
    "crack": "a wave with a step that a crack scatters",
    "ring": "a curved surface under pressure",
    "pulse_3d": "a smooth wave in 3D",
    "two_rods": "an impact of two bodies",
    "taylor_bar": "large plastic strain in 3D",
}
"""What each study stands for."""


def choose() -> list[str]:
    """Rows: what one wants to know, the cheapest scheme for each error asked, and by how much the second is dearer."""
    studies: dict[str, Any] = json.loads((DOCS / "fronts.json").read_text())["studies"]
    heads = [f"for {100 * asked:g} % the cheapest is, before" for asked in ASKED]
    rows = [f"| you want to know | {' | '.join(heads)} |", "| --- | --- | --- |"]
    for name, wanted in WANTED.items():
        if name in studies:
            told = [_cheapest(studies[name]["rows"], asked) for asked in ASKED]
            rows.append(f"| {wanted} | {' | '.join(told)} |")
    return rows


def single() -> list[str]:
    """Rows: what single precision changes of the errors of every study, and of the bytes of a particle."""
    studies: dict[str, Any] = json.loads((DOCS / "fronts.json").read_text())["studies"]
    rows = [
        "| case | finest error in double | changed in single by | bytes, single over double |",
        "| --- | --- | --- | --- |",
    ]
    for name, wanted in WANTED.items():
        own = variants(studies[name]["rows"]) if name in studies else {}
        for name_of in (each for each in own if each.endswith(", f32") and each.removesuffix(", f32") in own):
            both = list(zip(own[name_of], own[name_of.removesuffix(", f32")], strict=True))
            right = [(a, b) for a, b in both if np.isfinite(error(a)) and np.isfinite(error(b))]
            if right:
                changed = max(abs(error(a) / error(b) - 1.0) for a, b in right)
                bytes_ = right[-1][0]["bytes"] / right[-1][1]["bytes"]
                least = min(error(b) for _, b in right)
                rows.append(f"| {wanted} | {100 * least:.2g} % | {100 * changed:.2g} % of itself | {bytes_:.2f} |")
    return rows


def _cheapest(rows: list[Any], asked: float) -> str:
    """The cheapest scheme in double precision, and the next with what it costs over that."""
    (least, _, best), *rest = ranked(rows, asked)
    if not np.isfinite(least):
        near = nearest(rows)
        return f"none; `{near['variant']}` came to {100 * error(near):.2g} %"
    if not rest or not np.isfinite(rest[0][0]):
        return f"`{best}`; no other came as near"
    return f"`{best}`, `{rest[0][2]}` ({two(rest[0][0] / least)} times)"
