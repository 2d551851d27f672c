"""The JSON schema of a kind of file as a page: one table of keys for each kind of object."""

import json
from typing import NamedTuple

from markdown import code, table, text


class File(NamedTuple):
    """A kind of file. `schema` is its path from the root, `sections` the definitions with which the page begins and their
    headings; None is the schema itself. `hidden` definitions are
    other forms of those that are shown."""

    schema: str
    introduction: str
    sections: list
    hidden: tuple = ()


SCENARIO = File(
    "scenarios/schema.json",
    """# Every key of a scenario

All keys of a scenario, from [scenarios/schema.json](../../scenarios/schema.json), which `maglev schema` prints. Editors
that support JSON Schema complete and explain the keys if the file begins with `"$schema": "schema.json"`. The page
[the scenario file](../scenario-file.md) explains how the parts work together.

An unknown key or a duplicate key is an error that names the key, its place and the nearest known key. **Bold** keys are
required.
""",
    [("Scenario", "The scenario")],
)

VEHICLE = File(
    "fmu-vehicle/resources/schema.json",
    """# Every key of a vehicle file

All keys of `vehicle.json`, the layout in the resources of the unit [vehicle](../units/vehicle.md), from
[its schema](../../fmu-vehicle/resources/schema.json), which `maglev schema vehicle` prints. Editors that support JSON Schema
complete and explain the keys if the file begins with `"$schema": "schema.json"`. `maglev derive` makes a unit of a file and checks
it; a [scenario](../scenario-file.md#another-layout) does that for one run.

A file describes a train in a few numbers (`train`), or all bodies, joints and elements. Beside `train`, the other keys change what
the train expands to: lists of named items by name, with a list or with an object whose keys are names.

An unknown key or a duplicate key is an error that names its place and the nearest known key. **Bold** keys are required, without
`train`.
""",
    [("Train", "A train in a few numbers"), ("Vehicle", "The whole vehicle")],
    ("TrainWithChanges",),
)

GUIDEWAY = File(
    "fmu-guideway/resources/schema.json",
    """# Every key of a guideway file

All keys of `guideway.json`, the layout in the resources of the unit [guideway](../units/guideway.md), from
[its schema](../../fmu-guideway/resources/schema.json), which `maglev schema guideway` prints. Editors that support JSON Schema
complete and explain the keys if the file begins with `"$schema": "schema.json"`. `maglev derive` makes a unit of a file and checks
it; a [scenario](../scenario-file.md#another-layout) does that for one run.

An unknown key or a duplicate key is an error that names its place and the nearest known key. **Bold** keys are required.
""",
    [(None, "The guideway")],
)

LINE = File(
    "fmu-vehicle/resources/line-schema.json",
    """# Every key of a line file

All keys of `line.json`, the line of a track with curves, crests and cant, a resource of the unit [vehicle](../units/vehicle.md),
from [its schema](../../fmu-vehicle/resources/line-schema.json), which `maglev schema line` prints. Editors that support JSON Schema
complete and explain the keys if the file begins with `"$schema": "schema.json"`. The page
[how does the train run through a curve?](../curves.md) explains how they work.

An unknown key or a duplicate key is an error that names its place and the nearest known key. **Bold** keys are required.
""",
    [(None, "The line")],
)

CRITERIA = File(
    "criteria/schema.json",
    """# Every key of a criteria file

All keys of the files by which `maglev check` judges runs, from [criteria/schema.json](../../criteria/schema.json), which
`maglev schema criteria` prints. The entries of `objectives` and `limits` in a scenario have the same keys. Editors that support
JSON Schema complete and explain the keys if the file begins with `"$schema": "schema.json"`. The page
[does my design keep its limits?](../criteria.md) explains how they work.

An unknown key or a duplicate key is an error that names its place and the nearest known key. **Bold** keys are required.
""",
    [(None, "The file")],
)

STUDY = File(
    "examples/studies/schema.json",
    """# Every key of a study file

All keys of the files of `maglev study`, from [examples/studies/schema.json](../../examples/studies/schema.json), which
`maglev schema study` prints. Editors that support JSON Schema complete and explain the keys if the file begins with
`"$schema": "schema.json"`. The page [how do I compute many variants?](../studies.md) explains how they work.

`scenario` and `factors` are required, unless the file `extends` one that has them. An unknown key or a duplicate key is an error
that names its place and the nearest known key. **Bold** keys are required.
""",
    [(None, "The file")],
)

# In all objects alike, so described once.
REMARK = "$comment"
REMARKED = f"Every object may have a `{REMARK}` too, which is ignored.\n"


def page(root, file):
    schema = json.loads((root / file.schema).read_text(encoding="utf-8"))
    definitions = schema["$defs"]
    wholes = [(definitions[name] if name else schema, heading) for name, heading in file.sections]
    remarked = any(REMARK in whole["properties"] for whole, _ in wholes)
    parts = [file.introduction, REMARKED if remarked else ""]
    for whole, heading in wholes:
        parts += [f"## {heading}\n", keys(whole)]
    for name in ordered([whole for whole, _ in wholes], definitions):
        if name in file.hidden or name in [section for section, _ in file.sections]:
            continue
        parts += [f"## {name}\n", text(definitions[name].get("description", "")) + "\n", body(definitions[name])]
    return "\n".join(part for part in parts if part)


def ordered(wholes, definitions):
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

    for whole in wholes:
        visit({key: value for key, value in whole.items() if key != "$defs"})
    return [name for name in seen if not name.endswith("Patch")]


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
    if name == "object" and value.get("properties"):
        return "object with " + ", ".join(f"`{key}`: {kind(inner)}" for key, inner in value["properties"].items() if key != REMARK)
    if name == "object":
        inner = value.get("additionalProperties")
        return "object of names to " + kind(inner) if isinstance(inner, dict) else "object"
    bounds = [sign + f"{value[key]:g}" for key, sign in BOUNDS.items() if key in value]
    words = {"string": "text", "boolean": "true or false", "integer": "whole number"}.get(name, name)
    return words + (" " + ", ".join(bounds) if bounds else "")


BOUNDS = {"minimum": "≥ ", "exclusiveMinimum": "> ", "maximum": "≤ ", "exclusiveMaximum": "< "}
