"""Units made of nothing but a description and a C file, and what `maglev validate` finds in them.

`SOUND` is a description with every element and attribute that the schema of FMI 2.0 knows. `variants` breaks
any description in many small ways, legal ones among them: what each is, the official schema decides.
"""

import copy
import json
import os
import subprocess
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fmpy
from lxml import etree

from conftest import MAGLEV

SCHEMA_FOLDER = Path(fmpy.__file__).parent / "schema" / "fmi2"
SCHEMA = etree.XMLSchema(file=str(SCHEMA_FOLDER / "fmi2ModelDescription.xsd"))

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
SOUND = HEAD + """<fmiModelDescription fmiVersion="2.0" modelName="sound" guid="{1}" description="d" author="a" version="1"
    copyright="c" license="l" generationTool="by hand" generationDateAndTime="2024-02-29T12:00:00Z"
    variableNamingConvention="structured" numberOfEventIndicators="0">
  <ModelExchange modelIdentifier="sound" needsExecutionTool="false" completedIntegratorStepNotNeeded="false"
      canBeInstantiatedOnlyOncePerProcess="false" canNotUseMemoryManagementFunctions="true"
      canGetAndSetFMUstate="true" canSerializeFMUstate="true" providesDirectionalDerivative="true">
    <SourceFiles><File name="sound.c"/></SourceFiles>
  </ModelExchange>
  <CoSimulation modelIdentifier="sound" needsExecutionTool="false" canHandleVariableCommunicationStepSize="true"
      canInterpolateInputs="true" maxOutputDerivativeOrder="1" canRunAsynchronuously="false"
      canBeInstantiatedOnlyOncePerProcess="false" canNotUseMemoryManagementFunctions="true"
      canGetAndSetFMUstate="true" canSerializeFMUstate="true" providesDirectionalDerivative="true">
    <SourceFiles><File name="sound.c"/><File name="more/part.c"/></SourceFiles>
  </CoSimulation>
  <UnitDefinitions>
    <Unit name="m"><BaseUnit kg="0" m="1" s="0" A="0" K="0" mol="0" cd="0" rad="0" factor="1" offset="0"/>
      <DisplayUnit name="mm" factor="1000" offset="0"/><DisplayUnit name="km" factor="0.001"/></Unit>
    <Unit name="s"><BaseUnit s="1"/></Unit>
    <Unit name="Euro/PersonYear"/>
  </UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Length" description="d"><Real quantity="Length" unit="m" displayUnit="mm"
      relativeQuantity="false" min="-100" max="100" nominal="1" unbounded="false"/></SimpleType>
    <SimpleType name="Count"><Integer quantity="Count" min="0" max="10"/></SimpleType>
    <SimpleType name="Flag"><Boolean/></SimpleType>
    <SimpleType name="Text"><String/></SimpleType>
    <SimpleType name="Gear"><Enumeration quantity="Gear"><Item name="low" value="1" description="d"/>
      <Item name="high" value="2"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <LogCategories><Category name="logAll" description="d"/><Category name="logEvents"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="10" tolerance="1e-6" stepSize="0.01"/>
  <VendorAnnotations><Tool name="hand"><anything may="be"><here/>and text</anything></Tool><Tool name="none"/></VendorAnnotations>
  <ModelVariables>
    <ScalarVariable name="time" valueReference="0" description="d" causality="independent" variability="continuous">
      <Real unit="s"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="1" causality="input" variability="continuous"
        canHandleMultipleSetPerTimeInstant="true"><Real declaredType="Length" start="0"/></ScalarVariable>
    <ScalarVariable name="x" valueReference="2" causality="local" variability="continuous" initial="exact">
      <Real declaredType="Length" quantity="Length" unit="m" displayUnit="mm" relativeQuantity="false" min="-50"
        max="50" nominal="2" unbounded="true" start="1" reinit="false"/>
      <Annotations><Tool name="hand"><menu/></Tool></Annotations></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="3" causality="local" variability="continuous" initial="calculated">
      <Real derivative="3"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="2" causality="output" variability="continuous"><Real unit="m"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="4" causality="parameter" variability="tunable" initial="exact">
      <Real start="1"/></ScalarVariable>
    <ScalarVariable name="q" valueReference="5" causality="calculatedParameter" variability="fixed"><Real/></ScalarVariable>
    <ScalarVariable name="n" valueReference="0" causality="parameter" variability="fixed">
      <Integer declaredType="Count" quantity="Count" min="0" max="5" start="3"/></ScalarVariable>
    <ScalarVariable name="b" valueReference="0" causality="input" variability="discrete">
      <Boolean declaredType="Flag" start="true"/></ScalarVariable>
    <ScalarVariable name="s" valueReference="0" causality="parameter" variability="fixed">
      <String declaredType="Text" start="words"/></ScalarVariable>
    <ScalarVariable name="g" valueReference="1" causality="output" variability="discrete" initial="exact">
      <Enumeration declaredType="Gear" quantity="Gear" min="1" max="2" start="1"/></ScalarVariable>
    <ScalarVariable name="c" valueReference="6" causality="local" variability="constant"><Real start="9.81"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="5" dependencies="3" dependenciesKind="constant"/><Unknown index="11"/></Outputs>
    <Derivatives><Unknown index="4" dependencies="2 3" dependenciesKind="fixed dependent"/></Derivatives>
    <InitialUnknowns>
      <Unknown index="4" dependencies="2 3" dependenciesKind="constant dependent"/>
      <Unknown index="5" dependencies="3"/>
      <Unknown index="7" dependencies="6"/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""

SOURCES = {"sources/sound.c": "int x;\n", "sources/more/part.c": "int y;\n", "documentation/index.html": "<p>none</p>"}


def pack(path, xml, files=None):
    """Packs a description, and files beside it, into an archive."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", xml)
        for name, content in (SOURCES if files is None else files).items():
            archive.writestr(name, content)
    return path


def findings(path):
    """What `maglev validate` finds: dictionaries with rule, severity and message."""
    done = subprocess.run([MAGLEV, "validate", "--json", path], capture_output=True, text=True, timeout=60)
    assert done.returncode in (0, 1), f"{path}: status {done.returncode}\n{done.stderr}"
    found = json.loads(done.stdout)
    assert done.returncode == any(it["severity"] == "error" for it in found), (path, found)
    return found


def errors(path):
    return [it for it in findings(path) if it["severity"] == "error"]


def each(function, cases):
    """The results of a function that waits for another process."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(function, cases))


def schema_types():
    """What the official schema says of attributes: {(element, attribute): type}."""
    space = "{http://www.w3.org/2001/XMLSchema}"
    groups, types = {}, {}
    trees = [etree.parse(str(file)) for file in sorted(SCHEMA_FOLDER.glob("*.xsd"))]

    def attributes(node):
        for child in node:
            if child.tag == space + "attribute":
                kind = child.get("type")
                if kind is None:
                    restriction = child.find(f".//{space}enumeration/..")
                    words = [it.get("value") for it in restriction] if restriction is not None else []
                    kind = ("list" if child.find(f".//{space}list") is not None else "enumeration", tuple(words))
                yield child.get("name"), kind
            elif child.tag == space + "attributeGroup":
                yield from groups[child.get("ref")]

    for tree in trees:
        for group in tree.findall(f"{space}attributeGroup"):
            groups[group.get("name")] = list(attributes(group))
    for tree in trees:
        named = {it.get("name"): it for it in tree.iter(f"{space}complexType") if it.get("name")}
        for element in tree.iter(f"{space}element"):
            content = element.find(f"{space}complexType")
            if content is not None:
                types.update({(element.get("name"), name): kind for name, kind in attributes(content)})
        elements = {"fmi2ScalarVariable": "ScalarVariable", "fmi2SimpleType": "SimpleType", "fmi2Unit": "Unit"}
        for name, content in named.items():
            if name in elements:
                types.update({(elements[name], it): kind for it, kind in attributes(content)})
    return types


NUMBERS = ["", " 1 ", "007", "+1", "-1", "-0", "1.5", "1e3", "1e", ".", "x", "1,5", "\u00a01", "&#9;1"]
VALUES = {
    "xs:double": [*NUMBERS, "INF", "-INF", "+INF", "NaN", "nan", "inf", "1e999"],
    "xs:int": [*NUMBERS, "2147483647", "2147483648", "-2147483648"],
    "xs:unsignedInt": [*NUMBERS, "4294967295", "4294967296"],
    "xs:boolean": ["true", " 1 ", "0", "True", "", "yes", "false&#10;"],
    "xs:normalizedString": ["", " ", "ä", "a&#10;b"],
    "xs:string": ["", " \u00a0", "a&#10;b"],
    "xs:dateTime": ["2024-13-45T00:00:00Z", "2023-02-29T00:00:00Z", "2024-02-29T24:00:00", "2024-04-31T00:00:00Z", "",
                    "2024-01-01T00:00:00.5+14:00", "2024-01-01T00:00:00+14:30", "2024-01-01", " 2024-01-01T00:00:00Z",
                    "2024-01-01T00:60:00Z", "12024-01-01T00:00:00Z", "0000-01-01T00:00:00Z"],
}


def values(kind):
    if isinstance(kind, str):
        return VALUES[kind]
    shape, words = kind
    if not words:
        return ["", " ", "1", " 1  2 ", "1 x", "-1", "+1", "1.0", "1&#10;2"]
    several = [" ".join(words), f" {words[0]}  {words[-1]}&#9;"] if shape == "list" else []
    return [*words, "", f" {words[0]}", f"{words[0]} ", f"&#9;{words[0]}", words[0].upper(), "other", *several]


INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
ODD_ATTRIBUTES = {
    "unknown": "1", "{urn:other}name": "1", "{http://www.w3.org/XML/1998/namespace}lang": "en",
    f"{{{INSTANCE}}}noNamespaceSchemaLocation": "fmi2ModelDescription.xsd", f"{{{INSTANCE}}}nil": "false",
}


def variants(text):
    """(what is changed, changed description) for each kind of element in a description."""
    types = schema_types()
    seen = set()
    tree = etree.fromstring(text.encode())
    for node in list(tree.iter(etree.Element)):
        path = tree.getroottree().getpath(node)
        place = tuple(part.split("[")[0] for part in path.split("/"))
        if "Tool" in place[:-1]:
            continue  # what a vendor writes is not the schema's

        def change(label, edit, kind=(), path=path, place=place):
            if (place, label, *kind) in seen:
                return None
            seen.add((place, label, *kind))
            document = etree.fromstring(text.encode())
            changed = document.getroottree().xpath(path)[0]
            edit(changed)
            content = etree.tostring(document, encoding="unicode").replace("@@", "&#")
            return f"{path} {label}", HEAD + content

        yield from filter(None, element_changes(node, change))
        for (element, name), kind in types.items():
            if element == node.tag:
                for value in values(kind):
                    # character references survive only by a detour
                    value = value.replace("&#", "@@")
                    yield from filter(None, [change(f"{name}={value!r}", lambda it: it.set(name, value))])
                yield from filter(None, [change(f"without {name}", lambda it: it.attrib.pop(name, None))])


def element_changes(node, change):
    """Changes of an element other than of its attributes."""
    def without(it):
        it.getparent().remove(it)

    def again(it):
        it.addnext(copy.deepcopy(it))

    def first(it):
        it.getparent().insert(0, it)

    def last(it):
        it.getparent().append(it)

    def renamed(it):
        it.tag = "Other"

    def spaced(it):
        it.tag = "{urn:other}" + it.tag

    def after(content):
        return lambda it: it.append(content())

    def with_text(content):
        def edit(it):
            it.text = content + (it.text or "")
        return edit

    for name, value in ODD_ATTRIBUTES.items():
        yield change(f"with {name}", lambda it: it.set(name, value))
    yield change("with text", with_text("text"))
    yield change("with a blank", with_text(" "))
    yield change("with a no-break space", with_text("\u00a0"))
    yield change("with a comment", after(lambda: etree.Comment("x")))
    yield change("with an instruction", after(lambda: etree.PI("x", "y")))
    yield change("with another element", after(lambda: etree.Element("Other")))
    yield change("with a foreign element", after(lambda: etree.Element("{urn:other}Unit", name="m")))
    yield change("renamed", renamed)
    yield change("in a namespace", spaced)
    for child in node:
        if isinstance(child.tag, str):
            yield change(f"without its {child.tag}", lambda it: it.remove(it.find(child.tag)), (child.tag,))
    if len(node):
        yield change("empty", lambda it: [it.remove(child) for child in list(it)])
    if node.getparent() is not None:
        for edit, label in [(without, "left out"), (again, "twice"), (first, "first"), (last, "last")]:
            yield change(label, edit)
