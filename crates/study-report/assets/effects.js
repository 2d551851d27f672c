// Which factors matter: main effects and Sobol indices.

class EffectsView {
  constructor(parent) {
    this.effects = data.effects[0];
    const options = data.effects.map((it, k) => [k, it.figure]);
    parent.append(element("div", { class: "choices" }, choice("Figure", options, 0, (key) => { this.effects = data.effects[Number(key)]; this.change(); })));
    this.method = element("p", { class: "note" });
    this.table = element("div");
    const panels = data.effects[0].factors.length;
    const rows = Math.ceil(panels / 3);
    parent.append(element("h3", {}, "Sobol indices: parts of the variance"));
    this.bars = new Picture(parent, { id: "sobol-indices", label: "Sobol indices of the factors", size: { height: 68 + 46 * panels, left: 170 }, draw: (it) => this.drawBars(it) });
    parent.append(this.method, this.table, element("h3", {}, "Main effects: the mean of the figure over each factor alone"));
    this.main = new Picture(parent, { id: "main-effects", label: "Main effects of the factors", size: { height: 190 * rows + 10, width: 900 }, draw: (it) => this.drawMain(it) });
    parent.append(element("p", { class: "note" }, "Dots: means; band: one standard deviation of the points on either side, which the other factors cause. Factors with many values are divided into twelve classes of equal size."));
    this.change();
  }

  columnOf(factor) {
    return points.columns[factor];
  }

  change() {
    const { indices, method, factors } = this.effects;
    this.method.textContent = method;
    this.bars.frame.hidden = !indices;
    if (indices) this.bars.redraw();
    this.main.redraw();
    this.table.replaceChildren();
    if (!indices) return;
    const rows = factors.map((factor, k) => ({ title: this.columnOf(factor).title, pair: indices.factors[k][0], intervals: indices.factors[k][1] }));
    const between = (it) => (it ? ` (${number(it[0], 2)} to ${number(it[1], 2)})` : "");
    const columns = [
      { title: "factor", of: (row) => row.title },
      { title: "first-order index: alone", numeric: true, of: (row) => row.pair[0], text: (row) => rounded(row.pair[0]) + between(row.intervals[0]) },
      { title: "total index: with others", numeric: true, of: (row) => row.pair[1], text: (row) => rounded(row.pair[1]) + between(row.intervals[1]) },
    ];
    this.table.append(scrolling("Sobol indices", sortable("Sobol indices", columns, rows).table));
    if (indices.seeds != null) this.table.append(element("p", { class: "note" }, `${number(100 * indices.seeds, 3)} % of the variance of single points is due to their seeds alone; it is not part of the indices.`));
  }

  drawBars(drawing) {
    const { indices, factors } = this.effects;
    if (!indices) return;
    const { left, right, width, top, inks } = drawing;
    const most = Math.max(1, ...indices.factors.flatMap(([pair, intervals]) => [...pair, ...intervals.flat().filter((it) => it != null)]));
    const x = (value) => left + ((width - left - right) * Math.max(value, 0)) / (most * 1.02);
    for (const [value, text] of ticksOfAxis({ low: 0, high: most }, 6)) {
      drawing.add("line", { x1: x(value), x2: x(value), y1: top + 10, y2: top + 18 + 46 * factors.length, stroke: inks.grid });
      drawing.text(x(value), top + 34 + 46 * factors.length, text, { "text-anchor": "middle", fill: inks.soft });
    }
    factors.forEach((factor, k) => {
      const [pair, intervals] = indices.factors[k];
      const y = top + 20 + 46 * k;
      drawing.text(left - 8, y + 20, shortened(this.columnOf(factor).title, 24), { "text-anchor": "end" });
      pair.forEach((value, n) => {
        drawing.add("rect", { x: left, y: y + 17 * n, width: Math.max(x(value) - left, 0.5), height: 15, fill: inks.curves[n] });
        const interval = intervals[n];
        if (interval) drawing.add("line", { x1: x(interval[0]), x2: x(interval[1]), y1: y + 17 * n + 7.5, y2: y + 17 * n + 7.5, stroke: inks.ink, "stroke-width": 1.6 });
      });
    });
    drawing.legend([{ text: "first-order index", fill: inks.curves[0] }, { text: "total index", fill: inks.curves[1] }]);
  }

  drawMain(drawing) {
    const { factors, main, column } = this.effects;
    const figure = column == null ? LOST : points.columns[column];
    const { factor: scale } = shownOf(figure);
    const ends = main.flat().flatMap(([, mean, deviation]) => [mean - deviation, mean + deviation]);
    const up = axisOf(figure, ends);
    const [w, h] = [300, 190];
    factors.forEach((index, k) => {
      const levels = main[k];
      const of = this.columnOf(index);
      const [dx, dy] = [(k % 3) * w, Math.floor(k / 3) * h];
      const panel = Object.assign(Object.create(Drawing.prototype), drawing, { width: w, height: h, left: 64, right: 10, top: 10, bottom: 44 });
      const group = svg("g", { transform: `translate(${dx} ${dy})`, "font-size": 10.5 });
      drawing.root.append(group);
      panel.root = group;
      const across = axisOf(of, levels.map(([value]) => value), { margin: 0.06 });
      panel.axes({ ...across, label: shortened(across.label, 40) }, { ...up, label: shortened(up.label, 24) }, [5, 5]);
      const at = ([value]) => value * shownOf(of).factor;
      const edge = (sign) => levels.map((it) => [at(it), scale * (it[1] + sign * it[2])]);
      const band = [...edge(1), ...edge(-1).reverse()].map(([a, b]) => `${panel.x(a).toFixed(1)},${panel.y(b).toFixed(1)}`);
      panel.add("polygon", { points: band.join(" "), fill: panel.inks.curves[0], "fill-opacity": 0.15 });
      panel.line(levels.map((it) => [at(it), scale * it[1]]), { stroke: panel.inks.curves[0] });
      for (const it of levels) panel.point(at(it), scale * it[1], { r: 2.6, fill: panel.inks.curves[0] }, `${of.title} ${textOf(of, it[0])}: ${number(scale * it[1], 4)} (${it[3]} settings)`);
    });
  }
}

/** An index: three decimals say all. */
function rounded(value) {
  return value.toFixed(3).replace("-", "−");
}

function shortened(text, most) {
  return text.length > most ? `${text.slice(0, most - 1)}…` : text;
}

function effectsSection() {
  if (data.effects.length === 0 || points.factors.length === 0) return;
  const it = section("effects", "Which factors matter");
  it.view = new EffectsView(it);
}
