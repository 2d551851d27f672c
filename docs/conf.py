"""The guide as HTML: `cargo xtask docs`. The source folder is the repository, so that links between these pages,
the READMEs and the files beside them are the same on GitHub and in the book, and are all checked."""

import sys
from pathlib import Path

from pygments.lexers.special import TextLexer

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_guide"))

project = "Maglev co-simulation"
author = "The maglev co-simulation developers"
language = "en"
root_doc = "docs/index"
include_patterns = [
    "docs/**",
    "README.md",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "examples/README.md",
    "examples/*/README.md",
    "examples/*/*/README.md",
    "fmu-*/README.md",
    "master/README.md",
    "tests/README.md",
    "crates/*/README.md",
    "crates/*/assets/vendor/README.md",
]
exclude_patterns = ["target", "target-*", "fuzz", "results", ".git", "**/.*"]

extensions = ["myst_parser", "navigation", "links", "mathml"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
# blocks of csv and of Rust that only compiles have no colours
suppress_warnings = ["misc.highlighting_failure"]
html_math_renderer = "mathml"

html_theme = "furo"
html_title = "Maglev co-simulation"
html_baseurl = ""
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["guide.css"]
templates_path = ["_guide/templates"]
html_additional_pages = {"index": "redirect.html"}


def setup(app):
    # GitHub draws these diagrams; the book shows their text, for drawing them takes a megabyte of script.
    app.add_lexer("mermaid", TextLexer)
