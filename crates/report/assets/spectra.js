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

/** Spectra are shown up to where all amplitudes stay below this fraction of the highest. */
const CONTENT = 1e-3;

/** Frequency up to which spectra are shown first: that of their content, of the marked modes and of the chirp. */
function interestingTop(curves, kind) {
  const floor = kind === "density" ? CONTENT ** 2 : CONTENT;
  const content = (curve) => {
    const highest = largest(curve.y);
    let k = curve.y.length - 1;
    while (k > 0 && !(curve.y[k] > floor * highest)) k--;
    return 1.2 * (curve.x[k] ?? 0);
  };
  const chirps = data.runs.map((run) => 1.1 * (run.guideway?.chirp?.end_frequency ?? 0));
  return Math.max(...curves.map(content), ...modeMarks().map((mark) => 1.15 * mark.at), ...chirps);
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
    Object.assign(this, { names, chosen: [], charts: [], kind: "amplitude", logX: false, logY: true, zoomed: false });
    const choose = (label, options, value, set) => {
      const list = options.map(([key, text]) => element("option", { value: key, selected: key === value }, text));
      const select = element("select", { "aria-label": label }, list);
      select.addEventListener("change", () => { set(select.value); this.draw(); });
      return element("label", { class: "choice" }, `${label} `, select);
    };
    parent.append(element("div", { class: "choices" },
      choose("Spectrum", [["amplitude", "amplitude"], ["density", "power spectral density (Welch)"]], this.kind, (value) => { this.kind = value; }),
      choose("Frequency", [["linear", "linear"], ["log", "logarithmic"]], "linear", (value) => { this.logX = value === "log"; }),
      choose("Values", [["log", "logarithmic"], ["linear", "linear"]], "log", (value) => { this.logY = value === "log"; }),
      choose("Part", [["all", "whole run"], ["zoomed", "window of the time histories"]], "all", (value) => { this.zoomed = value === "zoomed"; })));
    timeAxis.watch(() => this.zoomed && this.draw());
    this.window = element("p", { class: "note" });
    this.plots = element("div");
    this.peaks = element("div");
    const details = element("details", {}, element("summary", {}, "Choose signals"));
    const picker = new Picker(details, { names, label: "signals of spectra", change: (list) => { this.chosen = list; this.draw(); } });
    parent.append(details, this.window, this.plots, this.peaks);
    picker.toggle(firstSignals(names));
  }

  draw() {
    this.charts.forEach((chart) => chart.destroy());
    this.axis = new Axis({ label: "frequency (Hz)", log: this.logX, format: (value) => `${number(value, 5)} Hz` });
    this.spectra = new Map(this.chosen.map((name) => [name, this.spectraOf(name)]));
    this.describeWindow();
    const byUnit = Map.groupBy(this.chosen.filter((name) => this.spectra.get(name).length > 0), (name) => unitOf(name) ?? "");
    this.charts = [...byUnit.values()].map((members) => this.chart(members));
    if (this.charts.length > 0) {
      const top = interestingTop(this.charts.flatMap((chart) => chart.curves), this.kind);
      this.axis.show([this.logX ? this.axis.limits[0] : 0, top]);
    }
    this.listPeaks();
  }

  /** Spectra of a signal: [{ run, r, name, unit, x, y, resolution, peaks }]. */
  spectraOf(name) {
    if (this.zoomed) return partsOf(name, this.kind, timeAxis.range());
    return spectraOf(name, this.kind).map((it) => ({
      ...it, ...it.curve, x: arrays.get(it.run.frequencies[it.curve.frequencies]), y: arrays.get(it.curve.values),
    }));
  }

  /** Says of which time the spectra are, and which signals have none. */
  describeWindow() {
    this.window.replaceChildren();
    if (!this.zoomed) return;
    const [from, to] = timeAxis.range();
    const without = this.chosen.filter((name) => this.spectra.get(name).length < spectraOf(name, this.kind).length);
    const why = `Without a spectrum of this window: ${without.join(", ")}. The page holds these signals thinned or unevenly spaced, or the window has fewer than ${FEWEST} points; signals that the scenario plots are kept whole.`;
    this.window.textContent = `Spectra of ${number(from, 6)} s to ${number(to, 6)} s, the window that the time histories show. ${without.length > 0 ? why : ""}`;
  }

  chart(members) {
    const form = SPECTRA[this.kind];
    const all = members.map((name) => this.spectra.get(name));
    const size = Math.max(...all.flat().map((it) => largest(signalOf(it.run, it.name).y)));
    const shown = shownUnit(unitOf(members[0]), size);
    const factor = form.factor(shown.factor);
    const curves = all.flatMap((list, k) => list.map((it) => ({
      label: runPrefix(it.run) + it.name,
      x: it.x,
      y: it.y.map((value) => value * factor),
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
    const rows = this.chosen.slice(0, 8).flatMap((name) => this.spectra.get(name).flatMap((it) => it.peaks.map((peak) => ({ ...it, ...peak }))));
    this.peaks.replaceChildren();
    if (rows.length === 0) {
      if (this.charts.length > 0) this.peaks.append(element("p", { class: "note" }, "No peak stands out: none exceeds its neighbours by 6 dB and a thousandth of the signal's range."));
      return;
    }
    const form = SPECTRA[this.kind];
    const shown = new Map(this.chosen.map((name) => [name, shownUnit(unitOf(name), Math.max(...data.runs.map((run) => largest(signalOf(run, name)?.y ?? []))))]));
    const columns = [
      { title: "signal", of: (row) => runPrefix(row.run) + row.name },
      { title: "frequency (Hz)", numeric: true, of: (row) => row.frequency, text: (row) => number(row.frequency, 5) },
      { title: form.title, numeric: true, of: (row) => row.value, text: (row) => `${number(row.value * form.factor(shown.get(row.name).factor), 4)} ${form.unit(shown.get(row.name).unit)}` },
      { title: "damping ratio", numeric: true, of: (row) => row.damping, text: (row) => (row.damping == null ? "–" : number(row.damping, 3)) },
      { title: "nearest mode", of: (row) => nearestMode(row.frequency) },
    ];
    const { resolution } = rows[0];
    const { table } = sortable(`Highest peaks; bins are ${number(resolution, 3)} Hz apart`, columns, rows);
    const note = this.kind === "density"
      ? (this.zoomed ? "Spectra of the whole run show the damping." : "Damping from the half-power width, corrected for the window; – if segments of a quarter of the record do not resolve the width.")
      : "The Hann window widens the peaks. The power spectral density shows the damping.";
    this.peaks.append(scrolling("Peaks", table), element("p", { class: "note" }, note));
  }
}

/** Spectra of the part of a signal between two times, where the page has every point of it. */
function partsOf(name, kind, [from, to]) {
  return data.runs.flatMap((run, r) => {
    const signal = signalOf(run, name);
    const clock = run.clocks[run.byName.get(name)?.series.clock];
    if (!signal || signal.pair > 1 || clock.times) return [];
    const first = Math.max(0, Math.ceil((from - clock.start) / clock.step - 1e-6));
    const end = Math.min(signal.y.length, Math.floor((to - clock.start) / clock.step + 1e-6) + 1);
    const values = Float64Array.from(signal.y.subarray(first, end));
    if (values.length < FEWEST || !values.every(Number.isFinite)) return [];
    const it = partialSpectrum(values, 1 / clock.step, kind);
    // as in spectra.rs: what is small in the range of the signal, or below its noise, is no peak
    const [low, high] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
    const least = Math.max(5e-4 * (high - low), 1e-5 * largest(values), signal.unit === "m" ? 1e-7 : 0);
    const floor = kind === "density" ? least ** 2 / (3 * it.resolution) : least;
    return [{ run, r, name, unit: signal.unit, ...it, peaks: spectrumPeaks(it, kind, floor) }];
  });
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
  // for tests
  it.view = new SpectraView(it, names);
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
