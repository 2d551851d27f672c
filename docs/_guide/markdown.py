"""Pieces of Markdown."""


def table(head, rows):
    """A table; the texts of its cells must be Markdown already."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines) + "\n"


def code(value):
    return f"`{value}`" if value not in ("", None) else ""


def text(words):
    """Plain words as Markdown on one line, with code kept as it is."""
    words = " ".join(words.split())
    parts = words.split("`")
    parts[::2] = [escaped(part) for part in parts[::2]]
    return "`".join(parts)


def escaped(part):
    for sign in "\\*_<>|[]$":
        part = part.replace(sign, "\\" + sign)
    return part
