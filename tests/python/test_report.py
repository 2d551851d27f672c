"""The report in a browser: what a reader does with it, in headless Chromium.

Looked at is what is on the screen: pixels of canvases, texts, what has the focus. The 3D view is
compared with results.csv, too.
"""

import base64
import json
import shutil
import warnings
import zipfile

import numpy as np
import pytest

import browser as chromium
from browser import Visit
from conftest import ROOT, maglev, results

STOP = 1.5


@pytest.fixture(scope="module")
def browser():
    try:
        with chromium.launched() as it:
            yield it
    except chromium.NoBrowser as why:
        warnings.warn(f"THE REPORT IS NOT TESTED: {why}", stacklevel=1)
        pytest.skip(f"THE REPORT IS NOT TESTED: {why}")


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two short runs of one bogie in the middle of its span, the other with a softer gain."""
    folder = tmp_path_factory.mktemp("report")
    for name, gain in [("usual", 7), ("soft", 6)]:
        maglev("run", ROOT / "scenarios" / "one-bogie.json", "--out", folder / name, "--stop", STOP, "--no-report",
               "--set", "vehicle.initial_position=9", "--set", "guideway.irregularity_on=true",
               "--set", f"ems_*.gain_gap={gain}")
    return folder


@pytest.fixture(scope="module")
def one(runs):
    maglev("report", runs / "usual", "--out", runs / "one.html")
    return runs / "one.html"


@pytest.fixture(scope="module")
def two(runs):
    maglev("report", runs / "usual", runs / "soft", "--out", runs / "two.html")
    return runs / "two.html"


@pytest.fixture
def visit(browser):
    """Opens reports; at the end none may have complained or asked for anything from elsewhere."""
    visits = []

    def open_report(report, **options):
        visits.append(Visit(browser, report, **options))
        return visits[-1]

    yield open_report
    for it in visits:
        it.close()
        it.check()


@pytest.fixture(scope="module")
def opened(browser, one):
    """The first run's report, opened once: drawing in 3D by software takes seconds."""
    it = Visit(browser, one, reduced_motion="reduce")
    yield it
    it.close()


@pytest.fixture
def usual(opened):
    """The same page, as a reader would leave it: at the start, with all of the plots in sight."""
    opened.ask("(it.play(false), it.speed = 0.1, it.seek(0), it.look('quarter'))")
    opened.settle()
    yield opened
    opened.check()


def picture(page, selector, index=0):
    """Pixels of a canvas as an array of rows × columns × RGBA."""
    width, height, data = page.locator(selector).nth(index).evaluate("""(canvas) => {
        const copy = document.createElement("canvas");
        [copy.width, copy.height] = [canvas.width, canvas.height];
        const context = copy.getContext("2d");
        context.drawImage(canvas, 0, 0);
        const { data } = context.getImageData(0, 0, copy.width, copy.height);
        let text = "";
        for (let k = 0; k < data.length; k += 8192) text += String.fromCharCode(...data.subarray(k, k + 8192));
        return [copy.width, copy.height, btoa(text)];
    }""")
    return np.frombuffer(base64.b64decode(data), np.uint8).reshape(height, width, 4).astype(int)


def coloured(pixels):
    """Number of pixels that are neither transparent nor grey: curves, not axes."""
    spread = pixels[..., :3].max(axis=2) - pixels[..., :3].min(axis=2)
    return int(((pixels[..., 3] > 100) & (spread > 60)).sum())


def differs(a, b):
    """Part of the pixels that changed."""
    return float((np.abs(a - b).sum(axis=2) > 24).mean())


PLOT = "#history .chart canvas"
STAGE = "#view .stage canvas"


def test_loads_from_a_file_without_complaints_and_without_network(usual):
    it = usual
    it.view()
    # the settings of this run are not those of the scenario, whose title would not be true
    assert it.page.locator("h1").inner_text() == "Vehicle one-bogie at 5 km/h over 1 span of 25 m"
    changes = it.page.locator(".changes").inner_text()
    assert 'scenario "One bogie over one span at 5 km/h"' in changes and "vehicle.initial_position=9" in changes
    assert it.requests[0] == it.url
    # three.js and its parts come as blobs from within the page
    assert sum(url.startswith("blob:") for url in it.requests) >= 2
    assert it.page.locator("#view .error").count() == 0


def test_plots_have_curves(usual):
    page = usual.page
    assert page.locator(PLOT).count() >= 2 and page.locator("#spectra .chart canvas").count() >= 1
    for k in range(page.locator(".chart canvas").count()):
        # a curve 1.5 px wide across 500 px at least
        assert coloured(picture(page, ".chart canvas", k)) > 500, f"plot {k} is empty"


def test_zoom_pan_and_reset_with_the_mouse(usual):
    page = usual.page
    whole = picture(page, PLOT)
    over = page.locator(".chart .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    y = box["y"] + box["height"] / 2

    def drag(start, end):
        page.mouse.move(box["x"] + start * box["width"], y)
        page.mouse.down()
        page.mouse.move(box["x"] + end * box["width"], y, steps=4)
        page.mouse.up()
        page.mouse.move(2, 2)
        page.wait_for_timeout(60)
        return picture(page, PLOT)

    part = drag(0.3, 0.6)
    assert differs(whole, part) > 0.005
    page.keyboard.down("Shift")
    panned = drag(0.6, 0.3)
    page.keyboard.up("Shift")
    assert differs(part, panned) > 0.005
    over.dblclick()
    page.mouse.move(2, 2)
    page.wait_for_timeout(60)
    # but for the line at the moment that was clicked on
    assert differs(whole, picture(page, PLOT)) < 0.01


def test_plots_by_keyboard(usual):
    page = usual.page
    frame = page.locator(".chart .canvas").first
    whole = picture(page, PLOT)
    page.locator(".skip").focus()
    for _ in range(80):
        page.keyboard.press("Tab")
        if frame.evaluate("(it) => it === document.activeElement"):
            break
    else:
        pytest.fail("the Tab key does not reach the first plot")
    page.keyboard.press("+")
    zoomed = picture(page, PLOT)
    assert differs(whole, zoomed) > 0.005
    page.keyboard.press("ArrowRight")
    assert differs(zoomed, picture(page, PLOT)) > 0.005
    page.keyboard.press("0")
    assert differs(whole, picture(page, PLOT)) == 0
    page.keyboard.press("Shift+ArrowRight")
    assert "time" in page.locator(".chart .where").first.inner_text()


def test_any_signal_can_be_chosen(usual):
    page = usual.page
    picker = page.locator("#history .picker")
    before = page.locator("#chosen .chart").count()
    picker.locator("input[type=search]").fill("lateral_offset")
    assert picker.locator("label:visible").count() == 1
    picker.locator("label:visible input").check()
    assert page.locator("#chosen .chart").count() == before + 1
    assert "lateral_offset_01" in page.locator("#chosen .chart .legend").last.inner_text()
    picker.get_by_role("button", name="vehicle.gap_# (8)").click()
    assert page.locator("#chosen .chart .legend").first.inner_text() != ""
    assert coloured(picture(page, "#chosen canvas")) > 500


def near(pixels, colour):
    """Number of pixels of about that colour, #rrggbb."""
    wanted = np.array([int(colour[k:k + 2], 16) for k in (1, 3, 5)])
    return int((np.abs(pixels[..., :3] - wanted).max(axis=2) < 24).sum())


def test_spectra_mark_the_modes(usual):
    page = usual.page
    spectra = "#spectra .chart canvas"
    mark = page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--mark-girder').trim()")
    amplitude = picture(page, spectra)
    # dashed lines over 240 px at the girder's two modes, and their names
    assert near(amplitude, mark) > 2 * 100
    # which peaks there are is tested where they are found, in Rust
    assert page.locator("#spectra table tbody tr").count() >= 1
    page.get_by_label("Spectrum", exact=True).select_option("density")
    assert differs(amplitude, picture(page, spectra)) > 0.005
    page.get_by_label("Frequency", exact=True).select_option("log")
    usual.settle()
    logarithmic = picture(page, spectra)
    assert near(logarithmic, mark) > 2 * 100
    page.locator("#spectra summary", has_text="Choose signals").click()
    page.locator("#spectra .picker").get_by_role("button", name="none").click()
    assert page.locator(spectra).count() == 0
    # the spectrogram is a picture of many shades, with the modes marked
    pixels = picture(page, "#spectrogram .chart canvas")
    assert len(np.unique(pixels[..., :3].reshape(-1, 3) // 16, axis=0)) > 40


def test_two_runs_are_compared(visit, two):
    it = visit(two)
    page = it.page
    assert page.locator("h1").inner_text() == "2 runs compared"
    labels = page.locator(".chart .legend").first.inner_text()
    assert "usual: " in labels and "soft: " in labels
    entries = page.locator(".chart").first.locator(".legend button")
    both = coloured(picture(page, PLOT))
    # hiding a run's curve takes its pixels away
    entries.nth(1).click()
    assert coloured(picture(page, PLOT)) < both
    # the 3D view shows one of them
    it.ask(f"it.seek({STOP})")
    first = it.ask("it.model.gap(0)")
    page.get_by_label("Run shown").select_option("soft")
    it.view()
    it.ask(f"it.seek({STOP})")
    assert it.ask("it.model.gap(0)") != first
    assert page.locator("#view .view").count() == 1


def test_verdicts_by_criteria_are_shown(visit, runs):
    """The girder under one bogie keeps 1/3800 of its span by far; a limit on the gap below what it is fails."""
    mine = runs / "mine.json"
    gap = {"title": "largest gap", "signal": "vehicle.gap_[01..08]", "figure": "max", "max": 0.001, "source": "<b>a test</b>"}
    mine.write_text(json.dumps({"criteria": {"gap": gap}}))
    maglev("report", runs / "usual", "--criteria", f"cjj-t-262,{mine}", "--out", runs / "judged.html")
    page = visit(runs / "judged.html")
    rows = page.page.evaluate("() => [...document.querySelectorAll('#limits tbody tr')].map((row) => [...row.cells].map((cell) => cell.textContent))")
    (span, gap) = rows
    assert span[0] == "vertical deflection over span" and span[1].startswith("1/") and span[2] == "max 1/3800"
    assert span[4] == "passed" and "middle of span 1" in span[5] and "CJJ/T 262-2017" in span[6]
    assert gap[4] == "FAILED" and "vehicle.gap_" in gap[5] and gap[6] == "<b>a test</b>" and gap[3].startswith("−")
    assert "1 of 2 fail" in page.page.evaluate("() => document.querySelector('#limits .error').textContent")


def test_the_view_draws_what_was_recorded(usual, runs):
    """Gaps, the girder's middle and its quarter, at recorded times, against results.csv."""
    it = usual
    assert it.view().get_attribute("data-ready") == "3d"
    signals = results(runs / "usual")
    for row in (0, 700, -1):
        it.ask("it.seek(args[0])", signals["time"][row])
        # 32-bit floats, and positions of 10 m to 1e-6 m
        for k in (1, 5, 8):
            gap = it.ask("it.model.gap(args[0] - 1)", k)
            assert gap == pytest.approx(signals[f"vehicle.gap_{k:02}"][row], abs=1e-9)
        # 65 points of a sine over 25 m: linear between them errs by (π/64)²/8 at most
        deflection = it.ask("args.map((x) => it.model.deflection(x))", 12.5, 6.25)
        expected = [signals[f"guideway.{place}_displacement_01"][row] for place in ("midspan", "quarter")]
        assert deflection == pytest.approx(expected, rel=3e-4, abs=1e-10)
    assert expected[0] < -4e-4
    # what is drawn: the girder's middle, as many times too low as the slider says
    it.ask("it.refresh()")
    scale = it.ask("it.scale.deflection")
    heights = it.ask("""(() => {
        const { mesh, outline } = it.stage.track.girders[0];
        const z = mesh.geometry.attributes.position;
        return [z.getZ(0), z.getZ((z.count / outline.length >> 1) * outline.length)];
    })()""")
    # the girder's end is drawn 4 cm inside of its bearing
    assert heights[1] - heights[0] == pytest.approx(scale * expected[0], rel=0.01)


def test_the_view_opens_at_the_largest_deflection(visit, one, runs):
    it = visit(one, reduced_motion="reduce")
    it.view()
    signals = results(runs / "usual")
    # of 65 points of the shape one in eight is looked at; the middle is among them
    deepest = max(np.abs(signals["guideway.midspan_displacement_01"]).max(), np.abs(signals["guideway.quarter_displacement_01"]).max())
    assert abs(it.ask("it.model.deflection(12.5)")) >= 0.999 * deepest
    # natural modes of the girder: the second has its node in the middle
    it.page.get_by_label("Motion").select_option("1")
    it.settle()
    largest = it.ask("it.model.amplitude()")
    assert abs(it.ask("it.model.deflection(12.5)")) < 1e-6 * largest
    assert abs(it.ask("it.model.deflection(6.25)")) == pytest.approx(largest, rel=1e-6)
    assert "24.9 Hz" in it.page.locator("#view .words").inner_text()
    it.page.get_by_role("button", name="play").click()
    it.page.wait_for_function("document.querySelector('#view').view.model.phase > 2", timeout=30_000)
    it.page.get_by_label("Motion").select_option("")
    it.settle()
    assert "deflection is drawn" in it.page.locator("#view .words").inner_text()


def test_spectra_of_the_zoomed_window_are_those_of_its_points(visit, one, runs):
    it = visit(one)
    page = it.page
    page.locator(".chart .canvas").first.focus()
    page.keyboard.press("+")
    page.keyboard.press("+")
    page.get_by_label("Part", exact=True).select_option("zoomed")
    page.wait_for_timeout(300)
    view = "document.querySelector('#spectra').view"
    start, end = page.evaluate(f"{view}.charts.length && (() => {{ const text = document.querySelector('#spectra .note').textContent; return text.match(/of ([\\d.]+) s to ([\\d.]+) s/).slice(1).map(Number); }})()")
    signals = results(runs / "usual")
    time = signals["time"]
    name = "guideway.midspan_displacement_01"
    inside = (time >= start - 1e-9) & (time <= end + 1e-9)
    for kind in ("amplitude", "density"):
        page.get_by_label("Spectrum", exact=True).select_option(kind)
        found = page.evaluate(f"{view}.spectra.get('{name}').map((it) => [[...it.x], [...it.y]])[0]")
        values, rate = signals[name][inside], 1 / (time[1] - time[0])
        if kind == "amplitude":
            window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(len(values)) / len(values))
            expected = 2 * np.abs(np.fft.rfft(window * (values - values.mean()))) / window.sum()
        else:
            length = max(len(values) // 4, 8)
            window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length)
            pieces = [values[k:k + length] for k in range(0, len(values) - length + 1, length - length // 2)]
            expected = np.mean([2 * np.abs(np.fft.rfft(window * (it - it.mean()))) ** 2 for it in pieces], axis=0) / (rate * (window ** 2).sum())
        # 32-bit floats in the page
        near = slice(1, len(expected) // 4)
        assert found[1][:len(expected) // 4 - 1] == pytest.approx(list(expected[near]), rel=2e-3, abs=1e-4 * expected.max())


def test_labels_of_near_modes_do_not_overlap(visit, one):
    it = visit(one)
    overlaps = it.page.evaluate("""async () => {
        const chart = document.querySelector("#spectra .canvas").chart;
        const first = chart.marks[0];
        chart.marks = Array.from({ length: 7 }, (_, k) => ({ ...first, at: first.at * (1 + 0.002 * k), label: `a mode at about ${k} Hz` }));
        chart.plot.redraw();
        await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
        const boxes = chart.places.taken;
        const over = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
        return [boxes.length, boxes.filter((a, k) => boxes.some((b, j) => j > k && over(a, b))).length];
    }""")
    assert overlaps == [7, 0]


def test_many_runs_are_sorted_and_print_whole(visit, runs, tmp_path):
    """Folders as a pattern gives them: 10 before 2. Key figures are a row per run; curves keep their legend."""
    names = ["gain-1", "gain-10", "gain-2", "gain-3", "gain-4", "gain-5", "gain-6", "gain-7", "gain-8", "gain-9"]
    for name in names:
        shutil.copytree(runs / ("usual" if name == "gain-1" else "soft"), tmp_path / name)
    maglev("report", *(tmp_path / name for name in names), "--out", tmp_path / "many.html", "--title", "Ten <gains>")
    it = visit(tmp_path / "many.html", width=1000)
    page = it.page
    assert page.locator("h1").inner_text() == "Ten <gains>" and page.title() == "Ten <gains>"
    heads = page.evaluate("() => [...document.querySelectorAll('table.many tbody th')].map((cell) => cell.textContent)")
    assert heads == [f"gain-{k}" for k in range(1, 11)]
    cells = page.evaluate("() => [...document.querySelectorAll('table.many tbody tr:nth-child(2) td')].map((cell) => cell.textContent)")
    columns = page.evaluate("() => [...document.querySelectorAll('table.many thead th')].map((cell) => cell.textContent)").index("Computing speed")
    # the speed of the computer is not compared
    assert "%" not in cells[columns - 1] and any("%" in text or "=" in text for text in cells)
    legend = page.locator("#history .chart").first.locator(".legend .entry")
    assert legend.count() >= 10 and "gain-10: " in legend.nth(9).inner_text()
    page.set_viewport_size({"width": 700, "height": 990})
    page.emulate_media(media="print")
    cut = page.evaluate("() => [...document.querySelectorAll('.scroll')].filter((box) => box.scrollWidth > box.clientWidth + 1).map((box) => box.getAttribute('aria-label'))")
    assert cut == []
    assert legend.nth(9).is_visible() and legend.nth(9).locator("svg").is_visible()
    # nothing is chosen below this heading
    page.wait_for_function("() => [...document.querySelectorAll('h3')].filter((it) => it.textContent === 'Recorded signals').every((it) => getComputedStyle(it).display === 'none')", timeout=30_000)


# Tables at 0, L/4, L/2, 3L/4 and L: a wave, with its node where the middle is recorded, and an arch or a shape
# with a node there, too
TABLES = {"arch": [0, 0.7, 1, 0.7, 0], "node": [0, 0.5, 0, 0.5, 0]}


@pytest.mark.parametrize("second", TABLES)
def test_a_girder_with_tabulated_shapes_is_drawn(visit, runs, tmp_path, second):
    """Issue 12: shapes whose nodes are where deflections are recorded were divided by zero, and drawn so."""
    folder = tmp_path / "run"
    shutil.copytree(runs / "usual", folder)
    scenario = json.loads((folder / "scenario-as-run.json").read_text())
    unit = scenario["units"]["guideway"]
    with zipfile.ZipFile(unit if isinstance(unit, str) else unit["path"]) as old, zipfile.ZipFile(tmp_path / "guideway.fmu", "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "resources/guideway.json":
                layout = json.loads(content)
                girder = next(iter(layout["girders"].values()))
                x = [k * girder["length"] / 4 for k in range(5)]
                girder["shapes"] = [{"modal_mass": 3e4, "x": x, "phi": phi} for phi in ([0, 1, 0, -1, 0], TABLES[second])]
                content = json.dumps(layout)
            new.writestr(name, content)
    scenario["units"]["guideway"] = str(tmp_path / "guideway.fmu")
    (folder / "scenario-as-run.json").write_text(json.dumps(scenario))
    maglev("report", folder, "--out", tmp_path / "tables.html")
    it = visit(tmp_path / "tables.html", reduced_motion="reduce")
    assert it.view().get_attribute("data-ready") == "3d"
    factor = it.page.locator("#view .words").inner_text().split("deflection is drawn ")[1].split(" times")[0]
    assert float(factor) >= 1
    signals = results(folder)
    it.ask(f"it.seek({STOP})")
    drawn = it.ask("args.map((x) => it.model.deflection(x))", 12.5, 6.25)
    middle, quarter = (signals[f"guideway.{place}_displacement_01"][-1] for place in ("midspan", "quarter"))
    # 32-bit floats; without an arch the shapes cannot show the middle
    assert drawn == pytest.approx([middle if second == "arch" else 0, quarter], rel=1e-4, abs=1e-10)
    for camera in ("side", "quarter", "under", "magnet", "ahead"):
        it.ask("it.look(args[0])", camera)
        it.settle()
        assert free_sight(it) > 0.5, camera
        # a train, and not one shade of sky and ground
        shades = np.unique(picture(it.page, STAGE)[..., :3].reshape(-1, 3) // 8, axis=0)
        assert len(shades) > 100, f"{camera}: {len(shades)} shades"


def free_sight(it):
    """How far the camera is from what it looks at or stands in (m): the nearest surface around it."""
    return it.ask("""(() => {
        const { THREE, camera, scene } = it.stage;
        const ray = new THREE.Raycaster();
        const ways = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
        const hits = ways.flatMap((way) => {
            ray.set(camera.position, new THREE.Vector3(...way));
            return ray.intersectObjects(scene.children, true).map((hit) => hit.distance);
        });
        return Number.isFinite(camera.position.length()) ? Math.min(100, ...hits) : 0;
    })()""")


def where(it, k):
    """Where the camera sees magnet k (from 0): −1 … 1 both ways within the picture."""
    return it.ask("""(() => {
        const point = new it.stage.camera.position.constructor();
        const [x, y, z] = it.model.data.magnets[args[0]].position;
        point.set(it.model.travelled() + x, y, z + it.model.lift(args[0], it.scale)).project(it.stage.camera);
        return [point.x, point.y];
    })()""", k)


def test_the_view_is_a_picture_of_train_and_girder(usual):
    it = usual
    it.view()
    pixels = picture(it.page, STAGE)
    # sky, ground, concrete, steel, white car, colours of magnets: far from a plain area
    shades = np.unique(pixels[..., :3].reshape(-1, 3) // 16, axis=0)
    assert len(shades) > 60


def test_sliders_change_what_is_drawn(usual):
    it = usual
    page = it.page
    it.ask(f"it.seek({STOP})")
    it.settle()
    before = picture(page, STAGE)
    words = page.locator("#view .words").inner_text()
    slider = page.get_by_label("Exaggeration of deflection")
    slider.focus()
    page.keyboard.press("End")
    it.settle()
    bent = picture(page, STAGE)
    assert differs(before, bent) > 0.02
    assert "2000 times too large" in page.locator("#view .words").inner_text() != words
    page.get_by_label("Exaggeration of gaps").focus()
    page.keyboard.press("Home")
    it.settle()
    assert differs(bent, picture(page, STAGE)) > 0.002
    assert "motion on the girders true to scale" in page.locator("#view .words").inner_text()
    page.get_by_label("Speed of time").focus()
    page.keyboard.press("Home")
    assert it.ask("it.speed") == pytest.approx(0.001)


def test_time_is_shared_with_the_plots(usual):
    it = usual
    page = it.page
    it.view()
    before = picture(page, PLOT)
    slider = page.get_by_label("Time", exact=True)
    slider.evaluate("(it) => { it.value = 0.9; it.dispatchEvent(new Event('input')); }")
    it.settle()
    # a line 1.5 px wide and 150 px high
    marked = np.abs(picture(page, PLOT) - before).sum(axis=2) > 24
    assert marked.any(axis=1).sum() > 100 and 0 < marked.any(axis=0).sum() < 12
    page.locator(".chart .u-over").first.click(position={"x": 100, "y": 60})
    it.settle()
    shown = float(page.locator("#view .clock").inner_text().split()[0])
    assert 0 < shown < 0.5 and it.ask("it.model.frame.time") == pytest.approx(shown, abs=0.006)


def test_it_plays_and_stops(usual):
    it = usual
    page = it.page
    it.ask("it.speed = 0.2")
    page.get_by_role("button", name="play").click()
    page.wait_for_function("document.querySelector('#view').view.model.frame.time > 0.1", timeout=30_000)
    page.get_by_role("button", name="stop").click()
    it.settle()
    halted = it.ask("it.model.frame.time")
    page.wait_for_timeout(150)
    assert it.ask("it.model.frame.time") == halted
    # to the end, where it stops by itself
    it.ask("it.speed = 10")
    page.get_by_role("button", name="play").click()
    page.wait_for_function("!document.querySelector('#view').view.playing", timeout=30_000)
    assert it.ask("it.model.frame.time") == pytest.approx(STOP)


def test_the_view_by_keyboard(usual):
    it = usual
    page = it.page
    it.view()
    page.locator(STAGE).focus()
    page.keyboard.press("ArrowRight")
    # a frame a millisecond, as recorded
    assert it.ask("it.model.frame.time") == pytest.approx(1e-3)
    page.keyboard.press("Shift+ArrowRight")
    assert it.ask("it.model.frame.time") == pytest.approx(1.001)
    page.keyboard.press("ArrowLeft")
    assert it.ask("it.model.frame.time") == pytest.approx(1.0)
    page.keyboard.press("End")
    assert it.ask("it.model.frame.time") == pytest.approx(STOP)
    page.keyboard.press("Home")
    page.keyboard.press(" ")
    page.wait_for_function("document.querySelector('#view').view.model.frame.time > 0", timeout=30_000)
    page.keyboard.press(" ")
    assert not it.ask("it.playing")
    assert "mm" in page.locator(STAGE).get_attribute("aria-label")


def test_cameras(usual):
    it = usual
    page = it.page
    it.view()
    seen = []
    for key, name in [("1", "side"), ("3", "under"), ("4", "magnet"), ("5", "ahead"), ("2", "quarter")]:
        page.locator(STAGE).focus()
        page.keyboard.press(key)
        it.settle()
        seen.append(picture(page, STAGE))
        assert page.locator(f"[data-camera={name}]").get_attribute("aria-pressed") == "true"
        # the near side's magnets; close to one, the others may lie outside
        looked_at = [it.ask("it.stage.nearest()")] if name == "magnet" else range(4, 8)
        assert max(abs(part) for k in looked_at for part in where(it, k)) < 1, name
    for k, picture_of in enumerate(seen[1:]):
        assert differs(seen[k], picture_of) > 0.05
    # following the train keeps the camera beside it
    away = "(it.stage.camera.position.x - it.model.travelled())"
    beside = it.ask(away)
    it.ask(f"(it.seek({STOP}), it.refresh())")
    assert it.ask(away) == pytest.approx(beside, abs=1e-6)
    page.get_by_label("follow the train").uncheck()
    it.ask("(it.seek(0), it.refresh())")
    assert it.ask(away) > beside + 1


def test_dark_mode_and_print(visit, one):
    it = visit(one, color_scheme="dark")
    page = it.page
    it.view()

    def ground():
        colour = page.evaluate("getComputedStyle(document.body).backgroundColor")
        return sum(int(part) for part in colour[4:-1].split(",")[:3]) / 3

    dark = picture(page, STAGE)
    assert ground() < 60 and dark[:20, :20, :3].mean() < 60
    page.emulate_media(color_scheme="light")
    it.settle()
    assert ground() > 200 and picture(page, STAGE)[:20, :20, :3].mean() > 200
    # the button overrules the system
    page.locator("#theme").click()
    page.locator("#theme").click()
    it.settle()
    assert ground() < 60
    page.emulate_media(media="print")
    assert not page.locator(".picker").first.is_visible()
    assert not page.get_by_role("button", name="play").is_visible()
    assert page.locator(STAGE).is_visible() and page.locator(PLOT).first.is_visible()
    assert len(page.pdf()) > 50_000


def test_a_narrow_window_shows_everything(visit, one):
    it = visit(one, width=380, height=800)
    it.view()
    wide = it.page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert wide[0] <= wide[1]
    assert coloured(picture(it.page, PLOT)) > 200
    reach = it.page.locator(STAGE).bounding_box()
    assert reach["width"] > 300 and reach["x"] >= 0
    # and grows with the window
    it.page.set_viewport_size({"width": 1000, "height": 800})
    it.page.wait_for_timeout(200)
    assert it.page.locator(STAGE).bounding_box()["width"] > 800


def test_without_webgl_there_is_the_side_view(visit, one):
    it = visit(one, script="""
        const real = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
          return kind.startsWith("webgl") ? null : real.call(this, kind, ...rest);
        };""")
    page = it.page
    assert it.view().get_attribute("data-ready") == "flat"
    assert "no WebGL" in page.locator("#view .error").inner_text()
    start = picture(page, STAGE)
    assert len(np.unique(start[..., :3].reshape(-1, 3) // 16, axis=0)) > 8
    page.locator(STAGE).focus()
    page.keyboard.press("End")
    page.get_by_label("follow the train").uncheck()
    page.keyboard.press("Home")
    it.settle()
    page.get_by_label("Exaggeration of deflection").focus()
    page.keyboard.press("End")
    it.settle()
    assert differs(start, picture(page, STAGE)) > 0.01


def test_what_is_hostile_in_a_scenario_stays_text(visit, tmp_path):
    evil = "</script><img src=x onerror='window.pwned = 1'><b>&amp;\u2028${window.pwned = 2}"
    scenario = json.loads((ROOT / "scenarios" / "one-bogie.json").read_text())
    folder = ROOT / "scenarios"
    scenario["units"] = {name: str((folder / path).resolve()) for name, path in scenario["units"].items()}
    scenario.pop("$schema", None)
    scenario["title"] = scenario["description"] = evil
    scenario["plots"] = [{"file": "x.svg", "title": evil,
                          "panels": [{"ylabel": evil, "signals": ["vehicle.gap_01"], "labels": [evil]}]}]
    (tmp_path / "s.json").write_text(json.dumps(scenario))
    maglev("run", tmp_path / "s.json", "--out", tmp_path / "out", "--stop", 0.02, "--no-report")
    maglev("report", tmp_path / "out", "--out", tmp_path / "r.html")
    it = visit(tmp_path / "r.html")
    it.view()
    assert it.page.locator("h1").inner_text().startswith("</script><img")
    assert it.page.evaluate("window.pwned === undefined && document.querySelector('img') === null")


def test_a_failed_run_shows_its_error(visit, tmp_path):
    crossed = {"ems_01.limit_voltage": True, "ems_01.voltage_min": 300.0}
    scenario = {"extends": str(ROOT / "scenarios" / "one-bogie.json"), "events": [{"name": "limits crossed", "at": 1.0, "set": crossed}]}
    (tmp_path / "s.json").write_text(json.dumps(scenario))
    done = maglev("run", tmp_path / "s.json", "--out", tmp_path / "out", "--stop", 2, "--no-report", status=1)
    maglev("report", tmp_path / "out", "--out", tmp_path / "r.html")
    it = visit(tmp_path / "r.html")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "failed" and done.stderr
    shown = it.page.locator("main .error[role=alert]").inner_text()
    for cause in summary["error"]["causes"]:
        assert cause in shown
    assert "failed" in it.page.locator(".badge").inner_text()
    assert coloured(picture(it.page, PLOT)) > 100


def test_a_run_that_a_magnet_at_the_rail_ends_shows_why(visit, tmp_path):
    maglev("run", ROOT / "scenarios" / "one-bogie.json", "--out", tmp_path / "out", "--stop", 2, "--no-report",
           "--set", "ems_*.gain_gap=-7", "--set", "ems_*.gain_gap_velocity=-40")
    maglev("report", tmp_path / "out", "--out", tmp_path / "r.html")
    it = visit(tmp_path / "r.html")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "terminated" and "reached the rail" in summary["ended_by"]
    assert summary["ended_by"] in it.page.locator("main").inner_text()
    assert it.page.locator("main .error[role=alert]").count() == 0


def test_a_record_is_drawn_beside_the_run(runs, visit):
    """Its curves are in the plots of the run, and its section has tables and pictures."""
    signals = results(runs / "usual")
    rows = zip(signals["time"], signals["vehicle.gap_01"], strict=True)
    record = runs / "gap.csv"
    record.write_text("t (ms),gap\n" + "".join(f"{1e3 * t},{1e3 * gap + 0.01}\n" for t, gap in rows))
    maglev("report", runs / "usual", "--out", runs / "measured.html", "--measured", record,
           "--time-column", "t (ms)", "--map", "gap=vehicle.gap_01:mm")
    it = visit(runs / "measured.html")
    section = it.page.locator("#measured")
    assert "gap.csv" in section.inner_text() and section.locator("table").count() == 2
    assert section.locator("img").count() == 3
    # the pictures are pictures
    section.locator("img").evaluate_all("(all) => all.forEach((one) => { one.loading = 'eager'; })")
    it.page.wait_for_function("[...document.querySelectorAll('#measured img')].every((one) => one.naturalWidth > 500)")
    assert "measured" in it.page.locator(".badge.measured").inner_text()
    assert it.page.get_by_text("gap.csv: ").count() > 0
    found = json.loads((runs / "measured.json").read_text())[0]["signals"][0]
    assert found["rms_error"] == pytest.approx(1e-5, rel=1e-6)
