// A plot: curves over a common axis, with zoom, pan, keys and a legend that shows values.

const HINT = "drag: zoom · Shift+drag or ← →: pan · wheel after a click, or + −: zoom · double click or 0: all";

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
    this.many = curves.length > COLOURS.light.length;
    this.table = join(curves);
    this.values = [];
    this.frame = element("div", { class: "canvas", tabindex: "0", role: "figure", "aria-label": this.spoken(), title: "" });
    this.box = element("figure", { class: "chart" }, element("figcaption", {}, title), this.legend(), this.frame);
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
    } else if (this.many) {
      this.values = [element("output", { class: "value" })];
      list.append(element("span", { class: "entry" }, `${this.curves.length} signals; nearest to the pointer: `, this.values[0]));
    } else {
      for (const [k, curve] of this.curves.entries()) {
        const sample = svgSample(curve.dash);
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
    if (this.many) {
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
    const count = this.curves.length;
    return {
      label: curve.label,
      scale: "y",
      width: this.many ? 1 : 1.5,
      dash: DASHES[curve.dash % DASHES.length],
      spanGaps: true,
      stroke: () => (this.many ? shade(k / Math.max(count - 1, 1)) : colour(curve.colour)),
      points: { show: (plot) => curve.x.length < 3 || plot.bbox.width / visible(curve.x, this.axis.range()) > 14 * devicePixelRatio, size: 4 },
    };
  }

  /** Horizontal lines with labels, bright with a dark edge to be visible on a picture. */
  drawLevels(plot) {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio;
    let last = Infinity;
    let right = 0;
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
      // left of the label below if there is no room above it
      const width = ctx.measureText(level.label).width + 14 * ratio;
      right = last - y < 14 * ratio ? right + width : width;
      if (right === width) last = y;
      ctx.setLineDash([]);
      ctx.lineWidth = 3 * ratio;
      ctx.strokeStyle = "rgb(0 0 0 / 60%)";
      ctx.fillStyle = "#ffffff";
      const left = bbox.left + bbox.width - right + 6 * ratio;
      ctx.strokeText(level.label, left, y - 4 * ratio);
      ctx.fillText(level.label, left, y - 4 * ratio);
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
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    this.drawLevels(plot);
    const ends = [];
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
      // the first row with room for the label
      const width = ctx.measureText(mark.label).width;
      const left = Math.min(x + 4 * ratio, bbox.left + bbox.width - width - 2 * ratio);
      let row = ends.findIndex((end) => end < left - 8 * ratio);
      if (row < 0) row = ends.length;
      ends[row] = left + width;
      ctx.fillText(mark.label, left, bbox.top + (13 + 14 * row) * ratio);
    }
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
    for (const curve of this.curves) {
      if (curve.sample) curve.sample.style.color = colour(curve.colour);
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
  const ns = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(ns, "svg");
  const line = document.createElementNS(ns, "line");
  const set = (node, attributes) => Object.entries(attributes).forEach(([name, value]) => node.setAttribute(name, value));
  set(svg, { width: 26, height: 8, "aria-hidden": "true" });
  set(line, { x1: 0, x2: 26, y1: 4, y2: 4, stroke: "currentColor", "stroke-width": 2.5, "stroke-dasharray": DASHES[dash % DASHES.length].join(" ") });
  svg.append(line);
  return svg;
}
