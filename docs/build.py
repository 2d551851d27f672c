"""Builds the guide and checks it: `cargo xtask docs` runs this with the packages of docs/requirements.txt.

    python docs/build.py OUT

writes OUT/html/docs/index.html. Fails where a reference page is stale, a link, an anchor or a picture leads nowhere, a
page is in no list of index.md, or a page of the book would load something from the network.
"""

import re
import sys
from pathlib import Path

from sphinx.cmd.build import build_main

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs" / "_guide"))

import reference  # noqa: E402

# What a browser loads by itself; links that a reader may follow are not meant.
LOADED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\bsrc=["']?(?:https?:)?//[^>]*>"""
    r"""|<link\b[^>]*\brel=["']?(?:stylesheet|preload|preconnect|icon)[^>]*\bhref=["']?(?:https?:)?//[^>]*>"""
    r"""|(?:@import|url\()\s*["']?(?:https?:)?//[^)"']*""",
    re.IGNORECASE,
)


def loads_from_the_network(folder):
    """Places in the pages and style sheets of `folder` that make a browser ask the network."""
    for path in sorted(folder.rglob("*")):
        if path.suffix in (".html", ".css"):
            for found in LOADED.finditer(path.read_text(encoding="utf-8")):
                yield f"{path.relative_to(folder)}: {found[0]}"


def main(out):
    failed = reference.main(check=True, root=ROOT)
    html, doctrees = out / "html", out / "doctrees"
    # -W warnings are errors, -n every link must lead somewhere, -E nothing is kept from the last time
    options = ["-W", "-n", "-E", "-q", "--keep-going", "-j", "auto", "-d", str(doctrees), "-c", str(ROOT / "docs")]
    failed += build_main([*options, "-b", "html", str(ROOT), str(html)]) != 0
    for place in loads_from_the_network(html):
        print(f"error: the book would load something from the network: {place}", file=sys.stderr)
        failed += 1
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
