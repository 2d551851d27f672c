"""Equations as MathML, which browsers draw by themselves: no script, no font, no network.

docutils has the converter; Sphinx alone offers scripts or pictures made by LaTeX.
"""

import re

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

LOG = logging.getLogger(__name__)

# docutils 0.22 takes the index of an accented letter, `\ddot q_n`, for a limit and sets it below.
ACCENTED = re.compile(r'<munderover>\s*(<mi>.*?</mi>)\s*(.*?)\s*(<mo stretchy="false">[¨˙ˆ˜¯]</mo>)\s*</munderover>', re.DOTALL)


def convert(self, node, block):
    try:
        mathml = tex2mathml(node.astext(), as_block=block)
        self.body.append(ACCENTED.sub(r'<msub><mover accent="true">\1\3</mover>\2</msub>', mathml))
    except MathError as error:
        LOG.warning("the equation %s: %s", node.astext(), error, location=node)
    raise nodes.SkipNode


def inline(self, node):
    convert(self, node, block=False)


def displayed(self, node):
    convert(self, node, block=True)


def setup(app):
    app.add_html_math_renderer("mathml", (inline, None), (displayed, None))
    return {"parallel_read_safe": True}
