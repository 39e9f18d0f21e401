"""Measured constants of the limits: shares of theoretical limits, and numbers of right-hand sides for finding them.

Each names the test or script that made it, or would tell that it no longer holds. The blocks meant are the 432 of
`blocks()` in tests/stability/test_guard.py: 9 and 16 cells in two dimensions and 5 in three, three supports, four
viscosities, jitter from 0 to 0.4, every form, elastic and by rates. Their limits are found from at most fifty right-hand
sides and compared with those of the whole spectrum (`TestWholeSpectra.test_never_above_for_any_block`).
"""

# pyright: strict

HELD = 0.98
"""Share of the limit of a method that holds waves: tests/stability/test_guard.py, `TestWholeSpectra`, and
`TestRuns.test_predicted_over_measured`, where runs grow within 3 % beyond what it leaves."""

HELD_IRREGULAR = 0.95
"""The same of a damped, irregular body, whose modes keep to a few particles, so that fewer of them are known:
tests/stability/test_guard.py, `TestWholeSpectra`."""

ALTERNATING_IRREGULAR = 0.89
"""The same where motion that changes its sign from step to step sets the limit (leapfrog, damped):
tests/stability/test_guard.py, `TestWholeSpectra`, the two rows of leapfrog."""

AMPLIFIED = 0.96
"""Share of the limit of a method that amplifies waves, which the mode that is damped least for its frequency sets: known
modes are means of several and bear up to 2 % more than the least of them. tests/stability/test_guard.py,
`TestWholeSpectra`, the rows of rk2 and rkc."""

AMPLIFIED_INSIDE = 0.92
"""The same where something holds the fastest modes and damps them well, so that the least damped ones lie inside of the
spectrum, where they are known to 8 %: tests/stability/test_guard.py, `TestWholeSpectra`, total-lagrangian blocks."""

AMPLIFIED_IRREGULAR = 0.88
"""Factor on the shares of a method that amplifies waves, in an irregular body: tests/stability/test_guard.py,
`TestWholeSpectra`, blocks with jitter."""

EULER = 0.7
"""Share of Euler's limit in more than one dimension. It follows the damping itself, not its third root, so what is not known
of the modes counts up to 35 %, in irregular bodies 60 %: tests/stability/test_guard.py, `TestWholeSpectra`, the rows of
euler."""

CORNERS = 0.9
"""Share of 2 sqrt(m2) that Taylor-SPH takes in two and three dimensions, because corners grow above: at 0.9 no mode of a
block grows, at 1 one of a held block grows by 0.015 a step (tests/integrators/test_taylor_stability.py,
`test_no_mode_of_a_lattice_block_grows` and the tests beside it)."""

APPROACH = (0.5, 0.022, 0.2, 0.59)
"""Damping by viscosity that acts on approaching pairs alone, as shares of the same viscosity on all pairs. Both are tried,
and the worse one sets the limit:

    low share    max(0.2, 0.5 - 0.022 times the largest damping rate over the largest frequency)
    high share   0.59

About half of the pairs of a wave approach. Overdamped motion lasts longer in the half of the time in which it is not damped
(low); in a front more than half of the pairs approach (high). The numbers are from runs of the magnesium bar
(`wsph validate --full bar-stability`), whose limits lie 0 to 20 % above the ones that they give
(tests/stability/test_guard.py, `TestRuns.test_within_twenty_per_cent_on_the_switched_viscous_bar`)."""

STILL = {"f64": 1e-4, "f32": 1e-2}
"""A mode slower than this part of the fastest is a motion of the rigid body, by the run's precision:
tests/stability/test_guard.py, `TestWholeSpectra`, whose blocks are free."""

VECTORS = 20
"""Vectors, with a product each, that the spectrum of a body without damping takes: Lanczos' method. How much of a limit they
leave out is in the shares above; `TestWholeSpectra.test_it_takes_fifty_evaluations_at_most` in
tests/stability/test_guard.py."""

DAMPED_VECTORS = (6, 24)
"""The same for a body with viscosity, two products each: Lanczos' vectors, then the most of the second-order Krylov space.
The same tests."""

PRODUCTS = 40
"""Products of Arnoldi's method for the growth of a step, and so vectors kept: with blocks of 100 steps, on bodies of 64
nodes, they find a growth of 2e-4 to 9e-4 a step to 1 % (tests/integrators/test_taylor_stability.py,
`test_the_growth_that_the_guard_finds_is_the_spectrum_s`, which asks 2 %)."""
