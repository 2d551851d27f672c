"""Whatever fmpy reports is an error for `maglev validate`, but for what the standard allows.

fmpy 0.3.32 checks names, start values, causality, units and the structure after the schema; each of its rules
has a fault here. Then both look at the same generated descriptions.
"""

import random
from pathlib import Path

import pytest
from fmpy.validation import validate_fmu
from lxml import etree

import fmu_cases as cases
from conftest import ROOT

SOUND = cases.SOUND.replace('variableNamingConvention="structured"', "")

# part of fmpy's text: why the standard allows it nevertheless
ALLOWED = {
    # 2.2.3: a displayUnit that is not defined is ignored
    "The display unit": "2.2.3",
    # the schema gives these elements no type, which allows any attribute (2.2: the schema is normative)
    "SimpleType.__init__() got an unexpected keyword": "2.2",
    # xsi:noNamespaceSchemaLocation may be at any element (XML Schema part 1, 2.6)
    "Item.__init__() got an unexpected keyword argument '{http://www.w3.org/2001/XMLSchema-instance}": "2.2",
    # the words of a list are separated by any white space (XML Schema part 2, 2.5.1.2)
    "invalid literal for int() with base 10": "2.2.8",
    "The number of elements in the dependencies and dependenciesKind": "2.2.8",
}


@pytest.fixture(scope="module", autouse=True)
def schema_read_once():
    """fmpy reads the schema anew for each unit, which takes longer than all the rest."""
    patch, read = pytest.MonkeyPatch(), etree.XMLSchema
    known = {}
    patch.setattr(etree, "XMLSchema", lambda file: known.setdefault(file, read(file=file)))
    yield
    patch.undo()


def compared(folder, texts):
    """For each description what fmpy reports, and our errors."""
    def ours(number):
        path = cases.pack(folder / f"{number}.fmu", texts[number])
        return cases.errors(path)

    found = cases.each(ours, range(len(texts)))
    return [(validate_fmu(str(folder / f"{number}.fmu")), found[number]) for number in range(len(texts))]


def allowed(problem):
    return any(problem.startswith(text) for text in ALLOWED)


# what fmpy says: how to make it say so
FAULTS = {
    "is not unique": ('name="q"', 'name="k"'),
    'must have variability != "continuous"': ('name="n" valueReference="0" causality="parameter" variability="fixed"',
                                               'name="n" valueReference="0" causality="local" variability="continuous"'),
    'Variable "u"': ('<Real declaredType="Length" start="0"/>', '<Real declaredType="Length"/>'),
    'Variable "k"': ('<Real start="1"/></Scalar', "<Real/></Scalar"),
    'Variable "b"': ('<Boolean declaredType="Flag" start="true"/>', "<Boolean/>"),
    'Variable "g"': ('min="1" max="2" start="1"/>', 'min="1" max="2"/>'),
    'illegal combination of causality="parameter" and variability="discrete"':
        ('causality="parameter" variability="tunable" initial="exact"', 'causality="parameter" variability="discrete"'),
    'combination causality="parameter" and variability="discrete"':
        ('causality="parameter" variability="tunable"', 'causality="parameter" variability="discrete"'),
    'combination causality="calculatedParameter" and variability="fixed"':
        ('variability="fixed"><Real/>', 'variability="fixed" initial="exact"><Real start="1"/>'),
    'combination causality="input" and variability="continuous"':
        ('causality="input" variability="continuous"', 'causality="input" variability="continuous" initial="approx"'),
    'combination causality="local" and variability="constant"':
        ('name="c" valueReference="6"', 'name="c" valueReference="6" initial="approx"'),
    'combination causality="independent" and variability="continuous"':
        ('causality="independent" variability="continuous"',
         'causality="independent" variability="continuous" initial="exact"'),
    'has initial="calculated" but provides a start value': ("<Real derivative", '<Real start="1" derivative'),
    'has causality="independent" but provides a start value': ('<Real unit="s"/></Scalar',
                                                               '<Real unit="s" start="1"/></Scalar'),
    'The unit "ft"': ('<Real unit="s"/></Scalar', '<Real unit="ft"/></Scalar'),
    'The unit ""': ('<Real unit="s"/></Scalar', '<Real unit=""/></Scalar'),
    'The unit "yd"': ('quantity="Length" unit="m" displayUnit="mm"\n', 'quantity="Length" unit="yd"\n'),
    "None": ('<Real derivative="3"/>', '<Real derivative="3" displayUnit="mm"/>'),
    "If dependenciesKind exists dependencies": ('index="5" dependencies="3" dependenciesKind', 'index="5" dependenciesKind'),
    "The number of elements in the dependencies": ('dependenciesKind="fixed dependent"', 'dependenciesKind="fixed"'),
    "ModelStructure/Outputs must have": ('<Unknown index="11"/>', ""),
    "Outputs must have exactly one entry": ('<Unknown index="11"/>', '<Unknown index="11"/><Unknown index="12"/>'),
    'must have the attribute "derivative"': ('<Derivatives><Unknown index="4"', '<Derivatives><Unknown index="3"'),
    "InitialUnknowns does not contain": ('<Unknown index="7" dependencies="6"/>', ""),
    "expected set of variables": ('<Unknown index="7" dependencies="6"/>',
                                  '<Unknown index="7" dependencies="6"/><Unknown index="11"/>'),
    "which does not exist": ('derivative="3"', 'derivative="0"'),
    "references model variable index 13": ('derivative="3"', 'derivative="13"'),
    "which has not been defined": ('declaredType="Count"', 'declaredType="Missing"'),
    "illegal carriage return": ('name="q"', 'name="q&#13;"'),
    "illegal line feed": ('name="q"', 'name="q&#10;"'),
    "illegal tab": ('name="q"', 'name="q&#9;"'),
    "list index out of range": ('<Unknown index="11"/>', '<Unknown index="99"/>'),
    "Unsupported FMI version": ('fmiVersion="2.0"', 'fmiVersion="2.0.5"'),
}


def test_issue_each_rule_of_fmpy_has_its_fault(tmp_path):
    texts = [SOUND.replace(old, new, 1) for old, new in FAULTS.values()]
    for message, text, (problems, errors) in zip(FAULTS, texts, compared(tmp_path, texts)):
        assert text != SOUND, message
        assert any(message in problem for problem in problems), (message, problems)
        assert errors, (message, problems)
    path = cases.pack(tmp_path / "backslash.fmu", SOUND, {**cases.SOURCES, "resources\\a": ""})
    assert any("backslash" in it for it in validate_fmu(str(path))) and cases.errors(path)


# structured names of FMI 2.0.5, section 2.2.9, and others
NAMES = {
    True: ["xx", "_a1.b", "a.b.mod[3,4].'#123'.c", "der(x9)", "der(a.b[1],2)", "robot.axis.'motor #234'", "'a b'[1].'c'",
           "x[0]", "'der(x'", r"'a\'b'", r"'a\\b'", r"'\n'"],
    False: ["1x", "a.", "a b", "x[]", "x[1, 2]", "x[-1]", "der(x", "der()", "der(x,)", "der(der(x))", "a.der(x)", "''",
            "a-b", "'a", "'a\"b'", "'a`b'", "'ä'", "ä", r"'\x'", "'a''b'", "x.[1]", " x", "", r"'a\'"],
}

def test_issue_structured_names_follow_the_grammar(tmp_path):
    names = [(name, legal) for legal, group in NAMES.items() for name in group]

    def text(name):
        tree = etree.fromstring(cases.SOUND.encode())
        tree.find("ModelVariables")[6].set("name", name)
        return cases.HEAD + etree.tostring(tree, encoding="unicode")

    for (name, legal), (problems, errors) in zip(names, compared(tmp_path, [text(name) for name, _ in names])):
        assert legal == (not errors), (name, errors)
        # fmpy knows no escapes
        assert not (legal and problems) or "\\" in name, (name, problems)


def test_issue_whatever_fmpy_reports_in_variants_is_an_error(tmp_path):
    variants = [(label, text) for label, text in cases.variants(SOUND)
                if cases.SCHEMA.validate(etree.fromstring(text.encode()))]
    reported = 0
    for (label, _), (problems, errors) in zip(variants, compared(tmp_path, [text for _, text in variants])):
        reported += bool(problems)
        if not all(map(allowed, problems)):
            assert errors, (label, problems)
    assert reported > 100


def changed(text, seed):
    """A description in which one attribute of a variable or of the structure has another value, or none."""
    chance = random.Random(seed)
    tree = etree.fromstring(text.encode())
    nodes = [it for it in tree.iter("ScalarVariable", "Real", "Integer", "Boolean", "Unknown") if it.attrib]
    node = chance.choice(nodes)
    name = chance.choice(sorted({*node.attrib, "start", "initial", "causality", "variability", "derivative"}
                                - {"description"}))
    others = sorted({it.get(name) for it in nodes if it.get(name) is not None})
    value = chance.choice([*others, None])
    if value is None:
        node.attrib.pop(name, None)
    else:
        node.set(name, value)
    return f"{node.tag} {dict(node.attrib)}: {name}={value}", cases.HEAD + etree.tostring(tree, encoding="unicode")


@pytest.mark.parametrize("unit", ["ems", "guideway"])
def test_issue_whatever_fmpy_reports_in_our_units_is_an_error(unit, tmp_path):
    text = Path(ROOT / "modelDescription" / f"{unit}.xml").read_text(encoding="utf-8")
    text = text.replace('variableNamingConvention="structured"', 'variableNamingConvention="flat"')
    texts = [changed(text, seed) for seed in range(120)]
    reported = 0
    for (label, _), (problems, errors) in zip(texts, compared(tmp_path, [it for _, it in texts])):
        reported += bool(problems)
        if not all(map(allowed, problems)):
            assert errors, (label, problems)
    assert reported > 12
