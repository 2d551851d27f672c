"""The master's table of the schema of FMI 2.0 against the official one, on every kind of element and attribute."""

from lxml import etree

import fmu_cases as cases


def is_lax(label):
    """Where the official schema's reader is laxer than XML Schema (part 2, 3.2.5.1): an exponent needs digits."""
    return label.endswith("='1e'")


def test_golden_the_sound_description_has_every_attribute(tmp_path):
    root = etree.fromstring(cases.SOUND.encode())
    here = {(node.tag, name) for node in root.iter(etree.Element) for name in node.attrib}
    assert set(cases.schema_types()) <= here
    path = cases.pack(tmp_path / "sound.fmu", cases.SOUND)
    assert {it["rule"] for it in cases.findings(path)} == {"platform", "unit-base"}


def test_golden_the_official_schema_has_the_same_verdict(tmp_path):
    variants = list(cases.variants(cases.SOUND))
    assert len(variants) > 2000

    def ours(number):
        path = cases.pack(tmp_path / f"{number}.fmu", variants[number][1])
        found = cases.findings(path)
        path.unlink()
        return found

    different, verdicts = [], []
    for (label, text), found in zip(variants, cases.each(ours, range(len(variants)))):
        legal = cases.SCHEMA.validate(etree.fromstring(text.encode())) and not is_lax(label)
        rules = {it["rule"] for it in found if it["severity"] == "error"}
        if legal and any(rule.startswith("schema-") for rule in rules) or not legal and not rules:
            different.append((label, legal, rules))
        verdicts.append(legal)
    assert different == []
    # neither side is empty
    assert 900 < sum(verdicts) < len(variants) - 900
