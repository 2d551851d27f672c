"""Links mean the same here and on GitHub: folders lead to the README in them, anchors are GitHub's."""

from pathlib import Path

from sphinx import addnodes
from sphinx.transforms import SphinxTransform
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util import logging

LOG = logging.getLogger(__name__)


class Folders(SphinxTransform):
    """A link to a folder becomes one to its README, as GitHub shows it."""

    default_priority = 5

    def apply(self, **_kwargs):
        here = Path(self.env.doc2path(self.env.docname)).parent
        for link in self.document.findall(addnodes.pending_xref):
            page = here / link.get("reftarget", "") / "README.md"
            if link.get("reftype") == "myst" and page.exists():
                name = page.resolve().relative_to(Path(self.env.srcdir).resolve()).with_suffix("")
                link["refdomain"], link["reftarget"], link["reftargetid"] = "doc", name.as_posix(), None


class Anchors(SphinxPostTransform):
    """MyST also finds an anchor by the id that docutils gives it, which GitHub does not know."""

    default_priority = 8  # before MyST resolves links

    def run(self, **_kwargs):
        for link in self.document.findall(addnodes.pending_xref):
            if link.get("refdomain") == "doc":
                page, anchor = link["reftarget"], link.get("reftargetid")
            else:
                page, anchor = self.env.docname, link.get("reflocalid") and link["reftarget"]
            slugs = self.env.metadata.get(page, {}).get("myst_slugs", {})
            if anchor and page in self.env.all_docs and anchor not in slugs:
                LOG.warning("GitHub has no anchor #%s in %s.md", anchor, page, location=link)


def setup(app):
    app.add_transform(Folders)
    app.add_post_transform(Anchors)
    return {"parallel_read_safe": True}
