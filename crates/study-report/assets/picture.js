// Pictures as SVG, on the page and as files for papers.

const SIZE = { width: 720, height: 420, left: 76, right: 24, top: 16, bottom: 52 };

/** Colours of a picture, written into it, so that it is complete as a file. */
function inks(light) {
  const name = light ? "light" : theme.name();
  return name === "dark"
    ? { ink: "#eceff2", soft: "#b3bcc6", grid: "#2a3037", ground: "#14171b", curves: COLOURS.dark, bad: "#ff9a5c", good: "#4fd6ac", lost: "#4b535c" }
    : { ink: "#16191d", soft: "#4b535c", grid: "#e1e5ea", ground: "#ffffff", curves: COLOURS.light, bad: "#b03a00", good: "#00694c", lost: "#c6ccd3" };
}

/** An axis: { label, low, high, log, texts }; texts are the labels of whole numbers from 0. */
function axisOf(column, values, { margin = 0.04, log = false, texts = column.texts } = {}) {
  const { factor } = shownOf(column);
  const finite = [...values].map((value) => value * factor).filter((value) => Number.isFinite(value) && (!log || value > 0));
  let [low, high] = finite.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
  if (!(low <= high)) [low, high] = [0, 1];
  if (log) {
    const ratio = (high / low) ** margin || 1;
    return { label: titleOf(column), low: low / (ratio > 1 ? ratio : 1.5), high: high * (ratio > 1 ? ratio : 1.5), log, factor };
  }
  const room = high > low ? margin * (high - low) : Math.abs(high) * 0.1 || 1;
  return { label: titleOf(column), low: low - room, high: high + room, log, factor, texts };
}

/** Ticks of an axis: [[value, text]]. */
function ticksOfAxis({ low, high, log, texts, power = 0 }, most = 8) {
  if (texts) return texts.map((text, k) => [k, text]).filter(([k]) => k >= low && k <= high);
  if (log) {
    const ticks = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) for (const digit of [1, 2, 5]) ticks.push(Number(`${digit}e${power}`));
    const inside = ticks.filter((it) => it >= low && it <= high);
    const kept = inside.length > most ? inside.filter((it) => /^1e/.test(it.toExponential())) : inside;
    return kept.map((it) => [it, number(it)]);
  }
  const raw = (high - low) / most;
  const decade = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((it) => it * decade).find((it) => it >= raw * (1 - 1e-9));
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  return Array.from({ length: Math.max(count, 0) }, (_, k) => (first + k) * step).map((it) => [it, number(Number((it / 10 ** power).toPrecision(10)), 6)]);
}

/** An axis whose large or small numbers are written without their power of ten, which its label then has. */
function compacted(axis) {
  const { low, high, log, texts, label } = axis;
  const power = Math.floor(Math.log10(Math.max(Math.abs(low), Math.abs(high))));
  if (log || texts || !Number.isFinite(power) || (power > -4 && power < 5)) return { ...axis, power: 0 };
  const ten = `10${superscript(power)}`;
  return { ...axis, power, label: /\)$/.test(label) ? label.replace(/\(([^()]*)\)$/, `(${ten} $1)`) : `${label} (${ten})` };
}

/** What a picture is drawn with. Values are in shown units. */
class Drawing {
  constructor(light, size = {}) {
    Object.assign(this, SIZE, size);
    this.inks = inks(light);
    this.root = svg("svg", { xmlns: "http://www.w3.org/2000/svg", viewBox: `0 0 ${this.width} ${this.height}`, "font-family": "system-ui, 'DejaVu Sans', sans-serif", "font-size": 12 });
    this.add("rect", { width: this.width, height: this.height, fill: this.inks.ground });
  }

  add(tag, attributes, ...children) {
    const it = svg(tag, attributes, ...children);
    this.root.append(it);
    return it;
  }

  text(x, y, text, attributes = {}) {
    return this.add("text", { x, y, fill: this.inks.ink, ...attributes }, text);
  }

  /** Draws frame and ticks; afterwards `x` and `y` turn values into places. */
  axes(given, upwards, most = [8, 7]) {
    const [across, up] = [compacted(given), compacted(upwards)];
    const { width, height, left, right, top, bottom, inks } = this;
    const place = ({ low, high, log }, from, to) => {
      const f = log ? Math.log : (value) => value;
      return (value) => from + ((f(value) - f(low)) / (f(high) - f(low))) * (to - from);
    };
    this.x = place(across, left, width - right);
    this.y = place(up, height - bottom, top);
    for (const [value, text] of ticksOfAxis(across, most[0])) {
      const x = this.x(value);
      this.add("line", { x1: x, x2: x, y1: top, y2: height - bottom, stroke: inks.grid });
      this.text(x, height - bottom + 17, text, { "text-anchor": "middle", fill: inks.soft });
    }
    for (const [value, text] of ticksOfAxis(up, most[1])) {
      const y = this.y(value);
      this.add("line", { x1: left, x2: width - right, y1: y, y2: y, stroke: inks.grid });
      this.text(left - 7, y + 4, text, { "text-anchor": "end", fill: inks.soft });
    }
    const middle = (top + height - bottom) / 2;
    this.text((left + width - right) / 2, height - bottom + 38, across.label, { "text-anchor": "middle" });
    this.text(16, middle, up.label, { "text-anchor": "middle", transform: `rotate(-90 16 ${middle})` });
  }

  /** A line through places [[x, y]] in shown units. */
  line(list, attributes) {
    const inside = list.filter(([a, b]) => Number.isFinite(a) && Number.isFinite(b));
    if (inside.length > 1) this.add("polyline", { points: inside.map(([a, b]) => `${this.x(a).toFixed(1)},${this.y(b).toFixed(1)}`).join(" "), fill: "none", "stroke-width": 1.8, ...attributes });
  }

  point(x, y, attributes, tip) {
    const it = this.add("circle", { cx: this.x(x).toFixed(1), cy: this.y(y).toFixed(1), r: 3.2, ...attributes });
    if (tip) it.append(svg("title", {}, tip));
    return it;
  }

  /** A bar of viridis at the right with the ends of its range and a label. */
  colourBar(low, high, label, log = false) {
    const { width, top, height, bottom, inks } = this;
    const [x, span] = [width - 74, height - bottom - top];
    for (let k = 0; k < 40; k++) {
      this.add("rect", { x, y: top + (span * (39 - k)) / 40, width: 12, height: span / 40 + 0.5, fill: `rgb(${viridis(k / 39)})` });
    }
    const axis = compacted({ low, high, log, label });
    for (const [value, text] of ticksOfAxis(axis, 6)) {
      const part = log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
      this.text(x + 16, top + span * (1 - part) + 4, text, { fill: inks.soft, "font-size": 11 });
    }
    const middle = top + span / 2;
    this.text(width - 6, middle, axis.label, { "text-anchor": "middle", transform: `rotate(-90 ${width - 6} ${middle})`, "font-size": 11 });
  }

  /** Entries of a legend above the frame: [{ text, line or fill, dash }]. */
  legend(entries) {
    let x = this.left;
    for (const { text, line, fill, dash } of entries) {
      if (fill) this.add("rect", { x, y: 2, width: 14, height: 10, fill });
      else this.add("line", { x1: x, x2: x + 18, y1: 7, y2: 7, stroke: line, "stroke-width": 2.2, "stroke-dasharray": dash ?? "none" });
      this.text(x + 22, 11, text, { "font-size": 11 });
      x += 34 + 6.1 * text.length;
    }
  }
}

/** A picture with a button that saves it. `draw(drawing)` draws it, again when colours or data change. */
class Picture {
  constructor(parent, { id, label, size, draw }) {
    Object.assign(this, { id, label, size, draw });
    this.box = element("div", { class: "picture", role: "img", "aria-label": label });
    this.save = element("button", { type: "button", class: "action", title: "save this picture as a file for papers" }, "SVG");
    this.save.addEventListener("click", () => this.download());
    this.frame = element("figure", { class: "chart", "data-picture": id }, element("div", { class: "saver" }, this.save), this.box);
    parent.append(this.frame);
    // for tests
    this.frame.picture = this;
    document.addEventListener("themechange", () => this.redraw());
  }

  redraw() {
    this.box.replaceChildren(this.drawn(false).root);
  }

  drawn(light) {
    const drawing = new Drawing(light, this.size);
    this.draw(drawing);
    return drawing;
  }

  /** The picture as the text of an SVG file. */
  text() {
    const { root, width, height } = this.drawn(true);
    root.setAttribute("width", width);
    root.setAttribute("height", height);
    return new XMLSerializer().serializeToString(root);
  }

  download() {
    const link = element("a", { href: URL.createObjectURL(new Blob([this.text()], { type: "image/svg+xml" })), download: `${this.id}.svg` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}
