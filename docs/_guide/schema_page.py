"""The JSON schema of scenarios as a page: one table of keys for each kind of object."""

import json

from markdown import code, table, text

INTRODUCTION = """# Every key of a scenario

All keys of a scenario, from [scenarios/schema.json](../../scenarios/schema.json), which `maglev schema` prints. Editors
that support JSON Schema complete and explain the keys if the file begins with `"$schema": "schema.json"`. The page
[the scenario file](../scenario-file.md) explains how the parts work together.

An unknown key or a duplicate key is an error that names the key, its place and the nearest known key. **Bold** keys are
required.
"""


# In all objects alike, so described once.
REMARK = "$comment"
REMARKED = f"Every object may have a `{REMARK}` too, which is ignored.\n"


def page(path):
    schema = json.loads(path.read_text(encoding="utf-8"))
    whole = schema["$defs"].get("Scenario", schema)
    parts = [INTRODUCTION, REMARKED if REMARK in whole["properties"] else "", "## The scenario\n", keys(whole)]
    for name in ordered(whole, schema["$defs"]):
        definition = schema["$defs"][name]
        parts += [f"## {name}\n", text(definition.get("description", "")) + "\n", body(definition)]
    return "\n".join(part for part in parts if part)


def ordered(whole, definitions):
    """The definitions as the objects first name them, so that the page reads from the whole to its parts. Those of files
    that extend others are the same with nothing required, and are left out."""
    seen = []

    def visit(value):
        if isinstance(value, dict):
            name = value.get("$ref", "").removeprefix("#/$defs/")
            if name and name not in seen:
                seen.append(name)
                visit(definitions[name])
            for key, inner in value.items():
                if key not in ("$defs", "default"):
                    visit(inner)
        elif isinstance(value, list):
            for inner in value:
                visit(inner)

    visit({key: value for key, value in whole.items() if key != "$defs"})
    return [name for name in seen if not name.endswith("Patch") and name != "Scenario"]


def body(definition):
    if "properties" in definition:
        return keys(definition)
    choices = definition.get("oneOf") or definition.get("anyOf")
    if not choices:
        return kind(definition) + "\n"
    rows = [(code(json.dumps(c["const"])) if "const" in c else kind(c), text(c.get("description", ""))) for c in choices]
    return table(["Value", "Meaning"], rows)


def keys(definition):
    required = definition.get("required", [])
    rows = []
    for name, value in definition["properties"].items():
        if name == REMARK:
            continue
        key = f"**`{name}`**" if name in required else code(name)
        rows.append((key, kind(value), start(value, name in required), text(value.get("description", ""))))
    return table(["Key", "Type", "If left out", "Meaning"], rows)


def start(value, required):
    """What holds where a key is left out; objects say it for each of their own keys."""
    if required:
        return "not allowed"
    default = value.get("default")
    if default is None or default == "":
        return ""
    if isinstance(default, dict):
        return "its own defaults"
    return code(json.dumps(default))


def kind(value):
    """The type in words, with a link to the definition that it names."""
    if "$ref" in value:
        name = value["$ref"].removeprefix("#/$defs/")
        return f"[{name}](#{name.lower()})"
    if "const" in value:
        return code(json.dumps(value["const"]))
    for choice in ("anyOf", "oneOf"):
        if choice in value:
            return " or ".join(kind(v) for v in value[choice] if v.get("type") != "null")
    types = value.get("type", "anything")
    types = [t for t in ([types] if isinstance(types, str) else types) if t != "null"]
    return " or ".join(named(t, value) for t in types)


def named(name, value):
    if name == "array":
        return "list of " + kind(value["items"]) if "items" in value else "list"
    if name == "object":
        inner = value.get("additionalProperties")
        return "object of names to " + kind(inner) if isinstance(inner, dict) else "object"
    bounds = [sign + f"{value[key]:g}" for key, sign in BOUNDS.items() if key in value]
    words = {"string": "text", "boolean": "true or false", "integer": "whole number"}.get(name, name)
    return words + (" " + ", ".join(bounds) if bounds else "")


BOUNDS = {"minimum": "≥ ", "exclusiveMinimum": "> ", "maximum": "≤ ", "exclusiveMaximum": "< "}
