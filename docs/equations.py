"""Equations as MathML, which browsers draw by themselves: pages are read without a network, and no program is loaded."""

# pyright: strict

from typing import TYPE_CHECKING

from docutils import nodes
from latex2mathml.converter import convert

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator


def _inline(self: "HTML5Translator", node: nodes.Element) -> None:
    self.body.append(convert(node.astext(), display="inline"))
    raise nodes.SkipNode


def _block(self: "HTML5Translator", node: nodes.Element) -> None:
    text = " ".join(node.astext().split())
    self.body.append(f'<div class="math">{convert(text, display="block")}</div>\n')
    raise nodes.SkipNode


def setup(app: "Sphinx") -> dict[str, object]:
    """The renderer by its name, for `html_math_renderer`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
