"""The guide in docs/: its code runs, its scenarios run, its numbers are printed by its commands, and its check finds what
is broken."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from conftest import MAGLEV, ROOT, UNITS, maglev, results

DOCS = ROOT / "docs"
SPHINX = ROOT / "target" / "docs" / "python" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def blocks(page, language):
    """The blocks of code of a page in one language."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def shell(page):
    """The commands of a page, continued lines joined."""
    lines = "".join(blocks(page, "sh")).replace("\\\n", " ").splitlines()
    return [shlex.split(line, comments=True) for line in lines if line]


def commands(page):
    """Those of `maglev`."""
    return [command for command in shell(page) if command[0] == "maglev"]


def with_our_units(scenario):
    """The scenario with absolute paths of the units that it names."""

    def ours(unit):
        return unit | {"fmu": ours(unit["fmu"])} if isinstance(unit, dict) else str(UNITS / Path(unit).name)

    units = {name: ours(unit) for name, unit in scenario.get("units", {}).items()}
    return scenario | ({"units": units} if units else {})


@pytest.mark.parametrize("text", blocks("scenario-file.md", "json"), ids=lambda text: re.search(r'"(\w+)"', text)[1])
def test_scenario_pages_examples_run(text, tmp_path):
    """Each example as a change of one-bogie.json, which the page says it may be."""
    base = json.loads((ROOT / "scenarios" / "one-bogie.json").read_text())
    (tmp_path / "one-bogie.json").write_text(json.dumps(with_our_units(base)))
    scenario = tmp_path / "scenario.json"
    scenario.write_text(json.dumps({"extends": "one-bogie.json"} | with_our_units(json.loads(text))))
    maglev("run", scenario, "--stop", "0.2", "--no-report", "--out", tmp_path / "out")


def run_python(code, folder):
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"{code}\n{done.stderr}"
    return done.stdout


def test_first_runs_python_reads_results(tmp_path):
    maglev("run", ROOT / "scenarios" / "low-speed.json", "--stop", "0.1", "--no-report", "--out", tmp_path / "results" / "low-speed")
    (code,) = blocks("first-run.md", "python")
    assert run_python(code, tmp_path) == "first magnet: 8.00 to 8.00 mm\n"


def shortened(options, folder):
    """A run's options with an early stop, without a report, and results in `folder` where they are named relative to the project."""
    options = [str(ROOT / option) if option.startswith(("scenarios/", "target/")) else option for option in options] + ["--no-report"]
    out = options.index("--out") + 1 if "--out" in options else None
    if out is None:
        options += ["--out", str(folder / "out")]
    elif options[out].startswith("/"):
        options[out] = str(folder / Path(options[out]).name)
    if "--stop" in options:
        options[options.index("--stop") + 1] = "0.05"
        return options
    return [*options, "--stop", "0.05"]


@pytest.mark.parametrize("page", ["first-run.md", "scenario-file.md", "choosing.md", "tutorial.md"])
def test_commands_of_the_guide_are_accepted(page, tmp_path):
    """Runs are cut short; what is made of their results follows. Long ones of `modes` have a test of their own."""
    for _, name, *options in commands(page):
        if name == "run":
            options = shortened(options, tmp_path)
        elif name in ("inspect", "derive"):
            (tmp_path / "patch.json").write_text("{}")
            options = [ROOT / option if option.startswith("target/") else option for option in options]
        elif name == "modes" and "scenarios/one-magnet.json" in options:
            options[0] = ROOT / options[0]
        elif name != "report":
            continue
        done = subprocess.run([MAGLEV, name, *options], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        # modes end with 1 where something grows, which one of the commands is there to show
        assert done.returncode == 0 or (name == "modes" and done.returncode == 1), f"{name} {options}\n{done.stderr}"
    if page == "tutorial.md":
        (code,) = blocks(page, "python")
        said = run_python(code, tmp_path)
        (shown,) = [block for block in blocks(page, "text") if "deflection" in block]
        # the runs are cut short, so other numbers
        assert re.sub(r"[\d.-]+", "N", said) == re.sub(r"[\d.-]+", "N", shown)


def test_moving_stability_prints_what_the_page_shows():
    """The first command of the page; the others take minutes."""
    _, name, scenario, *options = commands("moving-stability.md")[0]
    done = subprocess.run([MAGLEV, name, ROOT / scenario, *options], capture_output=True, text=True, timeout=300)
    assert done.returncode == 1, done.stderr
    (shown,) = blocks("moving-stability.md", "text")
    assert done.stdout.split() == shown.split()


def test_settings_for_sampled_controllers_are_a_whole_scenario(tmp_path):
    """The patch of choosing.md runs as it is printed. It changes what the page says and nothing else, and it is as accurate
    as the page says: far more than the shipped settings, against steps of 0.1 ms. A patch that lost connections would fall."""
    (text,) = blocks("choosing.md", "json")
    base = json.loads((ROOT / "scenarios" / "one-magnet.json").read_text())
    patch = json.loads(text)
    plain = [{k: v for k, v in it.items() if k != "kinks"} for it in patch["connections"]]
    assert plain == base["connections"]
    (tmp_path / "one-magnet.json").write_text(json.dumps(with_our_units(base)))
    scenario = tmp_path / "sampled.json"
    scenario.write_text(text)

    def gaps(file, *options):
        maglev("run", file, "--no-report", "--stop", "8", "--record-interval", "0.02", "--out", tmp_path / "out", *options)
        return results(tmp_path / "out")["vehicle.gap_01"]

    exact = gaps(scenario, "--step", "0.0001")
    shipped = gaps(tmp_path / "one-magnet.json", "--set", "ems_01.sample_time=0.001")
    swing = (exact - 0.008).std()
    assert 2e-5 < swing < 1e-3, "the magnet does not levitate"
    errors = [(it - exact).std() / swing for it in (gaps(scenario), shipped)]
    assert errors[0] < 2e-5 and errors[1] > 1e-4, errors


# what troubleshooting.md quotes, and a command that says it
SAYINGS = [
    ("there is no instance \"ems_99\"; did you mean \"ems_01\"?", ["--set", "ems_99.gain_gap=6"]),
    ("\"ems_*.gain_gaps\" matches nothing; did you mean \"ems_*.gain_gap\"?", ["--set", "ems_*.gain_gaps=6"]),
    ("-6 is outside of the range of ems_01.turns: 0 to inf", ["--set", "ems_*.turns=-6"]),
    ("\"many\" is not a valid Real for ems_01.turns", ["--set", "ems_*.turns=many"]),
    ("1 is not a valid Boolean for guideway.chirp_on", ["--set", "guideway.chirp_on=1"]),
    ("the span from 0 s to 22 s is not a multiple of the step 0.0007 s", ["--step", "0.0007"]),
    ("record.interval is 0.005 s, which is not a multiple of the step 0.002 s", ["--step", "0.002", "--record-interval", "0.005"]),
    ("isolation has limits, but no instance is isolated", ["--step-timeout", "5"]),
    ("m: the magnet has reached the rail", [f"--set=ems_*.{gain}=0" for gain in ("gain_gap_velocity", "gain_velocity")]),
    ("No such file or directory", ["--set", "guideway.irregularity_on=true", "--set", "guideway.irregularity_file=profile.csv"]),
]


@pytest.mark.parametrize("saying, options", SAYINGS, ids=lambda value: value[:40] if isinstance(value, str) else "")
def test_errors_are_as_troubleshooting_quotes_them(saying, options, tmp_path):
    page = " ".join((DOCS / "troubleshooting.md").read_text(encoding="utf-8").split())
    assert saying in page
    scenario = ROOT / "scenarios" / "one-bogie.json"
    done = subprocess.run([MAGLEV, "run", scenario, "--no-report", "--out", tmp_path, *options], capture_output=True, text=True, timeout=300)
    # a magnet that reaches the rail ends the run as a result
    expected = (0,) if "reached the rail" in saying else (1, 2)
    assert done.returncode in expected and saying in done.stderr, done.stderr


def modes(text):
    """Frequency and damping of each row of a table of modes."""
    rows = re.findall(r"^ *(\d+\.\d+) +(-?\d+\.\d+) +\d+\.\d+ +-?\d+\.\d+ ", text, re.MULTILINE)
    return [tuple(map(float, row)) for row in rows]


def test_tutorials_modes_are_those_of_its_command():
    _, name, *options = next(c for c in commands("tutorial.md") if c[1] == "modes")
    done = subprocess.run([MAGLEV, name, *options], cwd=ROOT, capture_output=True, text=True, timeout=300)
    (shown,) = [block for block in blocks("tutorial.md", "text") if "states" in block]
    # four decimals are printed; another machine's last bits may round the other way
    assert modes(shown) == [pytest.approx(row, abs=2e-4) for row in modes(done.stdout)] != []


# how each recipe stands still on a smooth track
STANDING = {
    "own-girder": ["guideway.chirp_on=false"],
    "two-fields": ["guideway.chirp_on=false"],
    "three-cars": [],
    "own-controller": ["vehicle.travel_speed=0", "vehicle.initial_position=12.5"],
}


# what the page says of recipes in which something happens
STORIES = {
    "magnet-17-fails": lambda it: " / ".join(f"{1e3 * it[f'ems_{k}.gap']['final']:.1f}" for k in range(17, 21)) + " mm",
    "gust": lambda it: "the gaps stay between {:.1f} and {:.1f} mm".format(*extremes(it)),
    "braking": lambda it: (
        f"The front magnet stops at {it['vehicle.position_01']['final']:.2f} m, as 5 m/s · 2 s and (5 m/s)²/2 m/s² demand; "
        "the gaps stay between {:.2f} and {:.2f} mm.".format(*extremes(it))
    ),
    "measured-track": lambda it: f"The smallest gap is {extremes(it)[0]:.1f} mm.",
    "measured-force": lambda it: (
        f"The car body sinks by {-1e3 * it['vehicle.car_1_vertical_displacement']['min']:.1f} mm; "
        "the gaps stay between {:.2f} and {:.2f} mm.".format(*extremes(it))
    ),
}


def extremes(signals):
    """The smallest and the largest gap of the vehicle, in mm."""
    gaps = [it for signal, it in signals.items() if re.search(r"vehicle\.gap_\d+$", signal)]
    return 1e3 * min(it["min"] for it in gaps), 1e3 * max(it["max"] for it in gaps)


def test_recipes_run_and_start_in_equilibrium(tmp_path):
    """Their files as the page names them, their commands, and a second at rest in which no gap moves."""
    for folder in ("scenarios", "examples"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    shutil.copytree(UNITS, tmp_path / "target" / "fmu")
    text = (DOCS / "recipes.md").read_text(encoding="utf-8")
    files = re.findall(r"as\s`(scenarios/\S+)`:\n\n```(?:json|csv)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    count = len(blocks("recipes.md", "json")) + len(blocks("recipes.md", "csv"))
    assert len(files) == count, "a block of the page does not say its file"
    for name, content in files:
        assert not (tmp_path / name).exists(), f"{name} would replace a shipped file"
        (tmp_path / name).write_text(content)
    done = []
    for program, *options in shell("recipes.md"):
        if program == "sh":
            subprocess.run([program, *options], cwd=tmp_path, check=True, timeout=300)
            continue
        name, scenario, *more = options
        if name == "modes":
            said = json.loads(maglev("modes", "--json", tmp_path / scenario).stdout)["modes"]
            assert said["stable"], scenario
            continue
        if name == "check":
            maglev("check", tmp_path / scenario)
            continue
        out = tmp_path / "results" / Path(scenario).stem
        if Path(scenario).stem in STORIES:
            maglev("run", tmp_path / scenario, "--no-report", "--out", out, *more)
            signals = json.loads((out / "summary.json").read_text())["signals"]
            sentence = STORIES[Path(scenario).stem](signals)
            assert sentence in " ".join(text.split()), sentence
            continue
        settings = [f"--set={it}" for it in STANDING[Path(scenario).stem]]
        maglev("run", tmp_path / scenario, "--stop", "1", "--no-report", "--out", out, *settings)
        signals = json.loads((out / "summary.json").read_text())["signals"]
        gaps = [it for signal, it in signals.items() if re.search(r"\.gap_\d+$", signal)]
        assert len(gaps) >= 8 and max(it["max"] - it["min"] for it in gaps) < 1e-9, scenario
        done.append(Path(scenario).stem)
    assert done == list(STANDING)


def test_commands_of_the_criteria_page_are_accepted(tmp_path):
    """Its runs cut short, so that they are judged by other numbers than the page shows; those are in tests/low_speed.rs."""
    own, keys = blocks("criteria.md", "json")
    (tmp_path / "my-criteria.json").write_text(own)
    statuses = []
    for name, *options in (command[1:] for command in commands("criteria.md")):
        if name == "run":
            out = options[options.index("--out") + 1] if "--out" in options else "results/low-speed"
            rest = [option for option in options[1:] if option.startswith(("--set", "guideway."))]
            maglev("run", ROOT / options[0], "--stop", "0.05", "--no-report", "--out", tmp_path / out, *rest)
            continue
        options = [str(ROOT / option) if option.startswith("scenarios/") else option for option in options]
        done = subprocess.run([MAGLEV, name, *options], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode in (0, 1), f"{name} {options}\n{done.stderr}"
        if name == "check":
            statuses.append(done.returncode)
    assert len(statuses) == 3 and statuses[0] == 0
    scenario = {"extends": str(ROOT / "scenarios" / "one-bogie.json")} | json.loads(keys)
    (tmp_path / "limits.json").write_text(json.dumps(scenario))
    said = maglev("run", tmp_path / "limits.json", "--stop", "0.05", "--no-report", "--out", tmp_path / "limits").stdout
    assert "smallest_gap" in said and "our choice" in said
    metrics = json.loads((tmp_path / "limits" / "metrics.json").read_text())
    assert list(metrics) == ["gap_rms", "smallest_gap"] and 0.0079 < metrics["smallest_gap"] < 0.0081
    maglev("check", tmp_path / "limits")


def test_fmpy_block_and_commands_run(tmp_path):
    code = blocks("units-elsewhere.md", "python")[0]
    assert "N before" in run_python(code, ROOT)
    for line in shell("units-elsewhere.md"):
        if line[0] == "fmpy":
            # from the folder of this environment, which need not be in the path; files go to a place of the test's
            line = [Path(sys.executable).parent / "fmpy", *(str(ROOT / a) if a.startswith("target/") else a for a in line[1:])]
            done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=300)
            assert done.returncode == 0, done.stderr
    assert (tmp_path / "gap.csv").read_text().startswith('"time","force","current"')


def test_example_in_c_levitates_a_mass(tmp_path):
    with zipfile.ZipFile(UNITS / "ems.fmu") as archive:
        archive.extractall(tmp_path / "ems")
    headers = Path(fmpy.__file__).parent / "c-code"
    program = tmp_path / "levitate_mass"
    source = ROOT / "examples" / "levitate_mass.c"
    subprocess.run(["cc", "-Wall", "-Wextra", "-Werror", "-I", headers, source, "-ldl", "-lm", "-o", program], check=True)
    done = subprocess.run([program, tmp_path / "ems"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "settled gap: 8.000 mm\n"), done.stderr


def test_example_in_rust_changes_a_gain(tmp_path):
    """With the gain that it has already nothing changes: the run is that of the command. With half of it, another."""
    line = next(line for line in shell("units-elsewhere.md") if line[0] == "cargo")
    scenario, *rest, gain = line[line.index("--") + 1 :]
    tune = MAGLEV.parent / "examples" / f"tune{MAGLEV.suffix}"
    assert tune.exists(), "not built: run `cargo xtask test`, or `cargo build --release -p maglev-cli --example tune`"

    def extremes(gain):
        command = [tune, ROOT / scenario, *rest, gain]
        run = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
        return [float(number) for number in re.findall(r"0\.\d{6}", run.stdout)]

    maglev("run", ROOT / scenario, "--no-report", "--out", tmp_path)
    whole = json.loads((tmp_path / "summary.json").read_text())["signals"]["vehicle.gap_01"]
    same, other = extremes("40"), extremes(gain)
    assert (min(same), max(same)) == (round(whole["min"], 6), round(whole["max"], 6))
    assert other[:2] == same[:2] and other[2:] != same[2:]


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """A copy of what the guide is made of, to break things in."""
    assert SPHINX.exists(), "the guide's packages are missing: run `cargo xtask docs` first"
    copy = tmp_path_factory.mktemp("guide") / "project"
    ignored = shutil.ignore_patterns("target*", ".git", "results", "fuzz", "__pycache__")
    shutil.copytree(ROOT, copy, ignore=ignored)
    return copy


def build(checkout, out):
    done = subprocess.run([SPHINX, "docs/build.py", out], cwd=checkout, capture_output=True, text=True, timeout=300)
    return done.returncode, done.stderr


def test_check_finds_what_is_broken(checkout, tmp_path):
    """All faults at once, so that the book is built once; each has to be named."""

    def add(page, text):
        path = checkout / page
        path.write_text(path.read_text(encoding="utf-8") + f"\n{text}\n", encoding="utf-8")

    add("README.md", "[a page that is not there](docs/no-such-page.md)")
    add("master/README.md", "[a file that is not there](../scenarios/no-such.json)")
    add("docs/physics.md", "[no anchor elsewhere](coupling.md#no-such-anchor) and [none here](#none-here)")
    add("docs/results.md", "[docutils' anchor, not GitHub's](physics.md#guideway-eqs-6-8-13-table-3-crates-guideway)")
    add("docs/coupling.md", "![no picture](no-such.svg) and $\\nosuchcommand$")
    add("docs/modes.md", "<script src='https://example.org/x.js'></script>")
    (checkout / "docs" / "forgotten.md").write_text("# In no list\n", encoding="utf-8")
    add("docs/reference/ems.md", "a hand in the generated")
    add("examples/levitate_mass.py", "# newer than its copy")
    status, said = build(checkout, tmp_path)
    assert status != 0
    for fault in (
        "no-such-page.md",
        "no-such.json",
        "no-such-anchor",
        "none-here",
        "GitHub has no anchor #guideway-eqs-6-8-13-table-3-crates-guideway",
        "no-such.svg",
        r"\nosuchcommand",
        "from the network: docs/modes.html",
        "forgotten.md",
        "docs/reference/ems.md is stale",
        "docs/units-elsewhere.md is stale",
    ):
        assert fault in said, f"{fault} was not found in:\n{said}"
