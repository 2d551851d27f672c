// Quantiles of the figures: over seeds along a factor, and over all points.

const BANDS = [[0, 1, 0.1], [0.05, 0.95, 0.18], [0.25, 0.75, 0.3]];

class QuantileView {
  constructor(parent) {
    this.across = points.factors.find((it) => !it.texts) ?? points.factors[0];
    this.figure = points.figures[0];
    this.slices = new Map();
    this.choices = element("div", { class: "choices" });
    parent.append(this.choices);
    this.picture = new Picture(parent, { id: "quantiles", label: "Quantiles over seeds", size: { top: 24 }, draw: (it) => this.draw(it) });
    this.note = element("p", { class: "note" });
    parent.append(this.note);
    this.change();
  }

  change() {
    const redo = (set) => (value) => { set(value); this.change(); };
    this.choices.replaceChildren(
      columnChoice("Figure", points.figures, this.figure, redo((it) => { this.figure = it; })),
      columnChoice("Across", points.factors, this.across, redo((it) => { this.across = it; this.slices.delete(it); })));
    for (const factor of points.factors.filter((it) => it !== this.across && levelsOf(it).length <= NODES)) {
      const levels = [...levelsOf(factor)];
      // one value at first: over several, the band would not be that of seeds
      if (!this.slices.has(factor)) this.slices.set(factor, levels[Math.floor(levels.length / 2)]);
      const options = [...levels.map((value) => [value, `${textOf(factor, value)} ${shownOf(factor).unit}`.trim()]), ["all", "all"]];
      this.choices.append(choice(factor.title, options, this.slices.get(factor), redo((it) => this.slices.set(factor, it === "all" ? "all" : Number(it)))));
    }
    this.groups = new Map();
    this.lost = 0;
    for (let k = 0; k < points.count; k++) {
      if ([...this.slices].some(([factor, value]) => value !== "all" && factor.values[k] !== value)) continue;
      if (!Number.isFinite(this.figure.values[k])) { this.lost++; continue; }
      const x = this.across.values[k];
      if (!this.groups.has(x)) this.groups.set(x, []);
      this.groups.get(x).push(this.figure.values[k]);
    }
    for (const [x, list] of this.groups) this.groups.set(x, Float64Array.from(list).sort());
    const counts = [...this.groups.values()].map((it) => it.length);
    const count = counts.length === 0 ? "no points" : `${Math.min(...counts)}${Math.max(...counts) > Math.min(...counts) ? ` to ${Math.max(...counts)}` : ""} points each`;
    this.note.textContent = `Line: median; bands: 25 to 75 %, 5 to 95 %, smallest to largest; ${count}.${this.lost > 0 ? ` Left out: ${this.lost} without the figure.` : ""}`;
    this.picture.redraw();
  }

  draw(drawing) {
    const rows = [...this.groups].sort((a, b) => a[0] - b[0]);
    const [fx, fy] = [shownOf(this.across).factor, shownOf(this.figure).factor];
    const bound = this.figure.limits.filter((it) => it != null);
    drawing.axes(axisOf(this.across, rows.map(([x]) => x)), axisOf(this.figure, [...rows.flatMap(([, list]) => [list[0], list[list.length - 1]]), ...bound]));
    for (const [low, high, opacity] of BANDS) {
      const edge = (part) => rows.map(([x, list]) => [drawing.x(x * fx), drawing.y(fy * quantile(list, part))]);
      const places = [...edge(high), ...edge(low).reverse()].map((it) => it.map((value) => value.toFixed(1)).join(","));
      if (rows.length > 1) drawing.add("polygon", { points: places.join(" "), fill: drawing.inks.curves[0], "fill-opacity": opacity });
    }
    const median = rows.map(([x, list]) => [x * fx, fy * quantile(list, 0.5)]);
    drawing.line(median, { stroke: drawing.inks.curves[0], "stroke-width": 2.2 });
    for (const [x, y] of median) drawing.point(x, y, { fill: drawing.inks.curves[0] });
    for (const value of bound) drawing.line([[rows[0]?.[0] * fx, value * fy], [rows[rows.length - 1]?.[0] * fx, value * fy]], { stroke: drawing.inks.bad, "stroke-dasharray": "6 3" });
    if (bound.length > 0) drawing.legend([{ text: "limit", line: drawing.inks.bad, dash: "6 3" }]);
  }
}

function quantileSection() {
  if (points.figures.length === 0) return;
  const seeded = points.seeds.length > 0 && points.factors.length > 0;
  const it = section("quantiles", seeded ? "Quantiles over seeds" : "Distribution of the figures");
  if (seeded) it.view = new QuantileView(it);
  const rows = points.figures.map((column) => ({ column, sorted: Float64Array.from(column.values.filter(Number.isFinite)).sort() }));
  const at = (title, part) => ({ title, numeric: true, of: (row) => quantile(row.sorted, part), text: (row) => textOf(row.column, quantile(row.sorted, part), 4) });
  const columns = [
    { title: "figure", of: (row) => titleOf(row.column) }, { title: "points", numeric: true, of: (row) => row.sorted.length },
    at("smallest", 0), at("5 %", 0.05), at("25 %", 0.25), at("median", 0.5), at("75 %", 0.75), at("95 %", 0.95), at("largest", 1),
    { title: "mean", numeric: true, of: (row) => meanOf([...row.sorted]), text: (row) => textOf(row.column, meanOf([...row.sorted]), 4) },
  ];
  it.append(scrolling("Quantiles of all points", sortable("Quantiles over all points that have the figure", columns, rows).table));
}
