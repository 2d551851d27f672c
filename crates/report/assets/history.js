// Time histories: the scenario's plots, and any recorded signal.

const timeAxis = new Axis({ label: "time (s)", format: (time) => `${number(time, 7)} s` });

/** Curves of one signal in all runs that have it. */
function curvesOf(name, label, k, factor) {
  const curves = [];
  for (const [r, run] of data.runs.entries()) {
    const signal = signalOf(run, name);
    if (!signal || signal.x.length === 0) continue;
    curves.push({
      label: runPrefix(run) + label,
      x: signal.x,
      y: factor === 1 ? signal.y : signal.y.map((value) => value * factor),
      // a colour per curve, a dash per run
      colour: k * data.runs.length + r,
      dash: r,
    });
  }
  return curves;
}

/** Plots of all runs, without duplicates, those of the first run first. */
function allPlots() {
  const plots = new Map();
  for (const run of data.runs) {
    for (const plot of run.plots) {
      const key = JSON.stringify(plot.panels.map((panel) => panel.signals));
      if (!plots.has(key)) plots.set(key, plot);
    }
  }
  return [...plots.values()];
}

function drawPlots(parent) {
  for (const plot of allPlots()) {
    if (plot.title) parent.append(element("h3", {}, plot.title));
    for (const panel of plot.panels) {
      const curves = panel.signals.flatMap((name, k) => curvesOf(name, panel.labels[k] ?? name, k, panel.scale));
      const missing = panel.signals.filter((name) => !data.runs.some((run) => signalOf(run, name)));
      if (curves.length > 0) new Chart(parent, { title: "", ylabel: panel.ylabel, axis: timeAxis, curves, timed: true });
      if (missing.length > 0) parent.append(element("p", { class: "note" }, `Not recorded: ${missing.join(", ")}`));
    }
  }
}

// ---- any signal ----

/** Groups of more than two signals whose names differ only in numbers: [pattern, names]. */
function families(names) {
  const groups = new Map();
  for (const name of names) {
    const pattern = name.replace(/\d+/g, "#");
    if (!groups.has(pattern)) groups.set(pattern, []);
    groups.get(pattern).push(name);
  }
  return [...groups].filter(([, members]) => members.length > 2);
}

/** A list of signals to choose from, with a filter and a button for each group. */
class Picker {
  constructor(parent, { names, label, change }) {
    this.chosen = new Set();
    this.change = change;
    const filter = element("input", { type: "search", placeholder: "filter, such as gap_0", "aria-label": `Filter ${label}` });
    filter.addEventListener("input", () => this.filter(filter.value));
    const groups = families(names).map(([pattern, members]) =>
      element("button", { type: "button", class: "chip", onclick: () => this.toggle(members) }, `${pattern} (${members.length})`));
    const clear = element("button", { type: "button", class: "chip", onclick: () => this.toggle([...this.chosen]) }, "none");
    this.boxes = new Map(names.map((name) => {
      const box = element("input", { type: "checkbox", onchange: () => this.toggle([name]) });
      return [name, { box, row: element("label", {}, box, name) }];
    }));
    const list = element("div", { class: "list", role: "group", "aria-label": label }, [...this.boxes.values()].map((it) => it.row));
    parent.append(element("div", { class: "picker" }, element("div", { class: "chips" }, filter, groups, clear), list));
  }

  filter(text) {
    const words = text.toLowerCase().split(/\s+/);
    for (const [name, { row }] of this.boxes) {
      row.hidden = !words.every((word) => name.toLowerCase().includes(word));
    }
  }

  /** Selects the signals, or deselects them if all are selected. */
  toggle(names) {
    const all = names.every((name) => this.chosen.has(name));
    for (const name of names) {
      if (all) this.chosen.delete(name);
      else this.chosen.add(name);
      this.boxes.get(name).box.checked = !all;
    }
    this.change([...this.boxes.keys()].filter((name) => this.chosen.has(name)));
  }
}

function unitOf(name) {
  for (const run of data.runs) {
    const signal = run.signals.find((it) => it.name === name);
    if (signal) return signal.unit;
  }
  return null;
}

/** Draws the chosen signals, one plot per unit of measure; on a logarithmic axis their magnitudes. */
function drawChosen(parent, names, old, logY) {
  old.forEach((chart) => chart.destroy());
  const byUnit = new Map();
  for (const name of names) {
    const unit = unitOf(name);
    if (!byUnit.has(unit)) byUnit.set(unit, []);
    byUnit.get(unit).push(name);
  }
  return [...byUnit].map(([unit, members]) => {
    const size = Math.max(...members.flatMap((name) => data.runs.map((run) => largest(signalOf(run, name)?.y ?? []))));
    const shown = shownUnit(unit, size);
    const curves = members.flatMap((name, k) => curvesOf(name, name, k, shown.factor)).map((it) => (logY ? { ...it, y: it.y.map(Math.abs) } : it));
    const highest = Math.max(...curves.map((it) => largest(it.y)));
    const common = families(members).length === 1 && families(members)[0][1].length === members.length ? families(members)[0][0] : members.length === 1 ? members[0] : "";
    return new Chart(parent, { title: "", ylabel: withUnit(logY ? `magnitude ${common}`.trim() : common, shown.unit), axis: timeAxis, curves, timed: true, logY, lowest: 1e-9 * highest });
  });
}

function historySection() {
  const names = allSignals();
  if (names.length === 0) return;
  const it = section("history", "Time histories", element("p", { class: "hint" }, HINT));
  drawPlots(it);
  const chosen = element("div", { id: "chosen" });
  let charts = [];
  let list = [];
  it.append(element("h3", {}, "Recorded signals"));
  const values = element("select", { "aria-label": "Values of recorded signals" },
    [["linear", "linear"], ["log", "magnitude, logarithmic"]].map(([key, text]) => element("option", { value: key }, text)));
  const draw = () => { charts = drawChosen(chosen, list, charts, values.value === "log"); };
  values.addEventListener("change", draw);
  const picker = new Picker(it, { names, label: "recorded signals", change: (names) => { list = names; draw(); } });
  it.append(element("div", { class: "choices screen" }, element("label", { class: "choice" }, "Values ", values)), chosen);
  if (allPlots().length === 0) picker.toggle(names.slice(0, 4));
}
