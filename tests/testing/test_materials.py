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
