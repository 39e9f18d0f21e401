"""The cantilever of beam.py in PySPH, run by PySPH's own Python: `pysph_beam.py ASKED.json FOUND.json`.

The scheme is PySPH's `ElasticSolidsScheme` with its own coefficients; in 3D its velocity gradient, which has two components,
is replaced by PySPH's of three. Layers with held = 1 do not move, while their stress goes on.
"""

import json
import sys
import time

import numpy as np
from pysph.base.kernels import CubicSpline
from pysph.solver.application import Application
from pysph.sph.basic_equations import VelocityGradient2D, VelocityGradient3D
from pysph.sph.equation import Equation
from pysph.sph.solid_mech.basic import ElasticSolidsScheme, get_particle_array_elastic_dynamics

ASKED, FOUND = sys.argv[1:3]
with open(ASKED) as file:
    BEAM = json.load(file)


class Hold(Equation):
    """No acceleration, and no XSPH drift, of what is held."""

    def post_loop(self, d_idx, d_held, d_au, d_av, d_aw, d_ax, d_ay, d_az):
        if d_held[d_idx] > 0.5:
            d_au[d_idx] = 0.0
            d_av[d_idx] = 0.0
            d_aw[d_idx] = 0.0
            d_ax[d_idx] = 0.0
            d_ay[d_idx] = 0.0
            d_az[d_idx] = 0.0


class Scheme(ElasticSolidsScheme):
    """The scheme in two or three dimensions, with layers that are held."""

    def get_equations(self):
        groups = super().get_equations()
        groups[-1].equations.append(Hold(dest="beam", sources=None))
        for group in groups if self.dim == 3 else ():
            group.equations = [
                VelocityGradient3D(dest=e.dest, sources=e.sources) if isinstance(e, VelocityGradient2D) else e
                for e in group.equations
            ]
        return groups


class Beam(Application):
    """The beam, its clock and the path of its tip."""

    def initialize(self):
        self.times, self.path, self.started, self.seconds = [], [], 0.0, 0.0

    def create_scheme(self):
        return Scheme(["beam"], [], dim=BEAM["dim"])

    def configure_scheme(self):
        dt = BEAM["dt"]
        self.scheme.configure_solver(dt=dt, tf=1e9, pfreq=10**9)

    def create_particles(self):
        dim, rows, edge = BEAM["dim"], BEAM["rows"], BEAM["spacing"]
        across = (np.arange(rows) - 0.5 * (rows - 1)) * edge
        grids = np.meshgrid(BEAM["along"], *[across] * (dim - 1), indexing="ij")
        place = dict(zip("xyz", (g.ravel() for g in grids), strict=False))
        h = 0.5 * BEAM["support"] * edge
        constants = {
            "wdeltap": CubicSpline(dim=dim).kernel(rij=edge, h=h),
            "n": 4,
            "rho_ref": BEAM["density"],
            "E": BEAM["youngs_modulus"],
            "nu": BEAM["poisson_ratio"],
        }
        beam = get_particle_array_elastic_dynamics(
            name="beam", m=BEAM["density"] * edge**dim, h=h, rho=BEAM["density"], constants=constants, **place
        )
        beam.v[:] = np.interp(beam.x, BEAM["along"], BEAM["velocity"])
        beam.add_property("held", data=(beam.x < 0.0).astype(float))
        middle = edge if rows % 2 == 0 else 0.5 * edge
        self.end = np.flatnonzero((beam.x > BEAM["along"][-1] - 0.5 * edge) & (np.abs(beam.y) < middle))
        return [beam]

    def pre_step(self, solver):
        if solver.count == BEAM["warm"]:
            self.started = time.process_time()

    def post_step(self, solver):
        beam = self.particles[0]
        self.times.append(solver.t)
        self.path.append(float(beam.y[self.end].mean()))
        self.seconds = time.process_time() - self.started


beam = Beam(fname="beam", output_dir="out")
steps = BEAM["warm"] + BEAM["steps"]
beam.run(["--max-steps", str(steps), "--disable-output", "-q", "--no-openmp"])
with open(FOUND, "w") as file:
    found = {
        "cpu_seconds": beam.seconds,
        "particles": beam.particles[0].get_number_of_particles(),
        "times": beam.times,
        "tip": beam.path,
    }
    json.dump(found, file)
