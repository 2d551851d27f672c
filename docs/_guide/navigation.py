"""The navigation is index.md's own lists of links: each section becomes a part of it, with the same words
and order.

So the first page reads well on GitHub, where a `toctree` is a block of code, and nothing is listed twice.
A page that index.md does not link is in no toctree, which Sphinx warns of.
"""

import re

SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
PAGE = re.compile(r"^\s*- \[([^\]]+)\]\(([^)#]+)\.md\)", re.MULTILINE)


def toctrees(text):
    """One hidden toctree for each section of `text` that lists pages."""
    parts = SECTION.split(text)[1:]
    for caption, content in zip(parts[::2], parts[1::2]):
        pages = [f"{title.replace('`', '')} <{page}>" for title, page in PAGE.findall(content)]
        if pages:
            yield "\n".join(["```{toctree}", ":hidden:", f":caption: {caption.strip()}", "", *pages, "```"])


def add(app, docname, source):
    if docname == app.config.root_doc:
        source[0] += "\n" + "\n\n".join(toctrees(source[0])) + "\n"


def setup(app):
    app.connect("source-read", add)
    return {"parallel_read_safe": True}
