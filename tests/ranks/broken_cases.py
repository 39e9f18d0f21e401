"""Bodies that break while they touch others, which processes share: by phase fields and by links, along a line that all cuts
cross.

    mpiexec -n 4 python -m tests.ranks.broken_cases CASE...

As `tests.ranks.shared_cases`, which says what is printed. A run is long enough for surfaces to be made anew many times, in
2D in both of its halves.
"""

import wsph
from tests.ranks.case_runs import begin
from tests.ranks.shared_cases import CRACKING, meeting

BY = {
    "field": {"phase_field": CRACKING},
    "links": {"links": {"criterion": "stretch", "threshold": 0.02}},
}
FORMS = {"field": ("stress-points", "elastic"), "links": ("total-lagrangian", "jaumann")}


def torn(by: str, dim: int = 2, *, between: str = "surface", dt: float = 0.2, **run: object) -> wsph.Scene:
    """A body that tears along its length while another one comes down on it, as those of `meeting`, which break too where
    they meet; of links its banks meet each other."""
    (form, law), middle = FORMS[by], 25.5 if dim == 2 else 7.5
    speed = ["0.0", f"{0.04 * dim}*tanh(y - {middle})*(1 + 0.3*sin(x))", "0.0"][:dim]
    made = meeting(
        dim,
        between=between,
        form=form,
        law=law,
        body={**BY[by], "velocity": speed},
        run={"end": (36 if dim == 2 else 18) * dt, "dt": dt, **run},
    )
    if by == "field":
        return made
    itself = {"name": "itself", "self": "b", "friction": 0.2}
    return made.with_(contact=[*made.data()["contact"], itself])


CASES = {
    "field tied": lambda: torn("field", between="tie", precision="f32"),
    "field in 3D": lambda: torn("field", 3, dt=0.15),
    "links": lambda: torn("links"),
    "links tied": lambda: torn("links", between="tie", dt=0.16, precision="f32", integrator="rk4"),
}

if __name__ == "__main__":
    begin(CASES)
