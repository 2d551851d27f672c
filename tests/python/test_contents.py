"""What an .fmu carries beside the model: page, licences, picture, and reference results that hold."""

import csv
import hashlib
import os
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
import zipfile
from html.parser import HTMLParser

import fmpy
import numpy as np
import pytest
from conftest import ROOT, UNITS, maglev, single_units

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
ALL = pytest.mark.parametrize("unit", single_units(), ids=lambda p: p.stem)


def read(unit, name):
    with zipfile.ZipFile(unit) as archive:
        return archive.read(name)


def table(text):
    """A CSV text of the cross-check as a numpy array with named columns."""
    rows = list(csv.reader(text.decode().splitlines()))
    return np.array([tuple(map(float, row)) for row in rows[1:]], dtype=[(name, float) for name in rows[0]])


def settings(unit):
    lines = read(unit, f"{FOLDER}/{unit.stem}_ref.opt").decode().splitlines()
    return {key: value.strip() for key, value in (line.split(",") for line in lines)}


@ALL
def test_crosstool_fmpy_reproduces_the_reference_results(unit):
    """As any importer would: its inputs, its settings, its outputs, within its tolerance."""
    options = settings(unit)
    reference = table(read(unit, f"{FOLDER}/{unit.stem}_ref.csv"))
    columns = reference.dtype.names[1:]
    found = fmpy.simulate_fmu(
        str(unit),
        start_time=float(options["StartTime"]),
        stop_time=float(options["StopTime"]),
        output_interval=float(options["StepSize"]),
        input=table(read(unit, f"{FOLDER}/{unit.stem}_in.csv")),
        output=columns,
    )
    rows = np.searchsorted(found["time"], reference["time"])
    assert np.array_equal(found["time"][rows], reference["time"]), "all times are exact in binary"
    deviations = {}
    for name in columns:
        scale = np.abs(reference[name]).max() or 1.0
        deviations[name] = np.abs(found[name][rows] - reference[name]).max() / scale
    print(deviations)
    assert max(deviations.values()) <= float(options["RelTol"]), deviations
    assert sum(np.ptp(reference[name]) > 0 for name in columns) >= 4, "too little moves to be a reference"


@ALL
def test_maglev_repeats_the_reference_results(unit):
    assert "OUTSIDE" not in maglev("reference", unit).stdout


def test_issue_maglev_sees_a_reference_that_does_not_hold(tmp_path):
    """A result that is off by more than the tolerance is named, with exit status 1."""
    unit = tmp_path / "ems.fmu"
    name = f"{FOLDER}/ems_ref.csv"
    with zipfile.ZipFile(UNITS / "ems.fmu") as source, zipfile.ZipFile(unit, "w") as target:
        for entry in source.namelist():
            content = source.read(entry)
            if entry == name:
                lines = content.decode().splitlines()
                cells = lines[50].split(",")
                cells[1] = repr(float(cells[1]) * 1.001)
                lines[50] = ",".join(cells)
                content = "\n".join(lines).encode()
            target.writestr(entry, content)
    found = [line for line in maglev("reference", unit, status=1).stdout.splitlines() if "OUTSIDE" in line]
    assert len(found) == 1 and found[0].split()[0] == "force", found


@ALL
def test_reference_results_follow_the_rules_of_the_cross_check(unit):
    description = fmpy.read_model_description(str(unit))
    variables = {v.name: v for v in description.modelVariables}
    options = settings(unit)
    for end, causality in (("in", "input"), ("ref", "output")):
        content = read(unit, f"{FOLDER}/{unit.stem}_{end}.csv")
        assert len(content) <= 1_000_000 and content.startswith(b'"time",')
        data = table(content)
        assert {variables[name].causality for name in data.dtype.names[1:]} == {causality}
        assert np.all(np.diff(data["time"]) >= 0)
        assert data["time"][0] == float(options["StartTime"]) and data["time"][-1] == float(options["StopTime"])
    assert len(data.dtype.names) - 1 <= 10, "ten variables at most are recommended"


@ALL
def test_reference_results_are_named_by_the_layered_standard(unit):
    manifest = ET.fromstring(read(unit, f"{FOLDER}/fmi-ls-manifest.xml"))
    namespace = "{http://fmi-standard.org/fmi-ls-manifest}"
    assert manifest.tag == "fmiReferences"
    assert manifest.attrib[f"{namespace}fmi-ls-name"] == "org.fmi-standard.fmi-ls-ref"
    files = {related.attrib["role"]: related.attrib["source"] for related in manifest.findall("Related")}
    experiment = ET.fromstring(read(unit, f"{FOLDER}/{files['experiment']}")).find("Experiment")
    assert experiment.find("Stimuli").attrib["source"] == files["testcase"]
    assert experiment.find("References").attrib["source"] == files["result"]
    names = zipfile.ZipFile(unit).namelist()
    assert all(f"{FOLDER}/{source}" in names for source in files.values())


class Page(HTMLParser):
    """Counts what a page has and collects what it would load."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.links, self.ids, self.text = [], [], set(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.tags.append(tag)
        self.links += [attributes[k] for k in ("src", "href") if k in attributes]
        self.ids |= {attributes["id"]} if "id" in attributes else set()

    def handle_data(self, data):
        self.text.append(data)


@ALL
def test_the_page_has_equations_a_figure_and_every_variable_and_loads_nothing(unit):
    page = Page(read(unit, "documentation/index.html").decode())
    assert page.tags.count("math") >= 5 and page.tags.count("svg") >= 3
    assert not {"script", "link", "img", "iframe", "merror"} & set(page.tags)
    names = zipfile.ZipFile(unit).namelist()
    for link in page.links:
        assert link.startswith("#") and link[1:] in page.ids or f"documentation/{link}" in names, link
    text = " ".join(page.text)
    shown = set(re.findall(r"[A-Za-z_]\w*", text))
    for variable in fmpy.read_model_description(str(unit)).modelVariables:
        # of variables that differ in their number only, the first and the last are shown
        stem = re.sub(r"\d+$", "", variable.name)
        assert variable.name in shown or any(name.startswith(stem) for name in shown), variable.name


@ALL
def test_every_unit_has_a_picture_of_its_own(unit):
    picture = read(unit, "model.png")
    assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = (int.from_bytes(picture[k : k + 4], "big") for k in (16, 20))
    assert (width, height) == (512, 384)
    digests = {hashlib.sha256(read(u, "model.png")).digest() for u in single_units()}
    assert len(digests) == len(single_units())


@ALL
def test_every_linked_crate_has_its_licence_text(unit):
    """The crates of `cargo tree`, each with a text that is there and says what a licence says."""
    overview = read(unit, "documentation/licenses/license.txt").decode()
    kind = unit.stem.split("-")[0]
    done = subprocess.run(
        ["cargo", "tree", "--package", f"fmu-{kind}", "--edges", "normal,no-proc-macro", "--prefix", "none"],
        capture_output=True, text=True, cwd=ROOT, check=True,
    )
    crates = {tuple(line.split()[:2]) for line in done.stdout.splitlines() if "(/" not in line and line.strip()}
    assert len(crates) > 10
    blocks = {block.split(":")[0]: block.splitlines()[1:] for block in overview.split("\n\n")}
    words = re.compile(r"permission|licen|without warrant|public domain", re.I)
    for name, version in crates:
        files = [line.strip() for line in blocks[f"{name}-{version.lstrip('v')}"] if not line.startswith("  by ")]
        texts = [read(unit, f"documentation/licenses/{file}").decode() for file in files]
        assert words.search("\n".join(texts)), (name, files)


def test_invariant_packing_twice_gives_the_same_bytes(tmp_path):
    """The task packs again into another folder; every byte is that of the first time."""
    out = tmp_path / "again"
    subprocess.run(["cargo", "xtask", "package", "--out", out], cwd=ROOT, check=True, capture_output=True)
    for unit in single_units():
        assert (out / unit.name).read_bytes() == unit.read_bytes(), unit.name


def test_issue_the_check_of_libraries_refuses_what_is_not_portable(tmp_path):
    """Libraries built by the plain toolchain need a newer glibc and libgcc_s: the check says so."""
    if os.name == "nt" or shutil.which("cargo") is None:
        pytest.skip("for Linux")
    base = ["cargo", "xtask", "binaries", UNITS / "ems.fmu"]
    plain = subprocess.run(base, cwd=ROOT, capture_output=True, text=True)
    assert plain.returncode == 0 and "exports 36 functions" in plain.stderr, plain.stderr
    refused = subprocess.run([*base, "--glibc", "2.2"], cwd=ROOT, capture_output=True, text=True)
    assert refused.returncode != 0 and "at most GLIBC_2.2 is allowed" in refused.stderr, refused.stderr
