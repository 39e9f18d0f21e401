"""Distributions of plugins that a test makes and that this process sees while the test lasts."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from wsph.plugins import registry


def install(folder: Path, distribution: str, kind: str, module: str, code: str, version: str = "4.2") -> None:
    """A distribution as pip would leave it: its metadata, its entry point `broken`, its module."""
    for old in folder.glob(f"{distribution}-*.dist-info"):
        shutil.rmtree(old)
    info = folder / f"{distribution}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n")
    (info / "entry_points.txt").write_text(f"[wsph.{kind}s]\nbroken = {module}:Plugin\n")
    (folder / f"{module}.py").write_text(code)
    registry._entries.cache_clear()


def seen(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose distributions this process sees, and in which it stands."""
    monkeypatch.syspath_prepend(folder)
    monkeypatch.chdir(folder)
    registry._entries.cache_clear()
    yield folder
    registry._entries.cache_clear()
