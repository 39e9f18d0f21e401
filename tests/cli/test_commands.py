"""The command line: exit codes, messages without traceback, nothing compiled or written for bad input."""

import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from wsph.catalogue import groups
from wsph.cli import main
from wsph.errors import SceneError
from wsph.parts.table import PARTS
from wsph.protocols import Traits
from wsph.scene.load import load

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "examples" / "shock_bar.toml"


def wsph(
    *arguments: str | Path, cwd: Path | None = None, cache: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    environment = {**os.environ, **({"WARP_CACHE_PATH": str(cache)} if cache else {})}
    return subprocess.run(
        [sys.executable, "-m", "wsph", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        env=environment,
    )


def test_run_check_and_list(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(SCENE), "-o", str(tmp_path / "out"), "--set", "cfl=0.5"]) == 0
    assert "completed: 400 steps" in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["scene"]["run"]["cfl"] == 0.5
    assert main(["run", str(SCENE), "-o", str(tmp_path / "quiet"), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert main(["check", str(SCENE)]) == 0
    text = capsys.readouterr().out
    for words in (
        "elastic (wsph ",
        "101, 400 pairs",
        "Courant number 1, limit 1.000",
        "tsph (wsph ",
        "5e-05 s, 200 steps",
        "half_step, impose, rate, impose",
        "bytes per particle",
    ):
        assert words in text, words
    assert main(["list", "materials", "--json"]) == 0
    assert {"elastic", "perzyna"} <= {row["name"] for row in json.loads(capsys.readouterr().out)}


def listed(group: str, capsys: pytest.CaptureFixture[str]) -> dict[str, dict[str, Any]]:
    """What `wsph list GROUP --json` prints, by name; formulations by name and sets."""
    assert main(["list", group, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert {row["group"] for row in rows} == {group}
    assert all(row["description"] for row in rows)
    return {f"{row['name']} {row['sets']}" if "sets" in row else row["name"]: row for row in rows}


def test_formulations_are_listed_with_their_traits_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    found = listed("formulations", capsys)
    assert {"stress-points 1", "updated-lagrangian 1", "updated-lagrangian 2", "small-strain 2"} <= set(found)
    for row in found.values():
        assert set(row["traits"]) == {each.name for each in dataclasses.fields(Traits)}
    assert "hourglass" not in found["stress-points 1"]["parts"]
    assert main(["list", "formulations"]) == 0
    text = capsys.readouterr().out
    for words in ("for integrators of 2 sets", "a material has to give a rate law", "support by default 1.5 spacings"):
        assert words in text, words


def test_every_trait_has_words() -> None:
    for name, said in groups.attribute_docstrings(Traits).items():
        assert len(said.split()) > 2, name


def test_parts_are_listed_with_the_formulations_that_take_them(capsys: pytest.CaptureFixture[str]) -> None:
    found = listed("parts", capsys)
    assert list(found) == list(PARTS)
    assert [each["name"] for each in found["hourglass"]["formulations"]] == ["total-lagrangian"]
    assert main(["list", "parts"]) == 0
    text = capsys.readouterr().out
    assert "Artificial viscosity: `alpha` linear" in text
    assert "taken by total-lagrangian (1 set); stress-points (1 set)" in text


def test_formats_kernels_and_shapes_are_those_that_a_scene_takes(capsys: pytest.CaptureFixture[str]) -> None:
    assert listed("formats", capsys)["vtu"]["files"] == ["frames/*.vtu", "frames.pvd"]
    assert {"vtu", "xdmf", "npz"} <= set(listed("formats", capsys))
    for kernel in listed("kernels", capsys):
        load(SCENE, {"run.kernel": kernel})
    with pytest.raises(SceneError) as error:
        load(SCENE, {"bodies.0.shape": {"type": "blob"}})
    found = listed("shapes", capsys)
    assert all(repr(name) in str(error.value) for name in found), str(error.value)
    assert found["cylinder"]["keys"] == ["from", "to", "radius", "rotate", "name"]
    for group in groups.GROUPS:
        assert main(["list", group]) == 0
        assert capsys.readouterr().out.count(f"\n{group[:-1]}") == len(listed(group, capsys)) - 1


def test_without_a_group_plugins_alone_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "--json"]) == 0
    assert {row["group"] for row in json.loads(capsys.readouterr().out)} == {"integrators", "materials"}


def test_no_list_imports_a_plugin_and_plugins_are_listed_without_warp() -> None:
    """And the help comes without what computes."""
    code = (
        "import sys; from contextlib import suppress; from wsph.cli import main; from wsph.catalogue import groups\n"
        "with suppress(SystemExit): main(['--help'])\n"
        "assert not {'numpy', 'pydantic', 'warp'} & set(sys.modules);"
        "main(['list']); assert 'warp' not in sys.modules;"
        "assert not any(main(['list', group]) for group in groups.GROUPS);"
        "sys.exit(any(m.startswith(('wsph_integrators', 'wsph_materials')) for m in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_an_unstable_run_exits_3_and_keeps_its_output(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [
        "run",
        str(SCENE),
        "-o",
        str(tmp_path / "out"),
        "--set",
        "cfl=1.2",
        "--set",
        "run.guard=off",
        "--set",
        "run.end=50 ms",
    ]
    assert main(arguments) == 3
    assert "error: found unstable at step" in capsys.readouterr().err
    assert (tmp_path / "out" / "frames.pvd").exists()


BAD = {
    "unknown model": (["--set", "bodies.0.material.model=elastc"], "bodies.0.material.model: no entry named 'elastc'"),
    "misspelt key": (["--set", "bodies.0.spcing=0.01"], "bodies.0.spcing: unknown key; did you mean 'spacing'?"),
    "negative density": (
        ["--set", "bodies.0.material.density=-1"],
        "bodies.0.material.density: -1 must be above 0 kg/m3",
    ),
    "beyond the limit": (["--set", "cfl=1.01"], "limit 1.000"),
    "bad override": (["--set", "cfl"], "--set cfl: write it as KEY=VALUE"),
}


@pytest.mark.parametrize("case", list(BAD))
def test_bad_input_exits_2_with_one_message_and_writes_nothing(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, message = BAD[case]
    assert main(["run", str(SCENE), "-o", str(tmp_path / "out"), *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.strip().splitlines()) == 1
    assert "Traceback" not in error
    assert list(tmp_path.iterdir()) == []


def test_bad_input_compiles_no_kernel(tmp_path: Path) -> None:
    both = tmp_path / "both.toml"
    line = SCENE.read_text().splitlines().index("[run]") + 1
    both.write_text(SCENE.read_text().replace("cfl = 1.0", 'cfl = 1.0\ndt = "1 us"'))
    cases = [
        (["run", both], f"line {line}: run: exactly one of cfl and dt is needed: both are given"),
        (["run", SCENE, "--set", "bodies.0.material.model=elastc"], "no entry named 'elastc'"),
        (["run", tmp_path / "missing.toml"], "no such file"),
        (["run", SCENE, "-o", "/dev/null/out"], "/dev/null/out"),
        (["check", SCENE, "--set", "bodies.0.material.density=-1"], "must be above 0"),
    ]
    for arguments, message in cases:
        done = wsph(*arguments, cwd=tmp_path, cache=tmp_path / "cache")
        assert done.returncode == 2, done.stderr
        assert message in done.stderr
        assert "Traceback" not in done.stderr
        assert not list((tmp_path / "cache").rglob("*.o"))
        assert sorted(p.name for p in tmp_path.iterdir() if p.name != "cache") == ["both.toml"]


def test_the_output_is_quiet_in_a_log(tmp_path: Path) -> None:
    done = wsph("run", SCENE, "-o", tmp_path / "out")
    assert done.returncode == 0
    assert done.stdout.count("\n") == 1
    assert "\x1b" not in done.stdout + done.stderr
    assert done.stderr == ""
