// A plot: curves over a common axis, with zoom, pan, keys and a legend that shows values.

const HINT = "drag: zoom · Shift+drag or ← →: pan · wheel after a click, or + −: zoom · double click or 0: all";

/** Most curves that a legend lists. */
const LISTED = 40;

class Chart {
  /**
   * curves: [{ label, x, y, colour: number, dash: number }], y already in the shown unit;
   * marks: [{ at, label, kind }], vertical lines; levels: the same, horizontal; yRange: fixed limits;
   * under(plot) draws below the curves; read(x, y) describes a point as text; plain: no legend.
   */
  constructor(parent, settings) {
    const usual = { title: "", marks: [], levels: [], logY: false, height: 240, lowest: null, timed: false, yRange: null, under: null, read: null, plain: false };
    Object.assign(this, usual, settings);
    const { title, axis, curves } = this;
    // many curves have shades instead of colours, and too many for a list share one entry
    this.many = curves.length > COLOURS.light.length;
    this.crowd = curves.length > LISTED;
    this.table = join(curves);
    this.values = [];
    this.frame = element("div", { class: "canvas", tabindex: "0", role: "figure", "aria-label": this.spoken(), title: "" });
    this.box = element("figure", { class: "chart" }, element("figcaption", {}, title), this.legend(), this.frame);
    // for tests
    this.frame.chart = this;
    parent.append(this.box);
    const xs = this.table[0];
    axis.add(this, xs[0] ?? 0, xs[xs.length - 1] ?? 1);
    this.plot = new uPlot(this.options(), this.table, this.frame);
    this.listen();
    this.paint();
  }

  spoken() {
    const names = this.curves.slice(0, 8).map((it) => it.label).join(", ");
    const more = this.curves.length > 8 ? ` and ${this.curves.length - 8} more` : "";
    return `Plot of ${this.ylabel} over ${this.axis.label}: ${names}${more}. Keys: arrows pan, plus and minus zoom, 0 shows all, Shift with arrows moves the cursor.`;
  }

  // ---- legend ----

  legend() {
    const list = element("div", { class: "legend" });
    this.where = element("output", { class: "where", "aria-live": "off" });
    if (this.plain) {
      this.values = [];
    } else if (this.crowd) {
      this.values = [element("output", { class: "value" })];
      const [first, last] = [this.curves[0], this.curves[this.curves.length - 1]];
      list.append(element("span", { class: "entry" }, `${this.curves.length} curves: ${first.label}`, shadesSample(), last.label),
        element("span", { class: "entry screen" }, "nearest to the pointer: ", this.values[0]));
    } else {
      for (const [k, curve] of this.curves.entries()) {
        const sample = svgSample(this.many ? 0 : curve.dash);
        const value = element("output", { class: "value" });
        const button = element("button", { type: "button", class: "entry", "aria-pressed": "true", title: "show or hide" }, sample, curve.label, value);
        button.addEventListener("click", () => {
          const on = button.getAttribute("aria-pressed") !== "true";
          button.setAttribute("aria-pressed", String(on));
          this.plot.setSeries(k + 1, { show: on });
        });
        this.values.push(value);
        curve.sample = sample;
        list.append(button);
      }
    }
    list.append(this.where);
    return list;
  }

  showValues() {
    const at = this.plot.cursor.idx;
    this.where.textContent = at == null ? "" : `${this.axis.label.replace(/ \(.*/, "")} ${this.axis.format(this.table[0][at])}`;
    if (this.read) {
      const { left, top } = this.plot.cursor;
      if (left >= 0) this.where.textContent = `${this.axis.format(this.plot.posToVal(left, "x"))}, ${this.read(this.plot.posToVal(left, "x"), this.plot.posToVal(top, "y"))}`;
      return;
    }
    if (this.crowd) {
      const k = this.nearest;
      const known = at != null && k;
      this.values[0].textContent = known ? `${this.curves[k - 1].label} ${number(this.table[k][at])}` : "–";
      return;
    }
    for (const [k, output] of this.values.entries()) {
      const index = this.plot.cursor.idxs?.[k + 1] ?? at;
      output.textContent = at == null ? "" : number(this.table[k + 1][index]);
    }
  }

  // ---- drawing ----

  options() {
    const ink = () => styleColour("--ink-soft");
    const grid = { stroke: () => styleColour("--grid"), width: 1 };
    const font = "12px system-ui, sans-serif";
    const label = { labelFont: "13px system-ui, sans-serif", stroke: ink, grid: { ...grid, show: !this.under }, ticks: grid, font };
    const spread = (_, low, high) => {
      if (low == null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
      const margin = high > low ? 0.06 * (high - low) : Math.abs(high) * 0.01 || 1;
      return [low - margin, high + margin];
    };
    const logSpread = (_, low, high) => (high > 0 ? uPlot.rangeLog(Math.max(low, this.lowest ?? high * 1e-12), high, 10, true) : [1e-3, 1]);
    return {
      width: 600,
      height: this.height,
      legend: { show: false },
      padding: [10, 14, 0, 0],
      scales: {
        x: { time: false, distr: this.axis.log ? 3 : 1, range: () => this.axis.range() },
        y: this.logY ? { distr: 3, range: logSpread } : { range: this.yRange ? () => this.yRange : spread },
      },
      axes: [
        { ...label, ...ticksOf(this.axis.log), label: this.axis.label, labelSize: 22, size: 34, values: (_, ticks) => labels(ticks, this.axis.log) },
        { ...label, ...ticksOf(this.logY), label: this.ylabel, labelSize: 24, size: (_, texts) => Math.max(62, 20 + 7 * Math.max(0, ...(texts ?? []).map((text) => text.length))), values: (_, ticks) => labels(ticks, this.logY) },
      ],
      series: [{}, ...this.curves.map((curve, k) => this.series(curve, k))],
      cursor: {
        drag: { x: true, y: false, setScale: false },
        focus: { prox: this.many ? 30 : -1 },
        points: { size: 7 },
        sync: { key: this.axis.key, setSeries: false, scales: ["x", null], filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } },
        bind: { dblclick: () => null },
      },
      focus: { alpha: this.many ? 0.25 : 1 },
      hooks: {
        setCursor: [() => this.showValues()],
        setSeries: [(_, k) => { this.nearest = k; this.showValues(); }],
        setSelect: [(plot) => this.select(plot)],
        drawAxes: this.under ? [(plot) => this.under(plot)] : [],
        draw: [(plot) => this.drawMarks(plot)],
      },
    };
  }

  series(curve, k) {
    return {
      label: curve.label,
      scale: "y",
      width: this.many ? 1 : 1.5,
      dash: this.many ? [] : DASHES[curve.dash % DASHES.length],
      spanGaps: true,
      stroke: () => this.tint(curve, k),
      points: { show: (plot) => curve.x.length < 3 || plot.bbox.width / visible(curve.x, this.axis.range()) > 14 * devicePixelRatio, size: 4 },
    };
  }

  /** The colour of curve k. */
  tint(curve, k) {
    return this.many ? shade(k / (this.curves.length - 1)) : colour(curve.colour);
  }

  /** Horizontal lines with labels, bright with a dark edge to be visible on a picture. */
  drawLevels(plot) {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio;
    const [gap, height] = [6 * ratio, 14 * ratio];
    for (const level of this.levels) {
      const y = plot.valToPos(level.at, "y", true);
      if (y < bbox.top) continue;
      for (const [width, tint] of [[3, "rgb(0 0 0 / 45%)"], [1.2, "#ffffff"]]) {
        ctx.strokeStyle = tint;
        ctx.lineWidth = width * ratio;
        ctx.setLineDash(level.kind === "girder" ? [6 * ratio, 4 * ratio] : [2 * ratio, 3 * ratio]);
        ctx.beginPath();
        ctx.moveTo(bbox.left, y);
        ctx.lineTo(bbox.left + bbox.width, y);
        ctx.stroke();
      }
      // above the line or below it, as far right as other labels allow
      const width = ctx.measureText(level.label).width + 2 * gap;
      const candidates = [];
      for (let right = bbox.left + bbox.width; right - width > bbox.left; right -= 2 * gap) candidates.push([right - width, y - height], [right - width, y + 1]);
      const place = this.places.find(width, height, candidates);
      if (place) writeLabel(ctx, level.label, place[0] + gap, place[1], height * 0.8, "#ffffff", "rgb(0 0 0 / 60%)");
    }
  }

  /** Vertical lines with labels, and the time of the timeline. */
  drawMarks(plot) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    const ratio = devicePixelRatio;
    ctx.font = `${11 * ratio}px system-ui, sans-serif`;
    this.places = new Places();
    this.drawLevels(plot);
    const written = [];
    for (const mark of this.marks) {
      const x = plot.valToPos(mark.at, "x", true);
      if (x < bbox.left - 1 || x > bbox.left + bbox.width + 1) continue;
      ctx.strokeStyle = ctx.fillStyle = styleColour(mark.kind === "girder" ? "--mark-girder" : "--mark-coupled");
      ctx.setLineDash(mark.kind === "girder" ? [6 * ratio, 4 * ratio] : [2 * ratio, 3 * ratio]);
      ctx.lineWidth = 1.2 * ratio;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      if (!mark.label) continue;
      // right of the line or left of it, in the first row with room
      const [gap, height] = [4 * ratio, 14 * ratio];
      const width = ctx.measureText(mark.label).width + 2 * gap;
      const sides = [x, x - width].filter((left) => left >= bbox.left && left + width <= bbox.left + bbox.width);
      const rows = Math.floor(bbox.height / height) - 1;
      const candidates = Array.from({ length: rows }, (_, row) => sides.map((left) => [left, bbox.top + 2 * ratio + row * height])).flat();
      const place = this.places.find(width, height, candidates);
      if (place) written.push([mark.label, place[0] + gap, place[1], height * 0.8, ctx.strokeStyle]);
    }
    // above all lines
    for (const [text, left, top, height, ink] of written) writeLabel(ctx, text, left, top, height, ink, styleColour("--ground"));
    if (this.timed && timeline.time != null) {
      const x = plot.valToPos(timeline.time, "x", true);
      ctx.strokeStyle = styleColour("--accent");
      ctx.setLineDash([]);
      ctx.lineWidth = 1.5 * ratio;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  paint() {
    for (const [k, curve] of this.curves.entries()) {
      if (curve.sample) curve.sample.style.color = this.tint(curve, k);
    }
    this.plot.redraw(false, true);
  }

  /** Shows the range of the axis. */
  follow() {
    const [min, max] = this.axis.range();
    this.plot.setScale("x", { min, max });
  }

  // ---- interaction ----

  select(plot) {
    const { left, width } = plot.select;
    if (width < 4) return;
    const view = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.axis.show(view);
  }

  listen() {
    const { frame, plot, axis } = this;
    const over = plot.over;
    over.addEventListener("dblclick", () => axis.show(null));
    over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== frame) return;
      event.preventDefault();
      if (Math.abs(event.deltaX) > Math.abs(event.deltaY) || event.shiftKey) axis.pan(Math.sign(event.deltaX + event.deltaY) * 0.1);
      else axis.zoom(event.deltaY > 0 ? 1.25 : 0.8, plot.posToVal(event.offsetX, "x"));
    }, { passive: false });
    over.addEventListener("mousedown", (event) => this.drag(event), { capture: true });
    over.addEventListener("click", (event) => {
      frame.focus({ preventScroll: true });
      if (this.timed && !event.shiftKey) timeline.set(plot.posToVal(event.offsetX, "x"));
    });
    frame.addEventListener("keydown", (event) => this.key(event));
    this.onTheme = () => this.paint();
    document.addEventListener("themechange", this.onTheme);
    if (this.timed) this.leave = timeline.subscribe(() => plot.redraw(false));
    this.observer = new ResizeObserver(([entry]) => {
      const width = Math.floor(entry.contentRect.width);
      if (width > 0 && width !== plot.width) plot.setSize({ width, height: this.height });
    });
    this.observer.observe(frame);
  }

  /** Shift+drag or the middle button pans. */
  drag(event) {
    if (!event.shiftKey && event.button !== 1) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    const [low, high] = this.axis.range();
    const width = this.plot.over.clientWidth;
    const move = (now) => {
      const way = ((event.clientX - now.clientX) / width) * (high - low);
      this.axis.show([low + way, high + way]);
    };
    const end = () => removeEventListener("mousemove", move);
    addEventListener("mousemove", move);
    addEventListener("mouseup", end, { once: true });
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { axis, plot } = this;
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (way && event.shiftKey) {
      const width = plot.over.clientWidth;
      const left = plot.cursor.left >= 0 ? plot.cursor.left + way * width * 0.005 : width / 2;
      plot.setCursor({ left: Math.min(Math.max(left, 0), width), top: plot.over.clientHeight / 2 });
      this.where.setAttribute("aria-live", "polite");
    } else if (way) axis.pan(way * 0.1);
    else if (event.key === "+" || event.key === "=") axis.zoom(0.8);
    else if (event.key === "-") axis.zoom(1.25);
    else if (event.key === "0" || event.key === "Home" || event.key === "Escape") axis.show(null);
    else return;
    event.preventDefault();
  }

  destroy() {
    this.observer.disconnect();
    document.removeEventListener("themechange", this.onTheme);
    this.leave?.();
    this.axis.remove(this);
    this.plot.destroy();
    this.box.remove();
  }
}

/** The data of uPlot: common x, then y of each curve. */
function join(curves) {
  if (curves.length === 0) return [[]];
  if (curves.every((curve) => curve.x === curves[0].x)) return [curves[0].x, ...curves.map((curve) => curve.y)];
  return uPlot.join(curves.map((curve) => [Array.from(curve.x), Array.from(curve.y)]));
}

/** Number of points in a range of sorted values. */
function visible(x, [low, high]) {
  if (x.length < 2) return 1;
  const step = (x[x.length - 1] - x[0]) / (x.length - 1);
  return Math.max(1, (high - low) / step);
}

/** Colour of one of many curves: viridis without the end that has little contrast. */
function shade(part) {
  const [r, g, b] = viridis(theme.name() === "dark" ? 0.25 + 0.75 * part : 0.85 * part);
  return `rgb(${r} ${g} ${b})`;
}

/** A sample of a curve's line for the legend. */
function svgSample(dash) {
  return svg("svg", { width: 26, height: 8, "aria-hidden": "true" },
    svg("line", { x1: 0, x2: 26, y1: 4, y2: 4, stroke: "currentColor", "stroke-width": 2.5, "stroke-dasharray": DASHES[dash % DASHES.length].join(" ") }));
}

/** The shades of many curves from the first to the last; paper shows them, too, because they are no background. */
function shadesSample() {
  const parts = Array.from({ length: 24 }, (_, k) => svg("rect", { x: 4 * k, y: 0, width: 4.5, height: 10, fill: shade(k / 23) }));
  return svg("svg", { width: 96, height: 10, "aria-label": "to" }, ...parts);
}
