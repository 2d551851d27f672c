// A figure over two factors: as a map with contours and the boundary of stability, or as a surface.

const OVER = {
  mean: ["mean", (list) => meanOf(list)],
  median: ["median", (list) => quantile(list, 0.5)],
  high: ["95 % quantile", (list) => quantile(list, 0.95)],
  largest: ["largest", (list) => list[list.length - 1]],
  smallest: ["smallest", (list) => list[0]],
};
/** Most values of a factor that are nodes of a map. */
const NODES = 80;

/** 1 for points that break a limit or did not end well, 0 for those that keep all, NaN where that is not known. */
const BROKEN = Float64Array.from({ length: points.count }, (_, k) => ({ passed: 0, failed: 1 })[points.verdict(k)] ?? (points.well[k] ? NaN : 1));

const fits = new Map();

/** The fit of second degree of values at all points. */
function fitOf(values) {
  if (!fits.has(values)) fits.set(values, quadratic(Array.from({ length: points.count }, (_, k) => points.factors.map((it) => it.values[k])), values));
  return fits.get(values);
}

/** A function of two indices, computed once for each pair. */
function tabled(xs, ys, of) {
  const table = xs.map((_, i) => Float64Array.from(ys, (__, j) => of(i, j)));
  return (i, j) => table[i][j];
}

class MapView {
  constructor(parent) {
    const { factors } = points;
    this.across = factors[0];
    this.up = factors[1];
    this.figure = allFigures()[0];
    this.over = "mean";
    this.form = "map";
    this.turn = 35;
    this.slices = new Map();
    this.choices = element("div", { class: "choices" });
    parent.append(this.choices);
    this.note = element("p", { class: "note" });
    this.picture = new Picture(parent, { id: "map", label: "A figure over two factors", size: { height: 470, right: 100, top: 26 }, draw: (drawing) => this.draw(drawing) });
    parent.append(this.note);
    this.change();
  }

  /** Nodes of a grid if there are few values of both factors and most combinations occur. */
  gridded() {
    const [xs, ys] = [levelsOf(this.across), levelsOf(this.up)];
    if (xs.length > NODES || ys.length > NODES) return false;
    const cells = new Set();
    for (let k = 0; k < points.count; k++) cells.add(`${this.across.values[k]} ${this.up.values[k]}`);
    return cells.size >= 0.6 * xs.length * ys.length;
  }

  others() {
    return points.factors.filter((it) => it !== this.across && it !== this.up);
  }

  change() {
    const redo = (set) => (value) => { set(value); this.change(); };
    const { factors } = points;
    const grid = this.gridded();
    this.choices.replaceChildren(
      columnChoice("Figure", allFigures(), this.figure, redo((it) => { this.figure = it; })),
      columnChoice("Across", factors, this.across, redo((it) => { if (it === this.up) this.up = this.across; this.across = it; })),
      columnChoice("Up", factors, this.up, redo((it) => { if (it === this.across) this.across = this.up; this.up = it; })),
      choice("View", [["map", "map"], ["surface", "surface"]], this.form, redo((it) => { this.form = it; })));
    if (grid) {
      this.choices.append(choice("Of several points", Object.entries(OVER).map(([key, [text]]) => [key, text]), this.over, redo((it) => { this.over = it; })));
      for (const factor of this.others()) {
        const levels = [...levelsOf(factor)];
        const options = [["all", "all"], ...levels.map((value) => [value, `${textOf(factor, value)} ${shownOf(factor).unit}`.trim()])];
        if (levels.length <= NODES) this.choices.append(choice(factor.title, options, this.slices.get(factor) ?? "all", redo((it) => (it === "all" ? this.slices.delete(factor) : this.slices.set(factor, Number(it))))));
      }
    } else {
      for (const factor of this.others()) this.choices.append(this.slider(factor));
    }
    if (this.form === "surface") {
      const input = element("input", { type: "range", min: 0, max: 360, step: 5, value: this.turn, "aria-label": "Turn" });
      input.addEventListener("input", () => { this.turn = Number(input.value); this.picture.redraw(); });
      this.choices.append(element("label", { class: "choice" }, "Turn ", input));
    }
    this.surface = grid ? this.nodes() : this.fitted();
    this.picture.redraw();
    this.say();
  }

  /** The value of a factor at which the fit is cut. */
  cutAt(factor) {
    factor.median ??= quantile(Float64Array.from(factor.values).sort(), 0.5);
    return this.slices.get(factor) ?? factor.median;
  }

  slider(factor) {
    const sorted = levelsOf(factor);
    const [low, high] = [sorted[0], sorted[sorted.length - 1]];
    const value = element("output", {}, textOf(factor, this.cutAt(factor), 4));
    const input = element("input", { type: "range", min: low, max: high, step: (high - low) / 100 || 1, value: this.cutAt(factor), "aria-label": factor.title });
    input.addEventListener("input", () => {
      this.slices.set(factor, Number(input.value));
      value.textContent = textOf(factor, Number(input.value), 4);
      this.surface = this.fitted();
      this.picture.redraw();
    });
    return element("label", { class: "choice" }, `${titleOf(factor)} `, input, " ", value);
  }

  /** The study's own points, grouped by the two factors. */
  nodes() {
    const [xs, ys] = [[...levelsOf(this.across)], [...levelsOf(this.up)]];
    const [column, row] = [new Map(xs.map((it, k) => [it, k])), new Map(ys.map((it, k) => [it, k]))];
    const cells = xs.map(() => ys.map(() => ({ values: [], lost: 0, bad: 0, judged: 0, count: 0 })));
    for (let k = 0; k < points.count; k++) {
      if ([...this.slices].some(([factor, value]) => factor !== this.across && factor !== this.up && factor.values[k] !== value)) continue;
      const cell = cells[column.get(this.across.values[k])][row.get(this.up.values[k])];
      cell.count++;
      cell.lost += 1 - points.well[k];
      if (Number.isFinite(this.figure.values[k])) cell.values.push(this.figure.values[k]);
      const verdict = points.verdict(k);
      if (verdict === "passed" || verdict === "failed") cell.judged++;
      if (verdict === "failed") cell.bad++;
    }
    const { factor } = shownOf(this.figure);
    const of = ({ values }) => (values.length ? factor * OVER[this.over][1](Float64Array.from(values).sort()) : NaN);
    return {
      xs, ys, grid: true, cells,
      value: tabled(xs, ys, (i, j) => of(cells[i][j])),
      lost: (i, j) => (cells[i][j].count ? cells[i][j].lost / cells[i][j].count : NaN),
      // a point that failed keeps no limit
      bad: (i, j) => { const it = cells[i][j]; return it.judged + it.lost ? (it.bad + it.lost) / Math.max(it.judged + it.lost, 1) : NaN; },
    };
  }

  /** The fit of second degree, cut at the values of the other factors. */
  fitted() {
    const { factors } = points;
    const fit = fitOf(this.figure.values);
    const lost = someLost ? fitOf(LOST.values) : null;
    const bad = BROKEN.includes(0) && BROKEN.includes(1) ? fitOf(BROKEN) : null;
    const span = (column) => { const levels = levelsOf(column); return Array.from({ length: 41 }, (_, k) => levels[0] + ((levels[levels.length - 1] - levels[0]) * k) / 40); };
    const [xs, ys] = [span(this.across), span(this.up)];
    const cuts = factors.map((it) => this.cutAt(it));
    const row = (i, j) => factors.map((it, n) => (it === this.across ? xs[i] : it === this.up ? ys[j] : cuts[n]));
    const { factor } = shownOf(this.figure);
    const of = (it, scale = 1) => tabled(xs, ys, (i, j) => (it ? scale * it.at(row(i, j)) : NaN));
    return { xs, ys, fit, lostFit: lost, value: of(fit, factor), lost: of(lost), bad: of(bad) };
  }

  /** Lowest and highest value, in the shown unit. */
  range() {
    const { xs, ys, value } = this.surface;
    const all = xs.flatMap((_, i) => ys.map((__, j) => value(i, j))).filter(Number.isFinite);
    if (all.length === 0) return [0, 1];
    const [low, high] = [Math.min(...all), Math.max(...all)];
    return high > low ? [low, high] : [low - Math.abs(low) * 0.01 - 1e-12, high + Math.abs(high) * 0.01 + 1e-12];
  }

  say() {
    const { grid, fit, lostFit } = this.surface;
    if (grid) {
      const more = points.seeds.length > 0 || this.others().length > 0 ? ` Several points of a place: ${OVER[this.over][0]}.` : "";
      this.note.textContent = `Each field is a place that was computed.${more} Lines are interpolated between places.${someLost ? " Grey: no point there has the figure." : ""}`;
    } else if (!fit) {
      this.note.textContent = "Too few points for a response surface of second degree.";
    } else {
      const weak = fit.explained < 0.8 ? " IT FITS POORLY: look at the points instead." : "";
      this.note.textContent = `Response surface of second degree in all factors, fitted to ${number(fit.count, 9)} points; it explains ${number(100 * fit.explained, 3)} % of the variance.${weak} Dots are computed points, at any value of the other factors.${lostFit ? ` The boundary of stability is where a fit to "ended early or failed" is one half (it explains ${number(100 * lostFit.explained, 3)} %).` : ""}`;
    }
  }

  draw(drawing) {
    if (this.form === "surface") this.drawSurface(drawing);
    else this.drawMap(drawing);
  }

  /** The colour of a value in the shown unit. */
  shade(value, [low, high]) {
    return `rgb(${viridis((value - low) / (high - low))})`;
  }

  drawMap(drawing) {
    const { xs, ys, grid, value, lost, bad } = this.surface;
    const [fx, fy] = [shownOf(this.across).factor, shownOf(this.up).factor];
    const [sx, sy] = [xs.map((it) => it * fx), ys.map((it) => it * fy)];
    const edges = (list) => [list[0] - (list[1] - list[0]) / 2, ...list.slice(1).map((it, k) => (it + list[k]) / 2), list[list.length - 1] + (list[list.length - 1] - list[list.length - 2]) / 2];
    const [ex, ey] = [xs.length > 1 ? edges(sx) : [sx[0] - 0.5, sx[0] + 0.5], ys.length > 1 ? edges(sy) : [sy[0] - 0.5, sy[0] + 0.5]];
    const axis = (column, list) => ({ label: titleOf(column), low: list[0], high: list[list.length - 1], texts: column.texts });
    drawing.axes(axis(this.across, grid ? ex : sx), axis(this.up, grid ? ey : sy));
    const range = this.range();
    const [x0, x1, y0, y1] = grid ? [ex, ex, ey, ey] : [edges(sx), edges(sx), edges(sy), edges(sy)];
    const clipX = (it) => Math.min(Math.max(drawing.x(it), drawing.left), drawing.width - drawing.right);
    const clipY = (it) => Math.min(Math.max(drawing.y(it), drawing.top), drawing.height - drawing.bottom);
    for (let i = 0; i < xs.length; i++) {
      for (let j = 0; j < ys.length; j++) {
        const it = value(i, j);
        if (grid && this.surface.cells[i][j].count === 0) continue;
        const [left, right, low, high] = [clipX(x0[i]), clipX(x1[i + 1]), clipY(y0[j]), clipY(y1[j + 1])];
        const cell = drawing.add("rect", { x: left.toFixed(1), y: high.toFixed(1), width: (right - left + 0.4).toFixed(1), height: (low - high + 0.4).toFixed(1), fill: Number.isFinite(it) ? this.shade(it, range) : drawing.inks.lost });
        if (grid) cell.append(svg("title", {}, this.tip(i, j)));
      }
    }
    if (!grid) this.drawDots(drawing);
    const lines = (at, level, attributes) => {
      let drawn = 0;
      for (const segment of contour(sx, sy, at, level)) { drawing.line(segment, attributes); drawn++; }
      return drawn;
    };
    if (Number.isFinite(range[0]) && xs.length > 1 && ys.length > 1) {
      for (const level of roundLevels(...range)) {
        if (lines(value, level, { stroke: "#ffffff", "stroke-width": 0.9, "stroke-opacity": 0.85 }) > 2) this.labelLevel(drawing, sx, sy, level);
      }
    }
    const legend = [];
    const bound = this.figure.limits.find((it) => it != null);
    if (bound != null && lines(value, bound * shownOf(this.figure).factor, { stroke: "#ffffff", "stroke-width": 4 }) > 0) {
      lines(value, bound * shownOf(this.figure).factor, { stroke: "#000000", "stroke-width": 2, "stroke-dasharray": "6 3" });
      legend.push({ text: `limit ${number(bound * shownOf(this.figure).factor, 4)} ${shownOf(this.figure).unit}`.trim(), line: drawing.inks.ink, dash: "6 3" });
    }
    const boundary = (at, colour, dash, text) => {
      if (lines(at, 0.5, { stroke: "#ffffff", "stroke-width": 4.5 }) === 0) return;
      lines(at, 0.5, { stroke: colour, "stroke-width": 2.6, "stroke-dasharray": dash });
      legend.push({ text, line: colour, dash });
    };
    boundary(bad, "#005b96", "2 3", "half of the points break a limit or fail");
    boundary(lost, "#d50000", "none", "stability: half of the points fail or end early");
    drawing.legend(legend);
    drawing.colourBar(...range, titleOf(this.figure));
  }

  /** The value of a contour, beside the middle of its longest line. */
  labelLevel(drawing, xs, ys, level) {
    const segments = contour(xs, ys, this.surface.value, level);
    const [[x, y]] = segments[Math.floor(segments.length / 2)];
    drawing.text(drawing.x(x), drawing.y(y) - 3, number(level, 4), { "font-size": 10, "text-anchor": "middle", fill: "#ffffff", stroke: "#00000088", "stroke-width": 2.4, "paint-order": "stroke" });
  }

  tip(i, j) {
    const { xs, ys, cells, value } = this.surface;
    const it = cells[i][j];
    const { unit } = shownOf(this.figure);
    return `${this.across.title} ${textOf(this.across, xs[i])}, ${this.up.title} ${textOf(this.up, ys[j])}: ${number(value(i, j), 5)} ${unit}; ${it.count} points, ${it.lost} failed or ended early${it.judged ? `, ${it.bad} beyond a limit` : ""}`;
  }

  drawDots(drawing) {
    const range = this.range();
    const { factor } = shownOf(this.figure);
    const every = Math.max(1, Math.ceil(points.count / 1500));
    for (let k = 0; k < points.count; k += every) {
      const value = factor * this.figure.values[k];
      const fill = Number.isFinite(value) ? this.shade(value, range) : drawing.inks.lost;
      drawing.point(this.across.values[k] * shownOf(this.across).factor, this.up.values[k] * shownOf(this.up).factor, { r: 2.6, fill, stroke: points.well[k] ? "#ffffff" : "#d50000", "stroke-width": points.well[k] ? 0.6 : 1.4 });
    }
  }

  /** The surface from outside, farthest patches first. */
  drawSurface(drawing) {
    const { xs, ys, value } = this.surface;
    const range = this.range();
    const [c, s] = [Math.cos((this.turn * Math.PI) / 180), Math.sin((this.turn * Math.PI) / 180)];
    const scale = 215;
    const [cx, cy] = [(drawing.left + drawing.width - drawing.right) / 2, 250];
    const part = (list, k) => (list.length > 1 ? (list[k] - list[0]) / (list[list.length - 1] - list[0]) : 0.5) - 0.5;
    const project = (u, v, w) => {
      const [a, b] = [u * c - v * s, u * s + v * c];
      return [cx + scale * 1.25 * a, cy + scale * 0.55 * b - scale * 0.8 * (w - 0.5), b];
    };
    const height = (it) => (it - range[0]) / (range[1] - range[0]);
    const path = (list, attributes) => drawing.add("polygon", { points: list.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" "), ...attributes });
    const base = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(([u, v]) => project(u, v, 0));
    path(base, { fill: "none", stroke: drawing.inks.soft });
    const patches = [];
    for (let i = 0; i + 1 < xs.length; i++) {
      for (let j = 0; j + 1 < ys.length; j++) {
        const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        const values = corners.map(([a, b]) => value(a, b));
        if (!values.every(Number.isFinite)) continue;
        const places = corners.map(([a, b], k) => project(part(xs, a), part(ys, b), height(values[k])));
        patches.push({ places, mean: meanOf(values), depth: meanOf(places.map((it) => it[2])) });
      }
    }
    patches.sort((a, b) => a.depth - b.depth);
    for (const { places, mean } of patches) path(places, { fill: this.shade(mean, range), stroke: drawing.inks.ground, "stroke-width": 0.5 });
    const edge = (from, to, column, list) => {
      const [a, b] = [project(...from, 0), project(...to, 0)];
      const low = a[1] < cy && b[1] < cy;
      const middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2 + (low ? -8 : 18)];
      drawing.text(middle[0], middle[1] + (low ? 0 : 10), titleOf(column), { "text-anchor": "middle" });
      const ends = column.texts ? [column.texts[list[0]], column.texts[list[list.length - 1]]] : [list[0], list[list.length - 1]].map((it) => number(it * shownOf(column).factor, 4));
      [a, b].forEach((it, k) => drawing.text(it[0], it[1] + (low ? -4 : 14), ends[k], { "text-anchor": "middle", fill: drawing.inks.soft, "font-size": 11 }));
    };
    // the edges in front
    const front = (list) => list.reduce((best, it) => (meanOf(it.map((p) => project(...p, 0)[2])) > meanOf(best.map((p) => project(...p, 0)[2])) ? it : best));
    edge(...front([[[-0.5, -0.5], [0.5, -0.5]], [[-0.5, 0.5], [0.5, 0.5]]]), this.across, xs);
    edge(...front([[[-0.5, -0.5], [-0.5, 0.5]], [[0.5, -0.5], [0.5, 0.5]]]), this.up, ys);
    drawing.colourBar(...range, titleOf(this.figure));
  }
}

function mapSection() {
  if (points.factors.length < 2 || allFigures().length === 0) return;
  const it = section("map", "Map over two factors");
  // for tests
  it.view = new MapView(it);
}
