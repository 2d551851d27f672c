// Amplitude spectra and power spectral densities of any signal, with the modes marked.

const SPECTRA = {
  amplitude: { title: "amplitude", unit: (unit) => unit, factor: (factor) => factor },
  density: { title: "power spectral density", unit: (unit) => (unit ? `${unit.includes("/") || unit.includes("·") ? `(${unit})` : unit}²/Hz` : "1/Hz"), factor: (factor) => factor * factor },
};

/** Vertical or horizontal lines at the frequencies of the girders and of the coupled system. */
function modeMarks() {
  const marks = new Map();
  const add = (at, label, kind) => {
    const key = `${kind} ${at.toPrecision(4)}`;
    if (!marks.has(key)) marks.set(key, { at, label, kind });
  };
  for (const run of data.runs) {
    (run.guideway?.modes ?? []).forEach((mode, k) => add(mode.frequency, `girder ${k + 1}: ${number(mode.frequency, 3)} Hz`, "girder"));
    // the modes of empty spans are those of the girder: one mark is enough
    const girders = (run.guideway?.modes ?? []).map((mode) => mode.frequency);
    for (const mode of run.coupled) {
      if (girders.some((frequency) => Math.abs(frequency / mode.frequency_hz - 1) < 1e-3)) continue;
      add(mode.frequency_hz, `coupled ${number(mode.frequency_hz, 3)} Hz, ζ ${number(mode.damping_ratio, 2)}`, "coupled");
    }
  }
  return [...marks.values()].sort((a, b) => a.at - b.at);
}

/** Frequency up to which spectra are shown first, above the marked modes and the chirp; null if unknown. */
function interestingTop() {
  const tops = data.runs.flatMap((run) => [
    ...(run.guideway?.modes ?? []).map((mode) => 3 * mode.frequency),
    ...(run.guideway?.chirp ? [1.1 * run.guideway.chirp.end_frequency] : []),
  ]);
  return tops.length > 0 ? Math.max(...tops) : null;
}

/** Spectra of a signal in all runs: [{ run, name, unit, curve }]. */
function spectraOf(name, kind) {
  return data.runs.flatMap((run, r) => {
    const signal = run.signals.find((it) => it.name === name);
    return signal?.spectra ? [{ run, r, name, unit: signal.unit, curve: signal.spectra[kind] }] : [];
  });
}

/** Signals that are shown first: the largest deflection and a gap. */
function firstSignals(names) {
  const roles = new Map(data.runs.flatMap((run) => run.signals.map((it) => [it.name, it.role])));
  const depth = (name) => Math.max(...data.runs.map((run) => -(run.summary?.signals?.[name]?.min ?? 0)));
  const of = (role) => names.filter((name) => roles.get(name) === role).sort((a, b) => depth(b) - depth(a));
  const deflections = [...of("midspan"), ...of("quarter")];
  const gap = names.find((name) => roles.get(name) === "gap");
  const first = [deflections[0], gap].filter(Boolean);
  const drawn = allPlots().flatMap((plot) => plot.panels.flatMap((panel) => panel.signals)).filter((name) => names.includes(name));
  return first.length > 0 ? first : (drawn.length > 0 ? drawn : names).slice(0, 2);
}

class SpectraView {
  constructor(parent, names) {
    Object.assign(this, { names, chosen: [], charts: [], kind: "amplitude", logX: false, logY: true });
    const choose = (label, options, value, set) => {
      const list = options.map(([key, text]) => element("option", { value: key, selected: key === value }, text));
      const select = element("select", { "aria-label": label }, list);
      select.addEventListener("change", () => { set(select.value); this.draw(); });
      return element("label", { class: "choice" }, `${label} `, select);
    };
    parent.append(element("div", { class: "choices" },
      choose("Spectrum", [["amplitude", "amplitude"], ["density", "power spectral density (Welch)"]], this.kind, (value) => { this.kind = value; }),
      choose("Frequency", [["linear", "linear"], ["log", "logarithmic"]], "linear", (value) => { this.logX = value === "log"; }),
      choose("Values", [["log", "logarithmic"], ["linear", "linear"]], "log", (value) => { this.logY = value === "log"; })));
    this.plots = element("div");
    this.peaks = element("div");
    const details = element("details", {}, element("summary", {}, "Choose signals"));
    const picker = new Picker(details, { names, label: "signals of spectra", change: (list) => { this.chosen = list; this.draw(); } });
    parent.append(details, this.plots, this.peaks);
    picker.toggle(firstSignals(names));
  }

  draw() {
    this.charts.forEach((chart) => chart.destroy());
    this.axis = new Axis({ label: "frequency (Hz)", log: this.logX, format: (value) => `${number(value, 5)} Hz` });
    const byUnit = Map.groupBy(this.chosen, (name) => unitOf(name) ?? "");
    this.charts = [...byUnit.values()].map((members) => this.chart(members));
    const top = interestingTop();
    if (top && this.charts.length > 0 && !this.logX) this.axis.show([0, top]);
    this.listPeaks();
  }

  chart(members) {
    const form = SPECTRA[this.kind];
    const all = members.map((name) => spectraOf(name, this.kind));
    const size = Math.max(...all.flat().map((it) => largest(signalOf(it.run, it.name).y)));
    const shown = shownUnit(unitOf(members[0]), size);
    const factor = form.factor(shown.factor);
    const curves = all.flatMap((list, k) => list.map((it) => ({
      label: runPrefix(it.run) + it.name,
      x: arrays.get(it.run.frequencies[it.curve.frequencies]),
      y: arrays.get(it.curve.values).map((value) => value * factor),
      colour: k * data.runs.length + it.r,
      dash: it.r,
    })));
    const highest = Math.max(...curves.map((curve) => largest(curve.y)));
    return new Chart(this.plots, {
      title: "", ylabel: withUnit(form.title, form.unit(shown.unit)), axis: this.axis, curves,
      marks: modeMarks(), logY: this.logY, lowest: highest * (this.kind === "density" ? 1e-14 : 1e-8), height: 300,
    });
  }

  /** Peaks of the first chosen signals. */
  listPeaks() {
    const rows = this.chosen.slice(0, 8).flatMap((name) => spectraOf(name, this.kind).flatMap((it) => it.curve.peaks.map((peak) => ({ ...it, ...peak }))));
    this.peaks.replaceChildren();
    if (rows.length === 0) return;
    const form = SPECTRA[this.kind];
    const shown = new Map(this.chosen.map((name) => [name, shownUnit(unitOf(name), Math.max(...data.runs.map((run) => largest(signalOf(run, name)?.y ?? []))))]));
    const columns = [
      { title: "signal", of: (row) => runPrefix(row.run) + row.name },
      { title: "frequency (Hz)", numeric: true, of: (row) => row.frequency, text: (row) => number(row.frequency, 5) },
      { title: form.title, numeric: true, of: (row) => row.value, text: (row) => `${number(row.value * form.factor(shown.get(row.name).factor), 4)} ${form.unit(shown.get(row.name).unit)}` },
      { title: "damping ratio", numeric: true, of: (row) => row.damping, text: (row) => (row.damping == null ? "–" : number(row.damping, 3)) },
      { title: "nearest mode", of: (row) => nearestMode(row.frequency) },
    ];
    const { resolution } = rows[0].curve;
    const { table } = sortable(`Highest peaks; bins are ${number(resolution, 3)} Hz apart`, columns, rows);
    const note = this.kind === "density"
      ? "Damping from the half-power width, corrected for the window; – if segments of a quarter of the record do not resolve the width."
      : "The Hann window widens the peaks. The power spectral density shows the damping.";
    this.peaks.append(element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Peaks" }, table), element("p", { class: "note" }, note));
  }
}

/** Label of the nearest mark within 5 % of a frequency. */
function nearestMode(frequency) {
  const near = modeMarks().map((mark) => ({ ...mark, off: Math.abs(mark.at / frequency - 1) })).filter((mark) => mark.off < 0.05);
  near.sort((a, b) => a.off - b.off);
  return near.length > 0 ? near[0].label : "";
}

function spectraSection() {
  const names = allSignals().filter((name) => spectraOf(name, "amplitude").length > 0);
  if (names.length === 0) return;
  const without = allSignals().length - names.length;
  const it = section("spectra", "Spectra", markLegend());
  new SpectraView(it, names);
  if (without > 0) {
    const errors = new Set(data.runs.flatMap((run) => run.signals.map((signal) => signal.spectra_error).filter(Boolean)));
    it.append(element("p", { class: "note" }, `${without} signals have no spectrum: ${[...errors].join("; ")}`));
  }
}

/** Explains the marks. */
function markLegend() {
  const kinds = new Set(modeMarks().map((mark) => mark.kind));
  if (kinds.size === 0) return null;
  const texts = { girder: "dashed: modes of the empty girder", coupled: "dotted: modes of the coupled system (maglev modes)" };
  const missing = data.runs.some((run) => run.modes) ? "" : " · coupled modes: `maglev report --modes`";
  return element("p", { class: "hint" }, [...kinds].map((kind) => texts[kind]).join(" · ") + missing);
}
