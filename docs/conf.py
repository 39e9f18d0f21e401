"""Sphinx: the pages here, and a reference made from the declarations of what a scene can name.

pip install -e ".[docs]"
python -m sphinx -W --keep-going -b html docs build/docs
"""

import sys
from importlib.metadata import version as installed
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import reference

project, author = "wsph", "The wsph developers"
version = release = installed("wsph")
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["practice.md", "conservation.md"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
html_theme = "alabaster"
html_theme_options = {
    "description": "solid mechanics by SPH on NVIDIA Warp",
    "fixed_sidebar": True,
    "page_width": "1100px",
}
html_copy_source = False


def setup(app: object) -> None:
    """The pages of the reference stand before the others are read."""
    reference.write(Path(__file__).parent / "reference")
