"""Files: every fault with its line, what is no scene named."""

from pathlib import Path

import pytest

import wsph
from wsph.errors import SceneError

TEXT = (Path(__file__).resolve().parents[2] / "examples" / "shock_bar.toml").read_text()


def test_all_faults_at_once_with_their_lines(tmp_path: Path) -> None:
    text = (
        TEXT.replace('model = "elastic"', 'model = "elastc"')
        .replace("cfl = 1.0", 'cfl = 1.0\ndt = "1 us"')
        .replace("spacing = 0.01", "spcing = 0.01")
    )
    text = text.replace('name = "middle"', 'nam = "middle"')
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        wsph.load(path)
    lines = str(caught.value).splitlines()
    expected = {
        "run": "both are given",
        "bodies.0.spacing": "is missing",
        "bodies.0.spcing": "did you mean 'spacing'",
        "bodies.0.material.model": "elastc",
        "probes.1.nam": "unknown key",
        "probes.1.name": "is missing",
    }
    assert len(lines) == len(expected), lines
    for key, words in expected.items():
        line = next(entry for entry in lines if f" {key}: " in entry)
        assert line.startswith(f"{path}: line ")
        assert words in line
    number = int(next(entry for entry in lines if "bodies.0.spcing" in entry).split("line ")[1].split(":")[0])
    assert text.splitlines()[number - 1].startswith("spcing")
    number = int(next(entry for entry in lines if "probes.1.nam:" in entry).split("line ")[1].split(":")[0])
    assert text.splitlines()[number - 1].startswith("nam")


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "no such file"), ("a = = 1", "is not TOML"), (b"\xff\xfe", "cannot be read"), ("", "schema: is missing")],
)
def test_files_that_are_no_scene(tmp_path: Path, content: str | bytes | None, message: str) -> None:
    path = tmp_path / "scene.toml"
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(SceneError, match=message) as caught:
        wsph.load(path)
    assert str(path) in str(caught.value)


def test_lines_are_right_beside_brackets_in_strings_and_comments(tmp_path: Path) -> None:
    text = TEXT.replace("title = ", 'title = "Shock [wave" # see [1\n# was ').replace(
        "density = 2000.0", "density = -1"
    )
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        wsph.load(path)
    line = caught.value.faults[0].line
    assert text.splitlines()[line - 1] == "density = -1"


def test_faults_found_in_the_set_up_have_their_line_too(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(TEXT.replace("at = [[0.5]]", "at = [[5.0]]"))
    with pytest.raises(SceneError, match=r"scene.toml: line \d+: probes.1.at: \[\[5.0\]\] does not lie in one body"):
        wsph.run(wsph.load(path))
