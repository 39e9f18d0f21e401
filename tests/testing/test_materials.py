"""The conformance kit under materials that are wrong: it finds each mistake."""

from dataclasses import dataclass, field

import pytest
import warp as wp

from wsph.testing import check_material


@dataclass(frozen=True)
class Bad:
    """A material that breaks one rule, chosen by name."""

    density: float = field(default=1.0, metadata={"unit": "kg/m3"})
    rule: str = "symmetric"
    depends_on_stress = True

    def moduli(self) -> tuple[float, float]:
        """Bulk 2/3, shear 1."""
        return 2.0 / 3.0, 1.0

    def rate(self, space, Params):
        """Elasticity with a mistake."""
        real, tensor = space.scalar, space.tensor
        rule = {"symmetric": 0, "rest": 1, "frame": 2, "affine": 3, "moduli": 4, "dissipation": 5}[self.rule]

        @wp.func
        def law(p: Params, stress: tensor, L: tensor) -> tensor:
            rate = p.elastic_shear * (L + wp.transpose(L))
            if wp.static(rule == 0):
                rate = real(2.0) * p.elastic_shear * L
            if wp.static(rule == 1):
                rate += wp.identity(n=3, dtype=real)
            if wp.static(rule == 2):
                rate[0, 0] = rate[0, 0] + stress[1, 1]
            if wp.static(rule == 3):
                rate += wp.ddot(L, L) * wp.identity(n=3, dtype=real)
            if wp.static(rule == 4):
                rate *= real(1.5)
            if wp.static(rule == 5):
                rate += stress
            return rate

        return law


@pytest.mark.parametrize(
    ("rule", "message"),
    [("symmetric", "not symmetric"), ("rest", "without stress and motion is not zero"), ("frame", "another frame"), ("affine", "not affine"),
     ("moduli", r"not that of moduli\(\)"), ("dissipation", "dissipation is negative")],
)  # fmt: skip
def test_the_kit_finds_each_mistake(rule: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_material(Bad(rule=rule), stress_level=1.0, precisions=("f64",))


@dataclass(frozen=True)
class Liar(Bad):
    """Says that its rate ignores stress, and lies."""

    depends_on_stress = False

    def rate(self, space, Params):
        """A relaxing law."""
        tensor = space.tensor

        @wp.func
        def law(p: Params, stress: tensor, L: tensor) -> tensor:
            return p.elastic_shear * (L + wp.transpose(L)) - stress

        return law


def test_the_kit_finds_a_material_that_lies_about_stress() -> None:
    with pytest.raises(AssertionError, match="depends_on_stress is False"):
        check_material(Liar(), stress_level=1.0, precisions=("f64",))


@dataclass(frozen=True)
class Still(Bad):
    """Says that it turns itself, and has no spin."""

    turns_itself = True
    relaxes = False

    def rate(self, space, Params):
        """Elasticity, without a spin."""
        tensor = space.tensor

        @wp.func
        def law(p: Params, stress: tensor, L: tensor) -> tensor:
            return p.elastic_shear * (L + wp.transpose(L))

        return law


def test_the_kit_finds_a_material_that_does_not_turn_itself() -> None:
    with pytest.raises(AssertionError, match="turns_itself is True, but a spin does not turn"):
        check_material(Still(), stress_level=1.0, precisions=("f64",))


@dataclass(frozen=True)
class Returning(Still):
    """A rate of elasticity with a way back to a yield surface that breaks one rule."""

    turns_itself = False
    back: str = "right"

    def project(self, space, Params):
        """Back to a yield surface, with a mistake."""
        real, tensor = space.scalar, space.tensor
        rule = {"right": -1, "symmetric": 0, "nothing": 1, "frame": 2, "twice": 3, "dissipation": 4, "nan": 5}[
            self.back
        ]

        @wp.func
        def back(p: Params, stress: tensor) -> tensor:
            mean = wp.trace(stress) / real(3.0) * wp.identity(n=3, dtype=real)
            s = stress - mean
            size = wp.sqrt(real(1.5) * wp.ddot(s, s))
            if wp.static(rule == 1):
                stress[0, 0] = stress[0, 0] + real(0.1)
            if wp.static(rule == 5):
                stress = stress * (real(0.0) / real(0.0))
            if size <= real(1.0):
                return stress
            if wp.static(rule == 0):
                s[0, 1] = real(0.5) * s[0, 1]
            if wp.static(rule == 2):
                s[0, 0] = real(0.5) * s[0, 0]
            if wp.static(rule == 3):
                return mean + real(0.9) * s
            if wp.static(rule == 4):
                return mean + real(1.1) * s
            return mean + s / size

        return back


@pytest.mark.parametrize(
    ("back", "message"),
    [("symmetric", "`project` gives is not symmetric"), ("nothing", "`project` makes a stress where there is none"), ("frame", "another frame gives another stress from"),
     ("twice", "`project` of what it gave"), ("dissipation", "`project` of what it gave|dissipation is negative"), ("nan", "`project` gives is not finite")],
)  # fmt: skip
def test_the_kit_finds_each_mistake_of_a_way_back(back: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_material(Returning(back=back), stress_level=1.0, precisions=("f64",))


def test_a_way_back_without_a_mistake_passes() -> None:
    check_material(Returning(), stress_level=1.0)


@dataclass(frozen=True)
class Total:
    """Linear elasticity of the Green strain, as a total law that breaks one rule."""

    density: float = field(default=1.0, metadata={"unit": "kg/m3"})
    rule: str = "right"

    def moduli(self) -> tuple[float, float]:
        """Bulk 2/3, shear 1: no other Lame modulus."""
        return 2.0 / 3.0, 1.0

    def stress(self, space, Params):
        """St Venant-Kirchhoff, with a mistake."""
        real, tensor = space.scalar, space.tensor
        rule = {"right": -1, "rest": 0, "symmetric": 1, "objective": 2, "isotropic": 3, "moduli": 4, "nan": 5}.get(
            self.rule, -1
        )

        @wp.func
        def law(p: Params, H: tensor) -> tensor:
            one = wp.identity(n=3, dtype=real)
            F = one + H
            E = real(0.5) * (wp.transpose(F) * F - one)
            if wp.static(rule == 2):
                E = real(0.5) * (H + wp.transpose(H))
            if wp.static(rule == 3):
                E[0, 0] = real(0.5) * E[0, 0]
            S = real(2.0) * p.elastic_shear * E
            if wp.static(rule == 0):
                S = S + one
            if wp.static(rule == 4):
                S = real(1.5) * S
            if wp.static(rule == 5):
                S = S * (real(0.0) / real(0.0))
            stress = F * S * wp.transpose(F) / wp.determinant(F)
            if wp.static(rule == 1):
                stress[0, 1] = stress[0, 1] + p.elastic_shear * E[0, 1]
            return stress

        return law

    def energy(self, space, Params):
        """G E:E."""
        real, tensor = space.scalar, space.tensor
        factor, rounded = 1.5 if self.rule == "work" else 1.0, self.rule == "constant"

        @wp.func
        def stored(p: Params, H: tensor) -> real:
            E = real(0.5) * (H + wp.transpose(H) + wp.transpose(H) * H)
            if wp.static(rounded):
                E = real(2.0 / 3.0) * real(1.5) * E
            return real(factor) * p.elastic_shear * wp.ddot(E, E)

        return stored


@pytest.mark.parametrize(
    ("rule", "message"),
    [("rest", "the stress without strain is not zero"), ("symmetric", "not symmetric"), ("objective", "does not turn with the body"), ("isotropic", "a turn before the strain"),
     ("moduli", r"not that of moduli\(\)"), ("nan", "not finite"), ("constant", r"the energy is not the work of the stress: dW/dF differs by \d.\d\de-0[789]. A gap this small is a constant in single precision: .*write real\(2.0\)/real\(3.0\)$"),
     ("work", "the energy is not the work of the stress")],
)  # fmt: skip
def test_the_kit_finds_each_mistake_of_a_total_law(rule: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_material(Total(rule=rule), precisions=("f64",))


def test_a_total_law_without_a_mistake_passes() -> None:
    check_material(Total())
