"""The registry: lists without importing, names what is broken, and blames the right distribution."""

import subprocess
import sys
from importlib import metadata

import pytest

from wsph.errors import PluginError
from wsph.plugins import registry


class Distribution(metadata.Distribution):
    """A distribution with entry points and no files."""

    def __init__(self, name: str):
        self._name = name

    @property
    def metadata(self) -> dict[str, str]:
        return {"Name": self._name, "Version": "9.1"}

    @property
    def version(self) -> str:
        return "9.1"

    def read_text(self, filename: str) -> None:
        return None

    def locate_file(self, path: str) -> str:
        return path


def installed(*points: tuple[str, str, str]):
    """An `entry_points` that returns (name, target, distribution) triples."""
    found = [
        metadata.EntryPoint(name, target, "wsph.materials")._for(Distribution(dist)) for name, target, dist in points
    ]
    return lambda group: metadata.EntryPoints(p for p in found if p.group == group)


def test_an_unknown_name_gets_the_nearest_one_and_the_list() -> None:
    with pytest.raises(
        PluginError, match=r"no entry named 'elastc' in wsph.materials; did you mean 'elastic'\? Installed: .*perzyna"
    ):
        registry.find("materials", "elastc")


def test_a_broken_plugin_is_listed_and_blamed_only_when_named() -> None:
    points = installed(
        ("bad", "wsph_no_such_module:Bad", "broken-dist"), ("good", "wsph_materials.elastic:Elastic", "good-dist")
    )
    assert [e.name for e in registry.entries("materials", points)] == ["bad", "good"]
    assert registry.load("materials", "good", points).__name__ == "Elastic"
    with pytest.raises(PluginError, match=r"'bad' .*from broken-dist 9.1.* cannot be imported: ModuleNotFoundError"):
        registry.load("materials", "bad", points)


def test_a_name_claimed_twice_names_both_distributions() -> None:
    points = installed(
        ("elastic", "a:A", "first"), ("elastic", "b:B", "second"), ("other", "wsph_materials.elastic:Elastic", "first")
    )
    assert {e.status for e in registry.entries("materials", points) if e.name == "elastic"} == {
        "duplicate: also in first (a:A)",
        "duplicate: also in second (b:B)",
    }
    with pytest.raises(PluginError, match="claimed by first 9.1 .*second 9.1"):
        registry.load("materials", "elastic", points)
    assert registry.load("materials", "other", points).__name__ == "Elastic"


def test_an_entry_that_is_no_class_is_refused() -> None:
    with pytest.raises(PluginError, match="is not a class"):
        registry.load("materials", "pi", installed(("pi", "math:pi", "d")))


def test_listing_imports_no_plugin() -> None:
    code = "import sys; from wsph.cli import main; main(['list']); sys.exit(any(m.startswith(('wsph_integrators', 'wsph_materials')) for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False, capture_output=True).returncode == 0


def test_the_description_and_a_missing_module_are_told_without_importing() -> None:
    points = installed(
        ("elastic", "wsph_materials.elastic:Elastic", "d"),
        ("gone", "wsph_materials.gone:G", "d"),
        ("no", "nope.x:Y", "d"),
    )
    found = {entry.name: entry for entry in registry.described("materials", points)}
    assert found["elastic"].description.startswith("stress rate = lambda tr(D) I + 2 mu D")
    assert found["gone"].status == "broken: there is no module wsph_materials.gone"
    assert found["no"].status == "broken: there is no module nope.x"
