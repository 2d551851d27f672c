// The Pareto front of two figures: points that no other point beats in both.

/** Settings that none beats: indices of [a, b] pairs, both to be small, by rising a. */
function front(pairs) {
  const order = pairs.map((_, k) => k).filter((k) => pairs[k].every(Number.isFinite)).sort((i, j) => pairs[i][0] - pairs[j][0] || pairs[i][1] - pairs[j][1]);
  let least = Infinity;
  return order.filter((k) => {
    const better = pairs[k][1] < least;
    if (better) least = pairs[k][1];
    return better;
  });
}

class ParetoView {
  constructor(parent) {
    const [first, second] = points.figures;
    this.figures = [first, second];
    // with a lower bound only, more is better
    this.signs = this.figures.map((it) => this.sign(it));
    this.settings = this.group();
    this.choices = element("div", { class: "choices" });
    parent.append(this.choices);
    this.picture = new Picture(parent, { id: "pareto-front", label: "Pareto front", size: { top: 24 }, draw: (it) => this.draw(it) });
    this.note = element("p", { class: "note" });
    this.table = element("div");
    parent.append(this.note, this.table);
    this.change();
  }

  sign(figure) {
    return figure.limits[0] != null && figure.limits[1] == null ? -1 : 1;
  }

  /** Points of each setting: seeds are repetitions. */
  group() {
    const groups = new Map();
    for (let k = 0; k < points.count; k++) {
      const key = points.setting[k];
      if (!groups.has(key)) groups.set(key, []);
      groups.get(key).push(k);
    }
    return [...groups.values()];
  }

  change() {
    const redo = (set) => (value) => { set(value); this.change(); };
    this.choices.replaceChildren(...["Across", "Up"].flatMap((label, n) => [
      columnChoice(label, points.figures, this.figures[n], redo((it) => { this.figures[n] = it; this.signs[n] = this.sign(it); })),
      choice(`better ${label.toLowerCase()}`, [[1, "smaller"], [-1, "larger"]], this.signs[n], redo((it) => { this.signs[n] = Number(it); })),
    ]));
    this.means = this.settings.map((list) => this.figures.map((it) => meanOf(list.map((k) => it.values[k]))));
    this.front = front(this.means.map((pair) => pair.map((value, n) => this.signs[n] * value)));
    const several = this.settings.some((list) => list.length > 1);
    const lost = this.means.filter((pair) => !pair.every(Number.isFinite)).length;
    const half = points.count > 0 && this.settings.some((list) => list.some((k) => points.verdict(k) === "failed"));
    this.note.textContent = `${this.front.length} of ${number(this.means.length - lost, 9)} settings are not beaten in both figures.${several ? " Figures are means over seeds; a setting with a failed point is left out." : ""}${lost > 0 ? ` Left out: ${lost} settings that lack a figure.` : ""}${half ? " Hollow: a point of the setting breaks a limit." : ""}`;
    const columns = [
      { title: "points", of: (row) => (row.list.length === 1 ? number(points.numbers[row.list[0]], 9) : `${number(points.numbers[row.list[0]], 9)} … (${row.list.length})`) },
      ...points.factors.map((it) => ({ title: titleOf(it), numeric: !it.texts, of: (row) => it.values[row.list[0]], text: (row) => textOf(it, it.values[row.list[0]]) })),
      ...this.figures.map((it, n) => ({ title: titleOf(it), numeric: true, of: (row) => row.pair[n], text: (row) => textOf(it, row.pair[n], 5) })),
      { title: "limits", of: (row) => (row.list.some((k) => points.verdict(k) === "failed") ? "broken" : points.verdict(row.list[0])) },
    ];
    const rows = this.front.map((k) => ({ list: this.settings[k], pair: this.means[k] }));
    this.table.replaceChildren(scrolling("Pareto front", sortable("The front", columns, rows).table));
    this.picture.redraw();
  }

  draw(drawing) {
    const [a, b] = this.figures;
    const scales = this.figures.map((it) => shownOf(it).factor);
    drawing.axes(axisOf(a, this.means.map((it) => it[0])), axisOf(b, this.means.map((it) => it[1])));
    const shown = (pair) => pair.map((value, n) => value * scales[n]);
    const every = Math.max(1, Math.ceil(this.means.length / 4000));
    this.means.forEach((pair, k) => {
      if (k % every !== 0 || !pair.every(Number.isFinite)) return;
      const bad = this.settings[k].some((it) => points.verdict(it) === "failed");
      drawing.point(...shown(pair), { r: 2.6, fill: bad ? "none" : drawing.inks.soft, "fill-opacity": 0.55, stroke: bad ? drawing.inks.soft : "none" });
    });
    drawing.line(this.front.map((k) => shown(this.means[k])), { stroke: drawing.inks.curves[1], "stroke-width": 2 });
    for (const k of this.front) drawing.point(...shown(this.means[k]), { r: 4, fill: drawing.inks.curves[1] }, this.settings[k].length === 1 ? `point ${points.numbers[this.settings[k][0]]}` : "");
    drawing.legend([{ text: "Pareto front", line: drawing.inks.curves[1] }]);
  }
}

function paretoSection() {
  if (points.figures.length < 2) return;
  const it = section("pareto", "Pareto front");
  it.view = new ParetoView(it);
}
