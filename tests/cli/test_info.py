"""What tells of the program itself: versions, devices, completion."""

import json
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from wsph.cli import main
from wsph.cli.commands.completion import script
from wsph.cli.entry import COMMANDS


def test_the_version_is_told_by_the_module_too() -> None:
    for module in ("wsph", "wsph.cli"):
        done = subprocess.run([sys.executable, "-m", module, "--version"], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout, done.stderr) == (0, f"wsph {version('wsph')}\n", "")


def test_info_tells_versions_devices_cores_and_caches(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["packages"]["wsph"] == version("wsph")
    assert "cpu" in found["devices"]
    assert "modules" in found["kernel cache"]
    assert main(["info"]) == 0
    assert "kernel cache" in capsys.readouterr().out


def completed(line: list[str], folder: Path) -> set[str]:
    """What bash completes a line to."""
    words = " ".join(f"'{word}'" for word in line)
    code = (
        f"{script('bash', COMMANDS)}\nCOMP_WORDS=({words}); COMP_CWORD={len(line) - 1}; _wsph; echo ${{COMPREPLY[@]}}"
    )
    done = subprocess.run(["bash", "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_a_shell_completes_commands_options_and_names(tmp_path: Path) -> None:
    assert {"run", "check", "list", "new"} <= completed(["wsph", ""], tmp_path)
    assert completed(["wsph", "st"], tmp_path) == {"study"}
    assert {"--resume", "--overwrite"} <= completed(["wsph", "run", "--"], tmp_path)
    assert {"mises"} == completed(["wsph", "list", "mis"], tmp_path)
    assert {"material"} == completed(["wsph", "new", "mat"], tmp_path)


def test_scripts_of_all_shells_name_all_commands() -> None:
    for shell in ("bash", "zsh", "fish"):
        text = script(shell, COMMANDS)
        assert all(command.name in text for command in COMMANDS)
