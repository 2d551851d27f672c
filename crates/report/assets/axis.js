// The horizontal axis that plots share, and the ticks of axes.

/** Plots that share their horizontal axis. */
class Axis {
  constructor({ label, log = false, format = number }) {
    Object.assign(this, { label, log, format, charts: new Set(), key: `axis-${Axis.count++}` });
    this.limits = null;
    this.view = null;
    this.sync = uPlot.sync(this.key);
  }

  add(chart, low, high) {
    this.charts.add(chart);
    const old = this.limits;
    this.limits = old ? [Math.min(old[0], low), Math.max(old[1], high)] : [low, high];
  }

  remove(chart) {
    this.charts.delete(chart);
    this.sync.unsub(chart.plot);
  }

  /** The visible range. */
  range() {
    return this.view ?? this.limits;
  }

  /** Shows a range; null shows everything. */
  show(view) {
    if (view) {
      const [least, most] = this.limits;
      const span = Math.min(view[1] - view[0], most - least);
      if (!(span > 1e-7 * (most - least))) return;
      const low = this.log ? Math.max(view[0], least) : Math.min(Math.max(view[0], least), most - span);
      view = span >= (most - least) * (1 - 1e-9) ? null : [low, this.log ? Math.min(view[1], most) : low + span];
    }
    this.view = view;
    for (const chart of this.charts) chart.follow();
  }

  /** Position of a value along the axis; `from` is the inverse. */
  to(value) {
    return this.log ? Math.log(value) : value;
  }

  from(place) {
    return this.log ? Math.exp(place) : place;
  }

  /** Zooms by a factor about a value. */
  zoom(factor, about) {
    const [low, high] = this.range().map((value) => this.to(value));
    const middle = about == null ? (low + high) / 2 : this.to(about);
    this.show([this.from(middle - (middle - low) * factor), this.from(middle + (high - middle) * factor)]);
  }

  /** Moves by a fraction of the visible range. */
  pan(part) {
    const [low, high] = this.range().map((value) => this.to(value));
    const [least, most] = this.limits.map((value) => this.to(value));
    const way = Math.min(Math.max(part * (high - low), least - low), most - high);
    this.show([this.from(low + way), this.from(high + way)]);
  }
}
Axis.count = 0;

/** Ticks of a logarithmic axis at 1, 2 and 5 times each power of ten, over many decades only at the powers. */
function ticksOf(log) {
  if (!log) return {};
  const splits = (_, __, low, high) => {
    const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
    const steps = last - first > 3 ? [1] : [1, 2, 5];
    const ticks = [];
    for (let power = first; power <= last; power++) ticks.push(...steps.map((step) => step * 10 ** power));
    const inside = ticks.filter((tick) => tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9));
    const every = Math.ceil(inside.length / 10);
    return inside.filter((_, k) => k % every === 0);
  };
  return { splits, filter: (_, ticks) => ticks };
}

/** Labels of an axis. */
function labels(ticks, log) {
  if (log) return ticks.map((tick) => (tick == null ? "" : number(tick)));
  const step = ticks.length > 1 ? ticks[1] - ticks[0] : 1;
  let digits = 0;
  while (digits < 9 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6 * step * 10 ** digits) digits++;
  const large = largest(ticks) >= 1e6 || step < 1e-6;
  return ticks.map((tick) => (large ? number(tick) : tick.toFixed(digits).replace("-", "−").replace(/^−(0(\.0*)?)$/, "$1")));
}
