"""One-set integrators on the Lagrangian forms: orders, regions, conservation, what composes and closes its ledger."""

import numpy as np
import pytest
from wsph_integrators.chebyshev import Coefficients, stages_for
from wsph_integrators.runge_kutta import Chain, Tableau

import wsph
from tests import scenes
from tests.scenes import FORMS
from wsph.plugins import registry
from wsph.simulation.compose import compose
from wsph.stability.regions import imaginary_limit
from wsph.testing import drift, temporal_order

NEO_HOOKEAN = {"model": "neo-hookean", "poisson_ratio": 0.3}
PERZYNA = {"model": "perzyna", "poisson_ratio": 0.3, "yield_stress": 0.002, "hardening_modulus": 0.1, "fluidity": 0.05,
           "exponent": 1.0}  # fmt: skip
USUAL = (0.2, 0.1, 0.05, 0.025)


class TestOrders:
    """By regression over halved time steps at a fixed spacing; 20 % of the wave speed, so that the laws are not linear."""

    @pytest.mark.parametrize("material", [None, NEO_HOOKEAN], ids=["svk", "neo-hookean"])
    @pytest.mark.parametrize(
        ("name", "order", "courant"),
        [
            ("euler", 1, (0.02, 0.01, 0.005, 0.0025)),
            ("pc2", 2, USUAL),
            ("rk2", 2, USUAL),
            ("leapfrog", 2, USUAL),
            ("w20-2-8", 2, USUAL),
            ("kg4-8", 3, (0.4, 0.2, 0.1, 0.05)),
            ("rk4", 4, USUAL),
            ("lf4", 4, USUAL),
            # Below 0.05 its errors are rounding.
            ("blanes-moan4", 4, (0.4, 0.2, 0.1, 0.05)),
        ],
    )
    def test_elastic(self, name: str, order: int, courant: tuple[float, ...], material: dict | None) -> None:
        assert temporal_order(name, courant, amplitude=0.2, material=material) == pytest.approx(order, abs=0.1)

    def test_chebyshev_with_viscosity(self) -> None:
        rkc = {"name": "rkc", "stages": 5}
        damped = {"formulation": "total-lagrangian", "viscosity": {"alpha": 1.0, "kind": "pair"}}
        assert temporal_order(rkc, amplitude=0.2, **damped) == pytest.approx(2.0, abs=0.1)

    @pytest.mark.parametrize("formulation", FORMS)
    @pytest.mark.parametrize(
        "material", [{"model": "jaumann", "poisson_ratio": 0.3}, PERZYNA], ids=["jaumann", "perzyna"]
    )
    def test_leapfrog_is_of_second_order_where_the_law_depends_on_stress(
        self, material: dict, formulation: str
    ) -> None:
        assert temporal_order("leapfrog", material=material, formulation=formulation) == pytest.approx(2.0, abs=0.1)

    @pytest.mark.parametrize("formulation", FORMS)
    @pytest.mark.parametrize(
        "viscosity", [{"alpha": 0.5, "kind": "pair"}, {"alpha": 0.5, "beta": 0.5}], ids=["pair", "approach"]
    )
    def test_leapfrog_with_viscosity_and_what_lagging_it_costs(self, viscosity: dict, formulation: str) -> None:
        courant = (0.1, 0.05, 0.025, 0.0125)
        keys = {"formulation": formulation, "amplitude": 0.1, "viscosity": viscosity}
        assert temporal_order("leapfrog", courant, **keys) == pytest.approx(2.0, abs=0.1)
        assert temporal_order({"name": "leapfrog", "lagged": True}, courant, **keys) == pytest.approx(1.1, abs=0.15)

    def test_tableaus_check_themselves(self) -> None:
        class Wrong(Tableau):
            order = 2
            a = ((0.5,),)
            b = (0.1, 0.9)

        assert max(v for k, v in registry.load("integrators", "rk4").conditions().items() if k <= 4) < 1e-15
        assert Wrong.conditions()[2] > 0.01
        with pytest.raises(ValueError, match="order 2"):
            Wrong._check(Wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "reach"), [("rk4", 2.828), ("kg4-8", 6.928), ("w20-2-8", 6.427), ("rk2", 0.0), ("euler", 0.0)]
)
def test_regions_on_the_imaginary_axis(name: str, reach: float) -> None:
    method = registry.load("integrators", name)
    assert issubclass(method, (Tableau, Chain))
    assert imaginary_limit(method.polynomial()) == pytest.approx(reach, abs=2e-3)


@pytest.mark.parametrize("stages", [2, 3, 5, 10])
def test_chebyshev_is_consistent_and_amplifies_every_undamped_wave(stages: int) -> None:
    """|R(iy)|^2 = 1 + y^4 (1/4 - 2 a3 + 2 a4) to leading order, above 1 for every number of stages."""
    amplification = Coefficients(stages).amplification
    circle = np.exp(2j * np.pi * np.arange(16) / 16)
    a = np.fft.fft(amplification(circle)).real / 16
    np.testing.assert_allclose(a[:3], [1.0, 1.0, 0.5], atol=1e-12)
    assert 0.25 - 2.0 * a[3] + 2.0 * a[4] > 0.0
    assert imaginary_limit(a[: stages + 1]) == 0.0
    assert np.abs(amplification(-np.linspace(0.0, 0.65 * (stages**2 - 1), 2000))).max() <= 1.0 + 1e-9


def test_chebyshev_has_its_region_with_two_hundred_stages() -> None:
    real = -np.linspace(0.0, 0.65 * (200**2 - 1), 100_000)
    assert np.abs(Coefficients(200).amplification(real)).max() <= 1.0 + 1e-9


def test_the_stages_of_the_paper() -> None:
    assert [stages_for(c) for c in (0.15, 0.6, 1.2, 2.5)] == [2, 3, 4, 5]


def block(
    formulation: str, dim: int = 2, *, precision: str = "f64", model: str = "elastic", **body: object
) -> wsph.Scene:
    """A free block that spins, stretches and shears."""
    run = {"formulation": formulation, "cfl": 0.1, "precision": precision}
    return scenes.turning(dim, run, model=model, **body)


class TestConservation:
    """2000 steps of a free body that turns by a third and stretches."""

    @pytest.mark.parametrize("dim", [2, 3])
    @pytest.mark.parametrize(("formulation", "residual", "gates"), [
        ("total-lagrangian", False, (1e-14, 1e-12, 1e-4)),
        ("total-lagrangian", None, (1e-14, 1e-12, 1e-4)),
        ("stress-points", None, (1e-13, 1e-13, 5e-4)),
        ("updated-lagrangian", False, (1e-14, 1e-12, 1e-4)),
    ])  # fmt: skip
    def test_momentum_angular_momentum_and_energy(
        self, formulation: str, residual: object, gates: tuple, dim: int
    ) -> None:
        body = {} if residual is None else {"residual": residual}
        found = drift(compose(block(formulation, dim, **body)), 2000)
        assert all(gap <= gate for gap, gate in zip(found, gates, strict=True)), found

    @pytest.mark.parametrize(
        "keys", [{"state": "stress"}, {"model": "neo-hookean"}, {"model": "jaumann"}, {"jitter": 0.2}], ids=str
    )
    @pytest.mark.parametrize("formulation", FORMS)
    def test_in_plane_stress_large_strain_rate_laws_and_on_jitter(self, formulation: str, keys: dict) -> None:
        found = drift(compose(block(formulation, **keys)), 2000)
        assert found[0] < 1e-11
        assert found[1] < 2e-12
        assert found[2] < 5e-4


@pytest.mark.parametrize(("precision", "linear", "angular"), [("f64", 1e-14, 1e-12), ("f32", 1e-6, 1e-6)])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("formulation", [*FORMS, "updated-lagrangian"])
def test_forces_and_their_moments_sum_to_nothing(
    formulation: str, dim: int, precision: str, linear: float, angular: float
) -> None:
    """Of one evaluation about a random state, of their sum without signs."""
    composition = compose(block(formulation, dim, precision=precision, model="elastic"))
    system = composition.bodies[0].system
    system.state.write("displacement", 0.1 * np.random.default_rng(5).standard_normal((system.count, dim)))
    if system.traits.pairs_follow:
        system.state.write("deformation", 0.1 * np.random.default_rng(6).standard_normal((system.count, dim**2)))
        system.follow()
    out = system.new()
    system.rate(system.state, out, "velocity")
    force = out.read("velocity") * (system.density * system.volume)[:, None]
    x = system.position / composition.scales.length + system.state.read("displacement")
    assert np.abs(force.sum(0)).max() < linear * np.abs(force).sum()
    for i, j in ((0, 1), (1, 2), (0, 2)):
        if j < dim:
            assert (
                abs((x[:, i] * force[:, j] - x[:, j] * force[:, i]).sum()) < angular * (np.abs(x) * np.abs(force)).sum()
            )


@pytest.mark.parametrize(("precision", "gate"), [("f64", 1e-12), ("f32", 1e-6)])
@pytest.mark.parametrize("formulation", FORMS)
def test_a_turn_of_a_thousand_degrees_is_free_of_stress(formulation: str, precision: str, gate: float) -> None:
    composition = compose(block(formulation, precision=precision, state="stress"))
    system = composition.bodies[0].system
    c, s = np.cos(np.radians(1000.0)), np.sin(np.radians(1000.0))
    turn = np.array([[c, -s], [s, c]]) - np.eye(2)
    system.state.write("displacement", (system.position - 0.1) @ turn.T / composition.scales.length)
    system.rate(system.state, system.new(), "velocity")
    assert np.abs(system.state.read("stress")).max() * composition.scales.stress < gate  # E is one


# What a method takes or refuses is the same with every law of a kind, and viscosity makes kernels of its own of each.
OF_A_KIND = [(name, model) for name in ("euler", "pc2", "rkc") for model in ("neo-hookean", "perzyna", "mises")]
COMPOSED = [
    pytest.param(name, formulation, model, marks=pytest.mark.slow if (name, model) in OF_A_KIND else ())
    for name in ("leapfrog", "rk4", "rkc", "euler", "pc2", "kg4-8", "w20-2-8", "lf4", "blanes-moan4")
    for formulation in (*FORMS, "updated-lagrangian")
    for model in ("elastic", "neo-hookean", "jaumann", "perzyna", "mises")
    if not (formulation == "updated-lagrangian" and name in ("lf4", "blanes-moan4"))
]


@pytest.mark.parametrize(("name", "formulation", "model"), COMPOSED, ids=str)
def test_every_composition_that_is_not_refused_runs(name: str, formulation: str, model: str) -> None:
    scene = block(formulation, model="elastic")
    data = scene.data()
    if model == "perzyna":
        data["bodies"][0]["material"] |= {k: v for k, v in PERZYNA.items() if k not in ("model", "poisson_ratio")}
    if model == "mises":
        data["bodies"][0]["material"] |= {"yield_stress": 0.01, "hardening_modulus": 0.1}
    data["bodies"][0]["material"]["model"] = model
    if name == "rkc" and formulation != "stress-points":
        data["bodies"][0]["viscosity"] = {"alpha": 1.0, "kind": "pair"}
    data["run"] |= {"integrator": name, "cfl": 0.1, "end": 1.0}
    must = name in ("leapfrog", "rk4") or (name == "rkc" and formulation != "stress-points")
    total_alone = name in ("lf4", "blanes-moan4") and model in ("jaumann", "perzyna", "mises")
    if not must and (name in ("euler", "pc2", "rkc") or total_alone):
        with pytest.raises(wsph.WsphError, match=r"limit 0\.000|takes total laws"):
            wsph.run(wsph.Scene(**data))
        return
    result = wsph.run(wsph.Scene(**data))
    assert result.summary["steps"] >= 50
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 1e-2 * energy["external_work"]


def pulled(**overrides: object) -> wsph.Scene:
    """A square block in plane stress."""
    rubber = scenes.material(density=1000.0, youngs_modulus=1e6, poisson_ratio=0.0)
    return scenes.block(run={"end": 0.05, "cfl": 0.5}, state="stress", material=rubber).with_(**overrides)


@pytest.mark.parametrize("formulation", FORMS)
@pytest.mark.parametrize("velocity", ["0.1", "t"])
@pytest.mark.parametrize("name", ["leapfrog", "rk4", "blanes-moan4", "kg4-8"])
def test_the_work_of_a_moving_boundary_is_the_energy_it_gives(name: str, velocity: str, formulation: str) -> None:
    push = [scenes.driven("+x", x=velocity), scenes.held("-x", 1)]
    result = wsph.run(pulled(boundary=push, **{"run.integrator": name, "run.formulation": formulation}))
    energy = result.summary["energy"]
    assert energy["external_work"] > 0.01
    assert abs(energy["residual"]) < 0.02 * energy["external_work"]


@pytest.mark.filterwarnings("ignore:.*clump together", "ignore:.*energy was created")
@pytest.mark.parametrize(("model", "formulation"), [("elastic", "total-lagrangian"), ("elastic", "stress-points"),
                                                    ("neo-hookean", "updated-lagrangian")])  # fmt: skip
def test_the_limit_follows_the_deformation(model: str, formulation: str) -> None:
    """A block that is stretched stiffens or comes closer together: a time step that passed at the start is stopped by name
    on its way, one given by its Courant number follows."""
    pull = [scenes.driven("+x", x=0.3, y=0), scenes.held("-x", 2)]
    keys = {
        "bodies.0.velocity": ["0.3*x", "0"],
        "bodies.0.state": "strain",
        "bodies.0.material": scenes.material(model),
    }
    scene = pulled(boundary=pull, end=2.0, **keys, **{"run.formulation": formulation})
    limit = compose(scene.with_(guard="off")).bodies[0].limit
    dt = compose(scene.with_(cfl=0.97 * limit)).dt
    with pytest.raises(
        wsph.Unstable, match=r"its stability limit has fallen below its Courant number by deformation.*limit"
    ):
        wsph.run(scene.with_(dt=dt))
    with pytest.warns(RuntimeWarning, match="its stability limit has fallen"):
        wsph.run(scene.with_(dt=dt, guard="warn", stop={"energy": 1e6}), throw=False)
    if formulation != "updated-lagrangian":  # which stretched so far has no stable step
        result = wsph.run(scene.with_(cfl=0.97 * limit))
        assert result.history["dt"][-1] < 0.9 * dt
        assert abs(result.summary["energy"]["residual"]) < 2e-3 * result.summary["energy"]["external_work"]


def test_a_method_without_a_stable_step_runs_where_that_is_only_warned_of() -> None:
    scene = block("total-lagrangian").with_(integrator="euler", cfl=0.01, guard="warn", end=0.1)
    with pytest.warns(RuntimeWarning, match="is beyond its stability limit 0.000"):
        assert wsph.run(scene).status == "completed"


def test_rkc_with_viscosity_and_a_moving_boundary_closes_its_ledger() -> None:
    push = [scenes.driven("+x", x="t"), scenes.held("-x", 1)]
    rkc = {"name": "rkc", "stages": 4}
    changes = {"run.formulation": "total-lagrangian", "bodies.0.viscosity": {"alpha": 1.0, "kind": "pair"}}
    energy = wsph.run(pulled(boundary=push, **{"run.integrator": rkc, **changes})).summary["energy"]
    assert abs(energy["residual"]) < 0.02 * energy["external_work"]


@pytest.mark.parametrize("name", ["leapfrog", "rk4", "kg4-8", "w20-2-8", "lf4"])
def test_stresses_are_of_the_instant_they_are_read_at(name: str) -> None:
    """A wave's standing mode in a free bar: the stress in the middle at every step."""
    probe = {"name": "middle", "at": [[0.5]], "fields": ["stress_xx"], "every": 1}
    body = {"velocity": ["1e-3*cos(pi*x)"], "material": scenes.material(poisson_ratio=0.0)}
    scene = scenes.bar(50, run={"integrator": name, "end": 0.5, "cfl": 0.9}, tables={"probes": [probe]}, **body)
    record = wsph.run(scene).probes["middle"]
    np.testing.assert_allclose(record["stress_xx"], -1e-3 * np.sin(np.pi * record["time"]), atol=5e-6)


def test_a_body_at_rest_has_no_energy_in_single_precision() -> None:
    energy = wsph.run(pulled(**{"run.precision": "f32"})).summary["energy"]
    assert energy["external_work"] == energy["hourglass"] == 0.0


def test_the_trial_of_a_warned_run_leaves_nothing_behind() -> None:
    mode = {"bodies.0.velocity": ["0.01*sin(pi*x)", "0"], "cfl": 1.06, "end": 0.02}
    with pytest.warns(RuntimeWarning, match="beyond its stability limit"):
        warned = wsph.run(pulled(guard="warn", **mode))
    off = wsph.run(pulled(guard="off", **mode))
    assert np.array_equal(warned.particles["velocity"], off.particles["velocity"])
    assert warned.summary["energy"] == off.summary["energy"]


def test_a_probe_at_a_particle_reads_it_and_a_load_on_what_is_held_is_refused() -> None:
    load = [{"body": "b", "face": "-x", "fixed": ["x", "y"]}, {"body": "b", "face": "+x", "traction": {"x": 1e3}}]
    probe = {"name": "end", "at": [[1.0, 0.5]], "fields": ["displacement_x"], "every": 1}
    result = wsph.run(pulled(boundary=load, probes=[probe], output={"fields": ["displacement"]}))
    at = np.flatnonzero((np.abs(result.particles["position"] - [1.0, 0.5]) < 1e-9).all(1))
    assert result.probes["end"]["displacement_x"][-1] == result.particles["displacement"][at[0], 0]
    with pytest.raises(wsph.SceneError, match=r"boundary.0.traction.x: the velocity x is prescribed too"):
        wsph.run(pulled(boundary=[{"body": "b", "face": "+x", "fixed": ["x"], "traction": {"x": 1e3}}]))
    with pytest.raises(wsph.SceneError, match=r"run.integrator: rkc: stages = 1: a whole number from 2"):
        wsph.run(pulled(integrator={"name": "rkc", "stages": 1}))


def test_a_static_bar_stretches_by_its_load() -> None:
    load = [{"body": "b", "face": "-x", "fixed": ["x"]}, {"body": "b", "face": "+x", "stress": {"xx": 1e3}}]
    still = {"bodies.0.damping": {"rate": 60.0}, "end": 0.5, "output": {"fields": ["displacement"]}}
    result = wsph.run(pulled(boundary=load, **still))
    end = result.particles["position"][:, 0] == 1.0
    assert result.particles["displacement"][end, 0] == pytest.approx(1e-3, rel=5e-3)
    assert result.particles["stress"][:, 0] == pytest.approx(1e3, rel=5e-3)


@pytest.mark.parametrize("formulation", FORMS)
def test_a_mapped_ring_under_pressure_is_that_of_lame(formulation: str) -> None:
    """A quarter of a ring, radii 1 and 2, pressed from inside: hoop stress over pressure (r_o^2/r^2 + 1)/(r_o^2/r_i^2 -
    1)."""
    ring = ["(1+x)*cos(pi*y/2)", "(1+x)*sin(pi*y/2)"]
    body = {"map": ring, "spacing": [0.05, 0.025], "state": "stress", "damping": {"rate": 1.0}}
    pressure = {"x": "1e-4*x/sqrt(x*x+y*y)", "y": "1e-4*y/sqrt(x*x+y*y)"}
    boundary = [{"body": "b", "face": "-x", "traction": pressure}, {"body": "b", "face": "-y", "symmetry": "y"},
                {"body": "b", "face": "+y", "symmetry": "x"}]  # fmt: skip
    run = {"formulation": formulation, "end": 30.0, "cfl": 0.8}
    at = [[r / 2**0.5, r / 2**0.5] for r in (1.5, 1.25)]
    probe = {"name": "p", "at": at, "fields": ["stress"], "every": "30 s"}
    result = wsph.run(scenes.block(run=run, tables={"boundary": boundary, "probes": [probe]}, **body))
    for k, r in enumerate((1.5, 1.25)):
        xx, yy, xy = (result.probes["p"][f"stress_{name}[{k}]"][-1] for name in ("xx", "yy", "xy"))
        hoop = 0.5 * (xx + yy) - xy
        assert hoop == pytest.approx(
            1e-4 * (4.0 / r**2 + 1.0) / 3.0, rel=0.01 if formulation == "stress-points" else 0.04
        )
