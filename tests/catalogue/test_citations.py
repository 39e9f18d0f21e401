"""References of the methods of a run: what their docstrings cite."""

import re
from pathlib import Path

import pytest

import wsph
from wsph.catalogue.citations import bibliography
from wsph.cli import main
from wsph.plugins.declared import references

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"


def keys(text: str) -> set[str]:
    return set(re.findall(r"@\w+\{(\w+),", text))


def test_a_run_is_cited_by_its_methods_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wsph.run(wsph.load(EXAMPLES / "shock_bar.toml"), tmp_path / "out")
    assert main(["cite", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    assert {"wsph", "warp", "herreros2011"} <= keys(text)
    assert not keys(text) & {"wilkins1964", "miehe2010", "belytschko1991", "verlet1967"}
    assert "% integrator tsph, formulation small-strain" in text


@pytest.mark.parametrize(
    ("scene", "cited"),
    [
        ("taylor_bar", {"wilkins1964", "verlet1967"}),
        ("kalthoff_winkler", {"miehe2010", "he2016"}),
        ("kalthoff_links", {"islam2019"}),
        ("shock_bar_ul", {"serroukh2022"}),
    ],
)
def test_scenes_are_cited_before_they_run(scene: str, cited: set[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cite", str(EXAMPLES / f"{scene}.toml")]) == 0
    assert cited <= keys(capsys.readouterr().out)


def test_every_example_is_cited() -> None:
    for path in EXAMPLES.glob("*.toml"):
        if not path.name.startswith("bracket"):
            assert "wsph" in keys(bibliography(wsph.load(path).data())), path.name


def test_a_plugin_brings_its_own() -> None:
    class Cited:
        references = "@misc{me, title={Mine}}"

    assert references(Cited) == ("@misc{me, title={Mine}}",)
    assert references(object) == ()


def test_what_is_no_run_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cite", str(tmp_path)]) == 2
    assert "has no summary.json of a run" in capsys.readouterr().err
