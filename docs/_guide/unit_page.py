"""A kind of unit as a page: capabilities, all variables in families, and how its layouts differ."""

import re
import xml.etree.ElementTree as ET

from markdown import code, table, text

CAUSALITIES = {
    "input": "Inputs",
    "output": "Outputs",
    "parameter": "Parameters",
    "calculatedParameter": "Calculated parameters",
    "local": "Constants and local variables",
}

CAPABILITIES = {
    "canHandleVariableCommunicationStepSize": "communication steps of any size",
    "canInterpolateInputs": "derivatives of inputs are taken (`fmi2SetRealInputDerivatives`)",
    "maxOutputDerivativeOrder": "highest derivative of outputs that is given (`fmi2GetRealOutputDerivatives`)",
    "canRunAsynchronuously": "steps that go on after `fmi2DoStep` has returned",
    "canBeInstantiatedOnlyOncePerProcess": "only one instance in a process",
    "canNotUseMemoryManagementFunctions": "the importer's functions for memory are not used",
    "canGetAndSetFMUstate": "states can be saved and put back",
    "canSerializeFMUstate": "states can be written as bytes",
    "providesDirectionalDerivative": "directional derivatives",
    "needsExecutionTool": "another program is needed",
}


LAYOUTS = (
    "The same library with other data. What is not here is as above. 64× counts the members of a family; values are "
    "start values.\n"
)


class Family:
    """Variables whose names differ in their numbers only."""

    def __init__(self, variable):
        self.variables = [variable]
        self.causality = variable.get("causality", "local")
        kind = variable[0]
        self.kind = kind.tag + (", tunable" if variable.get("variability") == "tunable" else "")
        self.start, self.unit = kind.get("start", ""), kind.get("unit", "")
        low, high = kind.get("min"), kind.get("max")
        self.range = "" if low is None and high is None else f"{short(low) or '−∞'} … {short(high) or '∞'}"

    def key(self):
        """What the members share; a first value of its own makes a row of its own."""
        return stem(self.variables[0].get("name")), self.causality, self.kind, self.unit, self.range

    def name(self):
        first, last = self.variables[0].get("name"), self.variables[-1].get("name")
        return code(first) if first == last else f"{code(first)} … {code(last)}"

    def starts(self):
        """The start values of all members; where they are all alike, one."""
        values = [short(v[0].get("start", "")) for v in self.variables]
        return values[0] if len(set(values)) == 1 else ", ".join(values)

    def count(self):
        """How many members a family has; nothing for a variable without a number."""
        return f"{len(self.variables)}×" if "#" in self.key()[0] else ""

    def brief_starts(self):
        values = self.starts().split(", ")
        return f"{float(values[0]):.4g} … {float(values[-1]):.4g}" if len(values) > 3 else ", ".join(values)

    def description(self):
        return text(common([v.get("description", "") for v in self.variables]))

    def row(self):
        return self.name(), self.kind, self.starts(), exponents(self.unit), self.range, self.description()


def stem(name):
    return re.sub(r"\d+", "#", name)


def short(number):
    """A number as people write it; other texts as they are."""
    try:
        return f"{float(number):.12g}" if re.search(r"\d", number or "") else number
    except ValueError:
        return number


def common(descriptions):
    """One description for all: numbers that differ between them become k."""
    parts = [re.split(r"(\d+)", words) for words in descriptions]
    if len({tuple(p[::2]) for p in parts}) > 1:
        return descriptions[0]
    first = parts[0]
    varying = [len({p[i] for p in parts}) > 1 for i in range(len(first))]
    return "".join("k" if vary else part for part, vary in zip(first, varying))


def exponents(unit):
    return re.sub(r"(?<=[a-z])([23])", lambda m: {"2": "²", "3": "³"}[m[1]], unit).replace(".", "·")


def families(description):
    found = {}
    for variable in description.find("ModelVariables"):
        family = Family(variable)
        if family.key() in found:
            found[family.key()].variables.append(variable)
        else:
            found[family.key()] = family
    return list(found.values())


def page(kind, paths):
    layouts = {path.stem: ET.parse(path).getroot() for path in paths}
    main = layouts[kind]
    parts = [
        f"# Variables of `{kind}`\n",
        text(main.get("description")) + "\n",
        f"What it computes is told in [the page on the unit](../units/{kind}.md). `maglev inspect target/fmu/{kind}.fmu` "
        "prints the same from the unit itself.\n",
        "A row with two names stands for a family, such as `gap_01`, `gap_02`, … with *k* as its number. "
        "*Tunable* parameters may be changed between steps, the others before the start only.\n"
        if len(layouts) > 1
        else "*Tunable* parameters may be changed between steps, the others before the start only.\n",
    ]
    all_families = families(main)
    for causality, title in CAUSALITIES.items():
        rows = [family.row() for family in all_families if family.causality == causality]
        if rows:
            parts += [f"## {title}\n", table(["Name", "Type", "Start", "Unit", "Range", "Meaning"], rows)]
    if len(layouts) > 1:
        parts += ["## Layouts\n", LAYOUTS, layout_table(layouts)]
    parts += ["## Capabilities\n", capabilities(main)]
    return "\n".join(parts)


def layout_table(layouts):
    """One column for each layout; rows are what they differ in: how many variables, and their start values."""
    known = {name: {stem(f.variables[0].get("name")): f for f in families(d)} for name, d in layouts.items()}
    rows = [("variables", *(len(d.find("ModelVariables")) for d in layouts.values()))]
    for key in dict.fromkeys(key for own in known.values() for key in own):
        found = [known[name].get(key) for name in layouts]
        alike = len({f.brief_starts() for f in found if f}) == 1
        cells = [" ".join([f.count(), "" if alike else f.brief_starts()]).strip() if f else "–" for f in found]
        if len(set(cells)) > 1:
            rows.append((code(re.sub("#", "K", re.sub("#$", "NN", key))), *cells))
    return table(["", *(code(f"{name}.fmu") for name in layouts)], rows)


def capabilities(description):
    element = description.find("CoSimulation")
    experiment = description.find("DefaultExperiment")
    rows = [(code(name), element.get(name, ""), meaning) for name, meaning in CAPABILITIES.items()]
    return (
        f"FMI {description.get('fmiVersion')} for co-simulation. Default experiment: "
        f"{short(experiment.get('startTime'))} to {short(experiment.get('stopTime'))} s in steps of "
        f"{short(experiment.get('stepSize'))} s.\n\n" + table(["Attribute", "Value", "Meaning"], rows)
    )
