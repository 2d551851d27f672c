"""The report of a study in a browser: what it draws is what metrics.csv holds.

The study is written here, with figures in closed form, so that every statement of the page can be checked.
"""

import json
import math
import warnings

import numpy as np
import pytest

import browser as chromium
from browser import Visit
from conftest import maglev

SPEEDS = [1, 2, 5, 10, 20, 40]
GAINS = [4.5, 5, 5.5, 6, 6.5, 7]
SEEDS = 4


def point(speed, gain, seed):
    """Unstable below a gain of 5.2; a figure that grows with the speed, and one that falls with the gain."""
    if gain < 5.2:
        return "failed", None, None
    noise = 0.02 * (seed - 1.5)
    return "finished", 1e-3 * (1 + 0.05 * speed) * (1 + noise), 1e-3 * 12 / gain * (1 + 0.01 * speed)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "speed-and-gain"
    folder.mkdir()
    columns = [
        {"name": "speed", "kind": "factor", "unit": "km/h", "title": "speed"},
        {"name": "gain", "kind": "factor", "unit": "1", "title": "gap gain"},
        {"name": "seed", "kind": "factor", "unit": "", "title": "seed", "seeds": True},
        {"name": "rms", "kind": "objective", "unit": "m", "title": "RMS of the gap"},
        {"name": "deflection", "kind": "limit", "unit": "m", "title": "deflection"},
    ]
    hostile = "<img src=x onerror='window.pwned = 1'>"
    text = {"title": "Speed and gain", "description": hostile, "factors": {"seed": {"seeds": SEEDS}}, "design": {"kind": "grid"},
            "limits": {"deflection": {"max": 0.0024}}, "as_run": {"name": "x", "points": 144, "columns": columns}}
    (folder / "study.json").write_text(json.dumps(text))
    rows, number = ["point,speed,gain,seed,status,rms,deflection,limits,reached,run"], 0
    for speed in SPEEDS:
        for gain in GAINS:
            for seed in range(SEEDS):
                number += 1
                status, rms, deflection = point(speed, gain, seed)
                verdict = "" if rms is None else "passed" if deflection <= 0.0024 else "failed"
                rows.append(f"{number},{speed},{gain},{1000 + seed},{status},{'' if rms is None else rms},{'' if rms is None else deflection},{verdict},22,a{number}")
    (folder / "metrics.csv").write_text("\n".join(rows) + "\n")
    (folder / "failures.csv").write_text('point,run,status,message\n1,a1,failed,"the magnet touched the rail"\n')
    (folder / "runs" / "a9").mkdir(parents=True)
    (folder / "runs" / "a9" / "report.html").write_text("<!doctype html><title>point 9</title>")
    maglev("study", "report", folder)
    return folder


@pytest.fixture(scope="module")
def page(study):
    try:
        with chromium.launched() as browser:
            it = Visit(browser, study / "report.html", width=1100, height=900, color_scheme="light")
            yield it
            it.close()
            it.check()
    except chromium.NoBrowser as why:
        warnings.warn(f"THE REPORT OF STUDIES IS NOT TESTED: {why}", stacklevel=1)
        pytest.skip(f"THE REPORT OF STUDIES IS NOT TESTED: {why}")


def view(page, section, script, *arguments):
    return page.page.evaluate(f"(args) => ((it, args) => {script})(document.querySelector('#{section}').view, args)", list(arguments))


def cells(page, selector):
    return page.page.evaluate(f"() => [...document.querySelectorAll('{selector} tbody tr')].map((row) => [...row.cells].map((cell) => cell.textContent))")


def test_the_head_counts_points(page):
    text = page.page.locator("main").inner_text()
    assert page.page.locator("h1").inner_text() == "Speed and gain"
    failed = sum(gain < 5.2 for gain in GAINS) * len(SPEEDS) * SEEDS
    assert f"{144 - failed} finished" in text and f"{failed} failed" in text
    assert "<img src=x" in text and page.page.evaluate("window.pwned === undefined")


def test_the_map_shows_means_over_seeds_and_the_boundary_of_stability(page):
    values = view(page, "map", "it.surface.xs.map((_, i) => it.surface.ys.map((_, j) => it.surface.value(i, j)))")
    for i, speed in enumerate(SPEEDS):
        for j, gain in enumerate(GAINS):
            expected = [point(speed, gain, seed)[1] for seed in range(SEEDS)]
            if expected[0] is None:
                assert values[i][j] is None or math.isnan(values[i][j])
            else:
                assert values[i][j] == pytest.approx(1e3 * np.mean(expected), rel=1e-9)
    # the boundary lies between the gains 5 and 5.5, at every speed: half way of the interpolated part
    red = view(page, "map", "[...it.picture.box.querySelectorAll('polyline[stroke=\"#d50000\"]')].map((line) => line.getAttribute('points'))")
    assert len(red) == len(SPEEDS) - 1
    heights = {float(place.split(",")[1]) for line in red for place in line.split()}
    assert max(heights) - min(heights) < 0.2
    low, high = (view(page, "map", "it.picture.drawn(true).y(args[0])", gain) for gain in (5, 5.5))
    assert heights.pop() == pytest.approx((low + high) / 2, abs=0.2)
    # another figure over seeds, and the surface
    page.page.locator("#map").get_by_label("Of several points").select_option("largest")
    largest = view(page, "map", "it.surface.value(0, 5)")
    assert largest == pytest.approx(1e3 * point(1, 7, SEEDS - 1)[1], rel=1e-9)
    page.page.locator("#map").get_by_label("View").select_option("surface")
    assert page.page.locator("#map svg polygon").count() > 10
    page.page.locator("#map").get_by_label("View").select_option("map")


def test_sobol_indices_say_how_they_were_computed(page):
    text = page.page.locator("#effects").inner_text()
    # 12 settings failed, so that the grid is not complete
    assert "polynomial chaos" in text and "Left out: 12 of 36 settings" in text and "due to their seeds alone" in text
    rows = {row[0]: float(row[1].split(" ")[0]) for row in cells(page, "#effects")}
    # the figure depends on the speed and the seed only
    assert rows["speed"] > 0.99 and rows["gap gain"] < 0.01
    page.page.locator("#effects").get_by_label("Figure").select_option(label="ended early or failed")
    text = page.page.locator("#effects").inner_text()
    assert "complete grid" in text
    rows = {row[0]: float(row[1].split(" ")[0]) for row in cells(page, "#effects")}
    assert rows == {"speed": 0, "gap gain": 1}


def test_quantiles_and_pareto_front(page):
    groups = view(page, "quantiles", "[...it.groups].map(([x, list]) => [x, [...list]])")
    assert [x for x, _ in groups] == SPEEDS and all(len(list_) == SEEDS for _, list_ in groups)
    gain = GAINS[len(GAINS) // 2]
    assert groups[3][1] == pytest.approx([point(10, gain, seed)[1] for seed in range(SEEDS)], rel=1e-12)
    table = cells(page, "#pareto")
    # at the lowest speed and the highest gain both figures are smallest: it beats all others
    assert len(table) == 1 and table[0][1:3] == ["1", "7"]
    page.page.locator("#pareto").get_by_label("better up").select_option("-1")
    # larger deflections: higher speeds and lower gains, at the price of the first figure
    assert [row[1] for row in cells(page, "#pareto")] == [str(speed) for speed in SPEEDS]


def test_the_table_sorts_filters_and_links(page):
    it = page.page
    box = it.get_by_label("Filter the points")
    box.fill("speed>10 status=finished")
    wanted = sum(speed > 10 and gain > 5.2 for speed in SPEEDS for gain in GAINS) * SEEDS
    assert len(cells(page, "#points")) == wanted and f"{wanted} of 144 points" in it.locator("#points").inner_text()
    it.locator("#points thead button", has_text="RMS").click()
    figures = [float(row[5]) for row in cells(page, "#points")]
    assert figures == sorted(figures)
    it.locator("#points thead button", has_text="RMS").click()
    assert [float(row[5]) for row in cells(page, "#points")] == sorted(figures, reverse=True)
    box.fill("touched")
    assert [row[0] for row in cells(page, "#points")] == ["1"]
    box.fill("point=9")
    assert it.locator("#points a").get_attribute("href") == "runs/a9/report.html"
    box.fill("")
    # figures that are missing come last
    assert cells(page, "#points")[-1][4] == "failed"


def test_a_range_in_parallel_coordinates_selects_points(page):
    it = page.page
    svg = it.locator("[data-picture=parallel-coordinates] svg")
    svg.scroll_into_view_if_needed()
    box = svg.bounding_box()
    x, top, bottom = view(page, "relations", "[it.xOf(1, it.drawing) / it.drawing.width, it.drawing.top / it.drawing.height, 1 - it.drawing.bottom / it.drawing.height]")
    # the upper half of the axis of the gain: above 5.75
    it.mouse.move(box["x"] + x * box["width"], box["y"] + (top + (bottom - top) / 2) * box["height"])
    it.mouse.down()
    it.mouse.move(box["x"] + x * box["width"], box["y"] + (top - 0.02) * box["height"], steps=3)
    it.mouse.up()
    wanted = sum(gain > 5.75 for gain in GAINS) * len(SPEEDS) * SEEDS
    assert f"{wanted} of 144 points selected" in it.locator("#relations").inner_text()
    assert f"{wanted} of 144 points" in it.locator("#points").inner_text()
    it.get_by_role("button", name="show all").click()
    assert "144 of 144 points selected" in it.locator("#relations").inner_text()


def test_pictures_are_files_for_papers(page):
    names = page.page.evaluate("() => [...document.querySelectorAll('[data-picture]')].filter((it) => !it.hidden).map((it) => it.dataset.picture)")
    assert names == ["map", "sobol-indices", "main-effects", "quantiles", "pareto-front", "scatter", "parallel-coordinates"]
    import xml.etree.ElementTree as xml
    for name in names:
        text = page.page.evaluate("(name) => document.querySelector(`[data-picture=${name}]`).picture.text()", name)
        root = xml.fromstring(text)
        # complete without the page: colours and sizes are in the file
        assert root.tag.endswith("svg") and root.get("width") and "var(" not in text and "NaN" not in text
    with page.page.expect_download() as download:
        page.page.locator("[data-picture=map] .action").click()
    assert download.value.suggested_filename == "map.svg"


def test_it_prints_whole(page):
    it = page.page
    it.set_viewport_size({"width": 700, "height": 990})
    it.emulate_media(media="print")
    cut = it.evaluate("() => [...document.querySelectorAll('.scroll')].filter((box) => box.scrollWidth > box.clientWidth + 1).map((box) => box.getAttribute('aria-label'))")
    assert cut == []
    assert not it.get_by_label("Filter the points").is_visible()
    assert len(it.pdf(format="A4")) > 50_000
    it.emulate_media(media="screen")
    it.set_viewport_size({"width": 1100, "height": 900})


def test_a_folder_that_is_no_study_is_refused(tmp_path):
    done = maglev("study", "report", tmp_path, status=2)
    assert "study.json" in done.stderr and "maglev study run" in done.stderr
