"""A broken plugin harms the scene that names it and no other."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.distributions import install
from wsph.cli import main

ROOT = Path(__file__).resolve().parents[2]

MATERIAL = '''
from dataclasses import dataclass, field
import warp as wp

@dataclass(frozen=True)
class Plugin:
    """A law with a mistake."""
    density: float = field(metadata={{"unit": "kg/m3", "above": 0.0}})
    stiffness: float = field(metadata={{"unit": "Pa", "above": 0.0}})
{changed}
'''
MODULI = """
    def moduli(self):
        return self.stiffness, self.stiffness
"""
LAW = """
    def rate(self, space, Params):
        tensor = space.tensor
        @wp.func
        def law(p: Params, stress: tensor, L: tensor) -> tensor:
            return p.stiffness * L
        return law
"""
INTEGRATOR = '''
class Plugin:
    """A method with a mistake."""
    sets, order, evaluations = 1, 1, 1
{changed}
'''
START = """
    def __init__(self, system):
        self.system, self.state, self.rate = system, system.state, system.new()
    def limit(self):
        return 1.0, "as it says"
"""
STEP = """
    def step(self):
        s, y = self.system, self.state
        s.rate(y, self.rate)
        s.combine(y, plain=[(1.0, y)], timed=[(1.0, self.rate)])
        s.accept(y)
"""

SPOIL = """
import warp as wp

@wp.kernel(module="unique", enable_backward=False)
def spoil(clock: wp.array(dtype=wp.float64), buffer_out: wp.array(dtype=wp.float64)):
    if clock[0] > clock[1] * wp.float64(29.5):
        buffer_out[7] = wp.float64(wp.nan)
"""
SPOILED = """        s.clock.launch(spoil, 1, [s.clock.time], [y.buffer])
"""

# What the plugin's module holds, the exit code, and what has to be said.
FAULTS: dict[str, tuple[str, str, int, str]] = {
    "import fails": ("material", "import no_such_module", 2, "cannot be imported: ModuleNotFoundError"),
    "import raises": ("material", "raise RuntimeError('on import')", 2, "cannot be imported: RuntimeError: on import"),
    "import exits": ("material", "import sys; sys.exit(5)", 2, "cannot be imported: SystemExit: 5"),
    "import kills": ("material", "import os; os._exit(7)", 7, ""),
    "syntax": ("material", "def law(:", 2, "cannot be imported: SyntaxError"),
    "no such class": ("material", "Other = 1", 2, "cannot be imported: AttributeError"),
    "not a class": ("material", "Plugin = 3", 2, "is not a class"),
    "not a dataclass": ("material", "class Plugin: pass", 2, "is not a dataclass"),
    "no law": ("material", MATERIAL.format(changed=MODULI), 2, "neither `rate` nor `stress`"),
    "no moduli": ("material", MATERIAL.format(changed=LAW), 2, "moduli"),
    "moduli raise": ("material", MATERIAL.format(changed=LAW + "    def moduli(self):\n        return 1/0\n"), 2, "division by zero"),
    "moduli are text": ("material", MATERIAL.format(changed=LAW + "    def moduli(self):\n        return 'ab'\n"), 2, "moduli"),
    "moduli are not finite": ("material", MATERIAL.format(changed=LAW + "    def moduli(self):\n        return float('nan'), 1.0\n"), 2, "moduli"),
    "wrong arity of the law": ("material", MATERIAL.format(changed=MODULI + LAW.replace(", L: tensor", "").replace(" L", " stress")), 2, "takes 2 arguments, not 3"),
    "wrong return of the law": ("material", MATERIAL.format(changed=MODULI + LAW.replace("-> tensor", "").replace("* L", "* wp.trace(L)")), 2, "its code fails"),
    "the law returns nothing": ("material", MATERIAL.format(changed=MODULI + LAW.replace("-> tensor", "").replace("return p.stiffness * L", "q = p.stiffness")), 2, "its code fails"),
    "no function": ("material", MATERIAL.format(changed=MODULI + "    def rate(self, space, Params):\n        return None\n"), 2, "no @wp.func"),
    "rate takes no space": ("material", MATERIAL.format(changed=MODULI + "    def rate(self):\n        return None\n"), 2, "expected rate(self, space, Params)"),
    "a name that is not there": ("material", MATERIAL.format(changed=MODULI + LAW.replace("p.stiffness", "p.stifness")), 2, "its code fails"),
    "NaN once it is strained": ("material", MATERIAL.format(changed=MODULI + LAW.replace("p.stiffness * L", "p.stiffness * L / wp.where(stress[0, 0] < space.scalar(-1e-3), space.scalar(0.0), space.scalar(1.0))")), 3, "unstable at step"),
    "constructor takes nothing": ("integrator", INTEGRATOR.format(changed=STEP + "    def __init__(self):\n        pass\n"), 2, "takes"),
    "constructor raises": ("integrator", INTEGRATOR.format(changed=STEP + "    def __init__(self, system):\n        raise KeyError('k')\n"), 2, "KeyError"),
    "no step": ("integrator", INTEGRATOR.format(changed=START), 2, "step"),
    "step takes more": ("integrator", INTEGRATOR.format(changed=START + STEP.replace("(self)", "(self, more)")), 2, "step"),
    "step raises": ("integrator", INTEGRATOR.format(changed=START + "    def step(self):\n        return self.nothing\n"), 2, "nothing"),
    "limit raises": ("integrator", INTEGRATOR.format(changed=START.replace('return 1.0, "as it says"', "return 1.0 / 0") + STEP), 2, "division by zero"),
    "limit is a number alone": ("integrator", INTEGRATOR.format(changed=START.replace(', "as it says"', "") + STEP), 2, "limit"),
    "sets of three": ("integrator", INTEGRATOR.replace("= 1, 1, 1", "= 3, 1, 1").format(changed=START + STEP), 2, "sets"),
    "NaN at step 30": ("integrator", SPOIL + INTEGRATOR.format(changed=START + STEP + SPOILED), 3, "velocity or stress of particle"),
    "a kernel of its own": ("integrator", SPOIL.replace("wp.float64(wp.nan)", "wp.nan") + INTEGRATOR.format(changed=START + STEP + SPOILED), 2, "its code fails"),
}  # fmt: skip


KILLS = "import kills"
"""The one fault that no process survives."""


def command(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """wsph in a process of its own that sees what is installed in `folder`."""
    return subprocess.run(
        [sys.executable, "-m", "wsph.cli", *arguments],
        capture_output=True, text=True, check=False, cwd=folder, env={**os.environ, "PYTHONPATH": str(folder)}, timeout=120,
    )  # fmt: skip


def scene(kind: str) -> str:
    text = (ROOT / "examples" / "shock_bar.toml").read_text()
    if kind == "material":
        start, end = text.index("[bodies.material]"), text.index("[functions.pulse]")
        keys = '[bodies.material]\nmodel = "broken"\ndensity = 2000.0\nstiffness = 8e7\n\n'
        return text[:start] + keys + text[end:]
    return text.replace('integrator = "tsph"', 'integrator = "broken"').replace("cfl = 1.0", "cfl = 0.1")


@pytest.mark.parametrize("fault", [fault for fault in FAULTS if fault != KILLS])
def test_a_broken_plugin_is_named_and_nothing_is_written(
    fault: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process, which goes on: the next fault is found no worse for it."""
    kind, code, exit_code, words = FAULTS[fault]
    install(here, "fault-inside", kind, f"fault_{list(FAULTS).index(fault)}", code)
    (here / "scene.toml").write_text(scene(kind))
    assert main(["run", "scene.toml", "-o", "out"]) == exit_code
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
    if exit_code == 2:
        assert "fault-inside 4.2" in said, said
        assert not (here / "out").exists()


def test_what_a_plugin_ends_leaves_nothing_written(tmp_path: Path) -> None:
    kind, code, exit_code, _ = FAULTS[KILLS]
    install(tmp_path, "fault-inside", kind, "fault_inside", code)
    (tmp_path / "scene.toml").write_text(scene(kind))
    done = command(tmp_path, "run", "scene.toml", "-o", "out")
    assert (done.returncode, done.stderr) == (exit_code, "")
    assert not (tmp_path / "out").exists()


def test_who_does_not_name_it_does_not_notice(tmp_path: Path) -> None:
    """Not even of what would end the process."""
    kind, code, _, _ = FAULTS[KILLS]
    install(tmp_path, "fault-inside", kind, "fault_inside", code)
    done = command(tmp_path, "run", str(ROOT / "examples" / "shock_bar.toml"), "-o", "out", "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    done = command(tmp_path, "list", "materials")
    assert done.returncode == 0
    assert "fault-inside 4.2" in done.stdout


def test_a_name_that_two_distributions_claim_is_used_from_neither(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = MATERIAL.format(changed=MODULI + LAW)
    install(here, "first-one", "material", "first_one", good)
    install(here, "second-one", "material", "second_one", good)
    (here / "scene.toml").write_text(scene("material"))
    assert main(["run", "scene.toml", "-o", "out"]) == 2
    said = capsys.readouterr().err
    assert "is claimed by" in said
    assert "first-one 4.2" in said
    assert "second-one 4.2" in said
