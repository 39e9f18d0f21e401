"""A notebook, executed without a screen: what its cells show of scenes, runs, results, pictures and views to turn."""

from pathlib import Path
from typing import Any

import pytest

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "oscillating_beam.toml"

CELLS = {
    "scene": f"import wsph\nscene = wsph.load({str(EXAMPLE)!r}).with_(end='10 us')\nscene",
    "result": "result = wsph.run(scene, progress=True)\nresult",
    "pandas": "result.to_pandas().tail(2)",
    "xarray": "result.to_xarray()",
    "picture": "result.plot('velocity_y')",
    "curve": "result.plot('energy')",
    "view": "result.interactive('velocity_y').show()",
    "still": "result.interactive('velocity_y').show(jupyter_backend='static')",
}

WIDGET = "application/vnd.jupyter.widget-view+json"


@pytest.fixture(scope="module")
def shown() -> dict[str, list[Any]]:
    """The outputs of each cell. Skipped by name without the extra `notebook` and something that executes notebooks."""
    for package in ("nbformat", "nbclient", "ipykernel", "ipywidgets", "pandas", "xarray", "trame_vtk"):
        pytest.importorskip(package)
    import nbclient
    import nbformat

    cells = [nbformat.v4.new_code_cell(text) for text in CELLS.values()]
    notebook = nbformat.v4.new_notebook(cells=cells)
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    return {name: cell.outputs for name, cell in zip(CELLS, notebook.cells, strict=True)}


def kinds(outputs: list[Any]) -> set[str]:
    """What the outputs can be shown as."""
    return {kind for each in outputs for kind in each.get("data", {})}


@pytest.mark.slow
def test_scenes_and_results_are_tables(shown: dict[str, list[Any]]) -> None:
    for name in ("scene", "result", "pandas", "xarray"):
        assert "text/html" in kinds(shown[name]), name
    assert "<table>" in shown["result"][-1]["data"]["text/html"]


@pytest.mark.slow
def test_a_run_has_a_bar_that_goes(shown: dict[str, list[Any]]) -> None:
    assert WIDGET in kinds(shown["result"])


@pytest.mark.slow
def test_pictures_and_curves_are_seen(shown: dict[str, list[Any]]) -> None:
    for name in ("picture", "curve", "still"):
        assert "image/png" in kinds(shown[name]), name


@pytest.mark.slow
def test_a_view_can_be_turned(shown: dict[str, list[Any]]) -> None:
    """A frame of the page that pyvista serves; where packages are missing a still picture and a warning stand there."""
    assert WIDGET in kinds(shown["view"])
    assert not [each for each in shown["view"] if each["output_type"] == "stream"]
    assert "iframe" in shown["view"][-1]["data"]["text/plain"]
