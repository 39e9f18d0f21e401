"""The site: `sphinx-build -W docs OUT`, offline, with the packages of the extra `docs`.

Pages are MyST. Reference pages are made from declarations by `declared.py`, the gallery from the examples and the pictures
of `pictures.py` by `scenes.py`, both beside this file and before anything is read.
"""

import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "wsph"
author = "The wsph developers"
copyright = author
release = metadata.version("wsph")
version = release

extensions = ["myst_parser", "equations", "sphinx_gallery.gen_gallery", "declared", "scenes"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
exclude_patterns = ["_build", "paper", "scripts", "gallery/**/*.ipynb"]
suppress_warnings = ["config.cache"]

html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"wsph {release}"
html_extra_path = ["reference/made/schema"]
html_show_sourcelink = False
pygments_style = "default"

sphinx_gallery_conf = {
    "examples_dirs": "scripts",  # written by `scenes` from examples/ and pictures.py
    "gallery_dirs": "gallery",
    "filename_pattern": r"^$",  # pictures are there: docs/pictures.py makes them
    "within_subsection_order": "scenes.Ordered",
    "image_scrapers": (),
    "reset_modules": (),
    "remove_config_comments": True,
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
}
