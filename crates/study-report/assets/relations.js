// Scatter plots and parallel coordinates. A range on an axis of the latter selects points for both and for the table.

/** Most points drawn; of more, these many at equal distances. */
const DRAWN = 3000;

/** All columns that have an axis. */
function axisColumns() {
  return [...points.factors, ...allFigures().filter((it) => !it.lost)];
}

/** The colour of a point by a column. */
function colourBy(column, inks) {
  const sorted = Float64Array.from(column.values.filter(Number.isFinite)).sort();
  const [low, high] = [sorted[0], sorted[sorted.length - 1]];
  return (k) => {
    const value = column.values[k];
    if (!Number.isFinite(value)) return inks.lost;
    return `rgb(${viridis(high > low ? (value - low) / (high - low) : 0.5)})`;
  };
}

class ScatterView {
  constructor(parent) {
    const columns = axisColumns();
    Object.assign(this, { across: columns[0], up: points.figures[0] ?? columns[1], colour: points.figures[1] ?? columns[1] ?? columns[0], logs: [false, false] });
    const redo = (set) => (value) => { set(value); this.change(); };
    const axes = [["linear", "linear"], ["log", "logarithmic"]];
    parent.append(element("div", { class: "choices" },
      columnChoice("Across", columns, this.across, redo((it) => { this.across = it; })), choice("axis across", axes, "linear", redo((it) => { this.logs[0] = it === "log"; })),
      columnChoice("Up", columns, this.up, redo((it) => { this.up = it; })), choice("axis up", axes, "linear", redo((it) => { this.logs[1] = it === "log"; })),
      columnChoice("Colour", columns, this.colour, redo((it) => { this.colour = it; }))));
    this.picture = new Picture(parent, { id: "scatter", label: "Scatter plot", size: { right: 100 }, draw: (it) => this.draw(it) });
    this.note = element("p", { class: "note" });
    parent.append(this.note);
    selection.subscribers.push(() => this.change());
    this.change();
  }

  change() {
    const every = Math.max(1, Math.ceil(points.count / DRAWN));
    this.note.textContent = `${every > 1 ? `One of ${every} points is drawn. ` : ""}${someLost ? "Crosses: points that ended early or failed; at the bottom if they lack the figure." : ""}`;
    this.picture.redraw();
  }

  draw(drawing) {
    const [a, b] = [this.across, this.up];
    drawing.axes(axisOf(a, a.values, { log: this.logs[0] && !a.texts }), axisOf(b, b.values, { log: this.logs[1] && !b.texts }));
    const tint = colourBy(this.colour, drawing.inks);
    const every = Math.max(1, Math.ceil(points.count / DRAWN));
    for (let k = 0; k < points.count; k += every) {
      const [x, y] = [a.values[k] * shownOf(a).factor, b.values[k] * shownOf(b).factor];
      const known = Number.isFinite(drawing.y(y));
      if (!Number.isFinite(drawing.x(x)) || (points.well[k] && !known)) continue;
      const opacity = selection.has(k) ? 0.85 : 0.08;
      if (points.well[k]) drawing.point(x, y, { fill: tint(k), "fill-opacity": opacity }, `point ${points.numbers[k]}: ${a.title} ${textOf(a, a.values[k])}, ${b.title} ${textOf(b, b.values[k])}`);
      else drawing.text(drawing.x(x), known ? drawing.y(y) + 4 : drawing.height - drawing.bottom, "×", { "text-anchor": "middle", fill: drawing.inks.bad, "fill-opacity": opacity });
    }
    const sorted = Float64Array.from(this.colour.values.filter(Number.isFinite)).sort();
    const { factor } = shownOf(this.colour);
    if (sorted.length > 0 && sorted[0] < sorted[sorted.length - 1] && !this.colour.texts) drawing.colourBar(sorted[0] * factor, sorted[sorted.length - 1] * factor, titleOf(this.colour));
  }
}

class ParallelView {
  constructor(parent) {
    this.columns = axisColumns();
    this.colour = points.figures[0] ?? this.columns[0];
    this.ranges = new Map();
    const width = Math.max(720, 120 * this.columns.length);
    const clear = element("button", { type: "button", class: "chip" }, "show all");
    clear.addEventListener("click", () => { this.ranges.clear(); this.select(); });
    parent.append(element("div", { class: "choices" }, columnChoice("Colour", this.columns, this.colour, (it) => { this.colour = it; this.picture.redraw(); }), clear),
      element("p", { class: "hint" }, "Drag along an axis to select a range, click it to clear the range. The selection applies to the scatter plot and to the table."));
    const holder = element("div", { class: "wide" });
    parent.append(holder);
    this.picture = new Picture(holder, { id: "parallel-coordinates", label: "Parallel coordinates", size: { width, height: 380, top: 46, bottom: 30, left: 60, right: 60 }, draw: (it) => this.draw(it) });
    this.note = element("p", { class: "note", "aria-live": "polite" });
    parent.append(this.note);
    this.listen();
    this.select();
  }

  /** Ends of an axis. */
  ends(column) {
    const sorted = column.ends ??= Float64Array.from(column.values.filter(Number.isFinite)).sort();
    const [low, high] = [sorted[0] ?? 0, sorted[sorted.length - 1] ?? 1];
    return high > low ? [low, high] : [low - 0.5, high + 0.5];
  }

  select() {
    const ranges = [...this.ranges];
    const kept = ranges.length === 0 ? null : Uint8Array.from({ length: points.count }, (_, k) => (ranges.every(([column, [low, high]]) => column.values[k] >= low && column.values[k] <= high) ? 1 : 0));
    const every = Math.max(1, Math.ceil(points.count / DRAWN));
    const count = kept ? kept.reduce((sum, it) => sum + it, 0) : points.count;
    this.note.textContent = `${number(count, 9)} of ${number(points.count, 9)} points selected.${every > 1 ? ` One of ${every} points is drawn.` : ""}`;
    selection.set(kept);
    this.picture.redraw();
  }

  place(column, value, drawing) {
    const [low, high] = this.ends(column);
    return drawing.height - drawing.bottom - ((value - low) / (high - low)) * (drawing.height - drawing.top - drawing.bottom);
  }

  xOf(n, drawing) {
    return drawing.left + (n * (drawing.width - drawing.left - drawing.right)) / Math.max(this.columns.length - 1, 1);
  }

  draw(drawing) {
    const tint = colourBy(this.colour, drawing.inks);
    const every = Math.max(1, Math.ceil(points.count / DRAWN));
    const order = Array.from({ length: Math.ceil(points.count / every) }, (_, i) => i * every).sort((a, b) => Number(selection.has(a)) - Number(selection.has(b)));
    const opacity = Math.max(0.12, Math.min(0.7, 120 / order.length));
    for (const k of order) {
      const places = this.columns.map((column, n) => [this.xOf(n, drawing), this.place(column, column.values[k], drawing)]);
      const parts = places.filter(([, y]) => Number.isFinite(y)).map((it) => it.map((value) => value.toFixed(1)).join(","));
      if (parts.length > 1) drawing.add("polyline", { points: parts.join(" "), fill: "none", stroke: selection.has(k) ? tint(k) : drawing.inks.lost, "stroke-opacity": selection.has(k) ? opacity : 0.05, "stroke-width": 1.1 });
    }
    this.columns.forEach((column, n) => {
      const x = this.xOf(n, drawing);
      drawing.add("line", { x1: x, x2: x, y1: drawing.top, y2: drawing.height - drawing.bottom, stroke: drawing.inks.ink });
      drawing.text(x, n % 2 ? 12 : 26, shortened(titleOf(column), 26), { "text-anchor": "middle", "font-size": 11 });
      const label = (value, y) => drawing.text(x, y, textOf(column, value, 3), { "text-anchor": "middle", fill: drawing.inks.soft, "font-size": 10.5 });
      const [low, high] = this.ends(column);
      label(high, drawing.top - 6);
      label(low, drawing.height - drawing.bottom + 14);
      const range = this.ranges.get(column);
      if (range) {
        const [a, b] = range.map((value) => this.place(column, value, drawing));
        drawing.add("rect", { x: x - 7, y: b, width: 14, height: Math.max(a - b, 2), fill: drawing.inks.curves[1], "fill-opacity": 0.3, stroke: drawing.inks.curves[1] });
      }
    });
    this.drawing = drawing;
  }

  listen() {
    const { box } = this.picture;
    const at = (event) => {
      const area = box.firstElementChild.getBoundingClientRect();
      const { drawing } = this;
      return [((event.clientX - area.left) / area.width) * drawing.width, ((event.clientY - area.top) / area.height) * drawing.height];
    };
    box.addEventListener("pointerdown", (event) => {
      const [x, y] = at(event);
      const n = this.columns.reduce((best, _, k) => (Math.abs(this.xOf(k, this.drawing) - x) < Math.abs(this.xOf(best, this.drawing) - x) ? k : best), 0);
      if (Math.abs(this.xOf(n, this.drawing) - x) > 30) return;
      const column = this.columns[n];
      const value = (height) => {
        const { top, bottom, height: whole } = this.drawing;
        const [low, high] = this.ends(column);
        return low + ((whole - bottom - height) / (whole - top - bottom)) * (high - low);
      };
      event.preventDefault();
      const end = (last) => {
        const [a, b] = [value(y), value(at(last)[1])].sort((p, q) => p - q);
        const [low, high] = this.ends(column);
        if (b - a < 0.02 * (high - low)) this.ranges.delete(column);
        else this.ranges.set(column, [a, b]);
        this.select();
      };
      addEventListener("pointerup", end, { once: true });
    });
  }
}

function relationsSection() {
  if (axisColumns().length < 2 || points.count === 0) return;
  const it = section("relations", "Scatter and parallel coordinates");
  it.scatter = new ScatterView(it);
  it.view = new ParallelView(it);
}
