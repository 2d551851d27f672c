"""What is generated in the guide: docs/reference/*.md from the schemas of files and modelDescription/*.xml, and the
passages of other pages that are copies of a file,

    <!-- copy of examples/levitate_mass.c -->
    ...
    <!-- end of copy -->

so that each page can be read on GitHub and nothing is written twice by hand.

    python3 docs/_guide/reference.py [--check]

With --check nothing is changed, and a stale page is an error. `cargo xtask codegen` and `cargo xtask docs` call it.
Python's own library is all that it needs.
"""

import re
import sys
from pathlib import Path

import schema_page
import unit_page

ROOT = Path(__file__).resolve().parents[2]
COPY = re.compile(r"<!-- copy of (\S+) -->\n.*?<!-- end of copy -->", re.DOTALL)
LANGUAGES = {".c": "c", ".json": "json", ".py": "python", ".rs": "rust", ".lua": "lua"}
HEAD = "<!-- Made by `cargo xtask codegen` from {}; do not edit. -->\n\n"


def pages(root):
    """File name and content of each reference page."""
    files = {"scenario": schema_page.SCENARIO, "criteria-file": schema_page.CRITERIA, "study-file": schema_page.STUDY, "vehicle-file": schema_page.VEHICLE, "guideway-file": schema_page.GUIDEWAY, "line-file": schema_page.LINE}
    for name, file in files.items():
        yield f"{name}.md", HEAD.format(file.schema) + schema_page.page(root, file)
    descriptions = sorted((root / "modelDescription").glob("*.xml"))
    kinds = sorted({re.split("[-.]", path.name)[0] for path in descriptions})
    for kind in kinds:
        layouts = [path for path in descriptions if re.split("[-.]", path.name)[0] == kind]
        layouts.sort(key=lambda path: (path.stem != kind, path.stem))
        yield f"{kind}.md", HEAD.format(f"modelDescription/{kind}*.xml") + unit_page.page(kind, layouts)


def copies(root):
    """The pages with copied passages, with these as they should be."""
    for path in sorted((root / "docs").rglob("*.md")):
        old = path.read_text(encoding="utf-8")
        if COPY.search(old):
            yield path.relative_to(root / "docs").as_posix(), COPY.sub(lambda found: copied(root, found[1]), old)


def copied(root, name):
    """A passage made of a file: Markdown as it is, with its pictures found from docs/*/; other files as code."""
    text = (root / name).read_text(encoding="utf-8").strip("\n")
    if name.endswith(".md"):
        folder = Path("..", "..", name).parent.as_posix()
        text = re.sub(r"(!\[[^\]]*\]\()", lambda found: f"{found[1]}{folder}/", text)
    else:
        text = f"```{LANGUAGES[Path(name).suffix]}\n{text}\n```"
    return f"<!-- copy of {name} -->\n{text}\n<!-- end of copy -->"


def main(check, root=ROOT):
    """Writes what is generated, or with `check` returns how many pages are stale."""
    docs = root / "docs"
    wanted = {f"reference/{name}": text for name, text in pages(root)} | dict(copies(root))
    present = {f"reference/{path.name}" for path in (docs / "reference").glob("*.md")}
    stale = sorted(present - wanted.keys()) + [name for name in wanted if not same(docs / name, wanted[name])]
    for name in stale:
        if check:
            print(f"error: docs/{name} is stale: run `cargo xtask codegen` and commit", file=sys.stderr)
        elif name in wanted:
            (docs / name).write_text(wanted[name], encoding="utf-8")
            print(f"wrote docs/{name}", file=sys.stderr)
        else:
            (docs / name).unlink()
            print(f"removed docs/{name}", file=sys.stderr)
    return len(stale) if check else 0


def same(path, text):
    return path.exists() and path.read_text(encoding="utf-8") == text


if __name__ == "__main__":
    sys.exit(1 if main("--check" in sys.argv[1:]) else 0)
