"""What the standard allows is no error for `maglev validate`: descriptions as other tools write them, and odd but
legal ones. The official schema accepts each; fmpy reports nothing but a displayUnit that is not defined, which the
standard (2.2.3) says is ignored."""

import subprocess

import pytest
from fmpy.validation import validate_fmu
from lxml import etree

import fmu_cases as cases
from conftest import MAGLEV

INSTANCE = 'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
BEFORE_VARIABLES = "  <ModelVariables>"
VENDOR = """<a xmlns:q="urn:q"><ScalarVariable name="u" valueReference="none"/><Unit name="m"/><Unit name="m"/><q:Unit/>
  <Real unit="none" derivative="0" start="x"/><SourceFiles><File name="none.c"/></SourceFiles><Category name="logAll"/>
  <CoSimulation modelIdentifier="-"/><Unknown index="99"/><Item name="low" value="1"/>text</a>"""

# what is changed in the sound description: old and new text, several times if need be
CHANGES = {
    "anything in the vendor's annotations": ('<Tool name="none"/>', f'<Tool name="none">{VENDOR}</Tool>'),
    "anything in a variable's annotations": ("<menu/>", VENDOR),
    "min and max wider than the type's": ('min="-50"\n        max="50"', 'min="-1000" max="1000"'),
    "min and max of the variable only": ('min="-100" max="100" nominal', "nominal"),
    "a displayUnit that is not defined": ('displayUnit="mm" relativeQuantity="false" min="-50"', 'displayUnit="inch" min="-50"'),
    "a displayUnit that is the unit": ('displayUnit="mm" relativeQuantity="false" min="-50"', 'displayUnit="m" min="-50"'),
    "blanks around numbers": ('valueReference="4"', 'valueReference=" 4 "', '<Real start="1"/></S', '<Real start=" 1 "/></S',
                              'index="11"', 'index=" 11 "', 'm="1"', 'm=" 1 "'),
    "leading zeros and signs": ('valueReference="4"', 'valueReference="004"', 'start="3"', 'start="+003"',
                                'index="11"', 'index="+011"', 'valueReference="6"', 'valueReference="006"'),
    "minus zero": ('name="time" valueReference="0"', 'name="time" valueReference="-0"'),
    "an item written otherwise": ('max="2" start="1"', 'max="2" start=" 01 "'),
    "Booleans as numbers": ('start="true"', 'start="1"', 'needsExecutionTool="false"', 'needsExecutionTool=" 0 "'),
    "numbers in any shape": ('factor="1000"', 'factor="+1.E3"', 'start="9.81"', 'start=".981e1"'),
    "the place of the schema": ("fmiVersion=", f'{INSTANCE} xsi:noNamespaceSchemaLocation="fmi2ModelDescription.xsd" fmiVersion='),
    "the places of schemas": ("fmiVersion=", f'{INSTANCE} xsi:schemaLocation="urn:a a.xsd" fmiVersion='),
    "a prefix that is not used": ("fmiVersion=", 'xmlns:vendor="urn:vendor" fmiVersion='),
    "comments and instructions": ("<Outputs>", "<Outputs><!-- all --><?tool some?>", "<BaseUnit s=\"1\"/>", "<BaseUnit s=\"1\"><!-- s --></BaseUnit>"),
    "the encoding in lower case": ('encoding="UTF-8"', "encoding='utf-8'"),
    "a standalone document": ('encoding="UTF-8"', 'encoding="UTF-8" standalone="yes"'),
    "a byte order mark": ("<?xml", "\ufeff<?xml"),
    "letters of all kinds": ('description="d" author="a"', 'description="Größe &#10; 長さ" author="Ä"'),
    "a leap day at midnight": ("2024-02-29T12:00:00Z", "2024-02-29T24:00:00Z"),
    "only co-simulation": None,
    "only the required": None,
    "constants of one value": ('<Real start="9.81"/></ScalarVariable>', '<Real start="9.81"/></ScalarVariable>'
                               '<ScalarVariable name="c2" valueReference="6" variability="constant"><Real start="9.810"/>'
                               '</ScalarVariable>'),
    "an output that is a constant": ('name="c" valueReference="6" causality="local"', 'name="c" valueReference="6" causality="output"',
                                     '<Unknown index="11"/>', '<Unknown index="11"/><Unknown index="12"/>'),
    "an alias of a parameter": ('variability="fixed"><Real/>', 'variability="tunable"><Real/>', 'valueReference="5"', 'valueReference="4"'),
    "outputs in any order": ('<Unknown index="5" dependencies="3" dependenciesKind="constant"/><Unknown index="11"/>',
                             '<Unknown index="11"/><Unknown index="5" dependencies="3" dependenciesKind="constant"/>'),
    "no dependencies": ('index="7" dependencies="6"', 'index="7" dependencies=""', 'dependencies="3" dependenciesKind="constant"', 'dependencies="" dependenciesKind=""'),
    "lists apart by any blanks": ('dependenciesKind="fixed dependent"', 'dependenciesKind="fixed\n dependent"', 'dependencies="2 3"', 'dependencies=" 2 3 "'),
    "quotes in a flat name": ('variableNamingConvention="structured"', "", 'name="q"', """name="a &quot;b&quot; 'c'" """),
    "any name that is flat": ('variableNamingConvention="structured"', 'variableNamingConvention="flat"', 'name="q"', 'name="1 + *[1..2], Ä!"'),
    "quotes in a structured name": ('name="q"', "name=\"a.'motor #234 (x)'[1,2].b_1\""),
    "a second derivative": ('name="der(x)"', 'name="der(a[1,2].x,2)"'),
    "an array that begins at 0": ('name="q"', 'name="a[0]"', 'name="k"', 'name="a[1]"'),
    "a unit without a base": ('<BaseUnit s="1"/>', ""),
    "the empty unit, defined": ('<Unit name="s">', '<Unit name="">', '<Real unit="s"/>', '<Real unit=""/>'),
    "an enumeration with gaps and negative values": ('value="2"', 'value="-7"', 'min="1" max="2"', 'min="-7" max="11"'),
    "a type that is not used": ("<TypeDefinitions>", '<TypeDefinitions><SimpleType name="Unused"><Real/></SimpleType>'),
    "no independent variable": ('<Real unit="s"/>', "<Real/>", 'causality="independent"', 'causality="local"'),
    "a discrete Real": ('<Real derivative="3"/>', '<Real derivative="3"/>', 'causality="calculatedParameter" variability="fixed"', 'causality="local" variability="discrete"',
                        '<Unknown index="7" dependencies="6"/>', ""),
    "an approximate start": ('initial="exact">\n      <Real declaredType="Length" quantity', 'initial="approx">\n      <Real declaredType="Length" quantity',
                             '<InitialUnknowns>', '<InitialUnknowns><Unknown index="3"/>', 'dependencies="2 3" dependenciesKind="constant dependent"', 'dependencies="2"',
                             '<Unknown index="5" dependencies="3"/>', '<Unknown index="5" dependencies="2"/>'),
    "both interfaces the other way round": None,
    "two libraries of their own names": ('<ModelExchange modelIdentifier="sound"', '<ModelExchange modelIdentifier="sound_me"'),
    "a description of the type Boolean": ("<Boolean/>", '<Boolean></Boolean>'),
}

MINIMAL = cases.HEAD + """<fmiModelDescription fmiVersion="2.0" modelName="m" guid="1"><CoSimulation modelIdentifier="m"/>
<ModelVariables><ScalarVariable name="x" valueReference="4294967295"><Real/></ScalarVariable></ModelVariables>
<ModelStructure/></fmiModelDescription>"""


def changed(what):
    text = cases.SOUND
    interface = text[text.index("  <ModelExchange"):text.index("  <CoSimulation")]
    if what == "only the required":
        return MINIMAL
    if what == "only co-simulation":
        return text.replace(interface, "").replace(' reinit="false"', "").replace(
            '\n        canHandleMultipleSetPerTimeInstant="true"', "")
    if what == "both interfaces the other way round":
        return text.replace(interface, "").replace("</CoSimulation>\n", "</CoSimulation>\n" + interface)
    pairs = CHANGES[what]
    for old, new in zip(pairs[::2], pairs[1::2]):
        assert old in text, (what, old)
        text = text.replace(old, new)
    return text


def refused(path, text):
    """Why the schema or fmpy object, if not for a displayUnit."""
    tree = etree.fromstring(text.encode())
    schema = [] if cases.SCHEMA.validate(tree) else [str(cases.SCHEMA.error_log)]
    return schema + [it for it in validate_fmu(str(path)) if not it.startswith("The display unit")]


@pytest.mark.parametrize("what", CHANGES)
def test_issue_what_is_legal_is_no_error(what, tmp_path):
    text = changed(what)
    path = cases.pack(tmp_path / "legal.fmu", text)
    assert cases.errors(path) == []
    # fmpy splits lists by single blanks
    if what != "lists apart by any blanks":
        assert refused(path, text) == []
