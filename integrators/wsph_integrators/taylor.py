"""Taylor-SPH in small strain (TSPH), Herreros & Mabssout 2011, doi 10.1016/j.cma.2011.02.006."""

# pyright: strict

from wsph.protocols import TwoSets
from wsph.stability.regions import Limit, two_step_limit


class TaylorSPH:
    """Two steps of a Taylor expansion on two sets of particles (eqs 19 and 22).

    First the virtual particles advance half a step from the real ones, then the real ones a whole step from the virtual
    ones. Order 2 in spacing and time step together, at a given Courant number; of smaller steps on the same lattice order 1,
    as their dissipation. With a support below 1.5 spacings in one dimension it is the Richtmyer scheme, exact at Courant
    number 1. Stable up to C = 2 sqrt(m2), m2 the second moment of the interpolation weights in spacings squared; in two
    and three dimensions up to 0.9 of that, because corners grow above. Dissipative below the limit: a pulse at C = 0.5
    loses 17 % of its energy by its reflection.
    """

    sets = 2
    order = 2
    formulations = ("small-strain",)
    evaluations = 2

    def __init__(self, system: TwoSets):
        self.system = system
        self.state = system.state
        self.half = system.new("virtual")
        self.imposed = system.new("real")

    def limit(self) -> Limit:
        """Largest stable Courant number and where it comes from."""
        return two_step_limit(self.system.second_moment, self.system.space.dim)

    def exact(self) -> float | None:
        """The Courant number at which a step is exact for waves: 1 in one dimension where every virtual particle sees its
        two nearest real ones alone, half a spacing to either side, so that m2 = 1/4."""
        even = self.system.space.dim == 1 and abs(4.0 * self.system.second_moment - 1.0) < 1e-9
        return 1.0 if even else None

    def step(self) -> None:
        """One step, by launches alone."""
        s, y = self.system, self.state
        s.half_step(y, self.half, 0.5)
        s.project(self.half)
        s.impose(self.imposed, (0.0, 1.0))
        s.rate(self.half, y, imposed=self.imposed, weight=1.0)
        s.accept(y)


class UpdatedTaylorSPH(TaylorSPH):
    """Taylor-SPH in the current configuration (UL-TSPH): the same two steps on particles that move.

    Serroukh & Mabssout 2022, doi 10.24132/acm.2022.697, eqs 21-23, with the sign of the spin that eq 2 has and the virtual
    particles as centroids of their cells: a new triangulation in every step makes slivers, costs hundreds of times more and
    grows at every Courant number. The Courant number is that of the current spacing and wave speed: a bar compressed by 5 %
    has to start at C <= 0.97.
    """

    formulations = ("updated-lagrangian",)

    def exact(self) -> float | None:
        """None: the Courant number follows the deformation."""
        return None
