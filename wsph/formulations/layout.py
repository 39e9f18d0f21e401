"""Which fields a state has."""

from wsph.backend.space import Space
from wsph.backend.state import Layout
from wsph.constitutive.constitutive import Constitutive


def layout_of(
    space: Space,
    constitutive: Constitutive,
    displacement: bool = False,
    deformation: bool = False,
    spin: bool = False,
    damage: str = "",
    drag: bool = False,
) -> Layout:
    """Fields and widths of a state, velocity first; `damage` is how a body breaks (`wsph.scene.damage_model`)."""
    widths = {
        "velocity": space.dim,
        "drag": space.dim * drag,
        "stress": constitutive.width,
        "internals": len(constitutive.internals),
        "deformation": space.dim**2 * deformation,
        "spin": space.dim * (space.dim - 1) // 2 * spin,
        "displacement": space.dim * displacement,
        "damage": int(damage != ""),
        # Under a phase field an evolved stress goes on undamaged.
        "damaged_stress": constitutive.width * (damage in ("AT1", "AT2") and constitutive.laws.total is None),
    }
    return tuple((name, width) for name, width in widths.items() if width)
