// The horizontal axis that plots share, and the ticks of axes.

/** Plots that share their horizontal axis. */
class Axis {
  constructor({ label, log = false, format = number }) {
    Object.assign(this, { label, log, format, charts: new Set(), key: `axis-${Axis.count++}` });
    this.limits = null;
    this.view = null;
    this.watchers = new Set();
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
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => { for (const watcher of this.watchers) watcher(); }, 150);
  }

  /** Calls a function when the visible range has changed and rests. */
  watch(watcher) {
    this.watchers.add(watcher);
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

/** Decades over which a logarithmic axis has lines at 1 to 9 times each power of ten, and labels at more than these. */
const FINE = 6;
const LABELLED = 2.5;

/** Lines of a logarithmic axis: at 1 to 9 times each power of ten, over many decades at the powers only. */
function ticksOf(log) {
  if (!log) return {};
  const splits = (_, __, low, high) => {
    const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
    const steps = last - first > FINE ? [1] : [1, 2, 3, 4, 5, 6, 7, 8, 9];
    const ticks = [];
    for (let power = first; power <= last; power++) ticks.push(...steps.map((step) => Number(`${step}e${power}`)));
    return ticks.filter((tick) => tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9));
  };
  return { splits, filter: (_, ticks) => ticks };
}

/** Labels of the lines of a logarithmic axis; most lines have none. */
function logLabels(ticks) {
  const known = ticks.filter((tick) => tick != null);
  const decades = Math.log10(known[known.length - 1] / known[0]);
  const every = Math.max(1, Math.ceil(decades / 8));
  return ticks.map((tick) => {
    if (tick == null) return "";
    const [digit, power] = tick.toExponential(0).split("e").map(Number);
    if (decades < 0.7) return number(tick, 3);
    const shown = decades <= LABELLED ? [1, 2, 5].includes(digit) : digit === 1 && power % every === 0;
    return shown ? number(tick) : "";
  });
}

/** Labels of an axis. */
function labels(ticks, log) {
  if (log) return logLabels(ticks);
  const step = ticks.length > 1 ? ticks[1] - ticks[0] : 1;
  let digits = 0;
  while (digits < 9 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6 * step * 10 ** digits) digits++;
  const large = largest(ticks) >= 1e6 || step < 1e-6;
  return ticks.map((tick) => (large ? number(tick) : tick.toFixed(digits).replace("-", "−").replace(/^−(0(\.0*)?)$/, "$1")));
}
