// Shared by all parts of the page: data, elements, numbers with units, colours, the timeline.

const data = JSON.parse(document.getElementById("data").textContent);

/** Arrays of numbers; `get` takes a reference from the data: { at, len, kind }. */
const arrays = await (async () => {
  const text = atob(document.getElementById("arrays").textContent);
  const packed = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const kinds = { f64: Float64Array, f32: Float32Array, u8: Uint8Array };
  const known = new Map();
  return {
    get({ at, len, kind }) {
      if (!known.has(at)) {
        const values = new kinds[kind](len);
        const size = kinds[kind].BYTES_PER_ELEMENT;
        const target = new Uint8Array(values.buffer);
        // bytes of equal significance stand together
        for (let place = 0; place < size; place++) {
          const plane = at + place * len;
          for (let k = 0; k < len; k++) target[k * size + place] = bytes[plane + k];
        }
        known.set(at, values);
      }
      return known.get(at);
    },
  };
})();

/** Creates an element. Texts become text nodes, so nothing in the data is parsed as HTML. */
function element(tag, attributes = {}, ...children) {
  const it = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) it.addEventListener(name.slice(2), value);
    else if (value === true) it.setAttribute(name, "");
    else if (value !== false && value != null) it.setAttribute(name, value);
  }
  it.append(...children.flat().filter((child) => child != null));
  return it;
}

/** An element of a drawing. */
function svg(tag, attributes, ...children) {
  const it = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) it.setAttribute(name, value);
  it.append(...children);
  return it;
}

const main = document.getElementById("main");

/** Short names in the list of sections. */
const SHORT = { limits: "Limits", view: "3D", modes: "Modes", margins: "Margins", irregularity: "Irregularity", statistics: "Statistics" };

/** Adds a section with its heading to the page and to the list of sections. */
function section(id, title, ...children) {
  const heading = element("h2", { id: `${id}-title` }, title);
  const it = element("section", { id, "aria-labelledby": `${id}-title` }, heading, ...children);
  main.append(it);
  document.getElementById("sections").append(element("a", { href: `#${id}` }, SHORT[id] ?? title));
  return it;
}

/** A table in a box that scrolls on the screen and shows all of it on paper. */
function scrolling(label, table) {
  return element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": label }, table);
}

// ---- numbers and units ----

/** Formats a number with at most `digits` significant digits and a real minus sign. */
function number(value, digits = 5) {
  if (value == null || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  let text;
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    const power = `10${superscript(Number(exponent))}`;
    text = Number(mantissa) === 1 ? power : `${Number(mantissa)}·${power}`;
  } else {
    text = String(Number(value.toPrecision(digits)));
  }
  return text.replace(/-/g, "−");
}

function superscript(value) {
  return String(value).replace(/[-0-9]/g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]);
}

/** Units with a prefix: [unit, factor, largest magnitude for which it is used]. */
const PREFIXED = {
  m: [["mm", 1e3, 0.5], ["m", 1, Infinity]],
  N: [["N", 1, 5e3], ["kN", 1e-3, Infinity]],
  J: [["J", 1, 5e3], ["kJ", 1e-3, Infinity]],
  s: [["ms", 1e3, 0.5], ["s", 1, Infinity]],
  "m/s": [["mm/s", 1e3, 0.1], ["m/s", 1, Infinity]],
};

/** Unit in which values of this magnitude are shown, and the factor to it: { unit, factor }. */
function shownUnit(unit, size) {
  for (const [name, factor, below] of PREFIXED[unit] ?? []) {
    if (size < below) return { unit: name, factor };
  }
  return { unit: prettyUnit(unit), factor: 1 };
}

function prettyUnit(unit) {
  if (!unit || unit === "1") return "";
  return unit.replace(/\./g, "·").replace(/([A-Za-z])(-?\d+)/g, (_, name, power) => name + superscript(power));
}

/** Label with its unit in parentheses. */
function withUnit(label, unit) {
  return unit ? `${label} (${unit})` : label;
}

/** Largest magnitude among values, without NaN and infinite ones. */
function largest(values) {
  let size = 0;
  for (const value of values) if (Number.isFinite(value)) size = Math.max(size, Math.abs(value));
  return size;
}

// ---- signals ----

/** A signal of a run with its times and values: { run, name, unit, x, y, pair }. */
function signalOf(run, name) {
  run.byName ??= new Map(run.signals.map((it) => [it.name, it]));
  const it = run.byName.get(name);
  if (!it) return null;
  return { run, name, unit: it.unit, x: timesOf(run, it.series.clock), y: arrays.get(it.series.values), pair: it.series.points_per_pair };
}

function timesOf(run, index) {
  run.times ??= [];
  if (!run.times[index]) {
    const clock = run.clocks[index];
    run.times[index] = clock.times ? arrays.get(clock.times) : Float64Array.from({ length: clock.len }, (_, k) => clock.start + k * clock.step);
  }
  return run.times[index];
}

/** Names of the signals of all runs, without duplicates. */
function allSignals() {
  return [...new Set(data.runs.flatMap((run) => run.signals.map((it) => it.name)))];
}

/** Name of a run as a prefix; empty if there is only one. */
function runPrefix(run) {
  return data.runs.length > 1 ? `${run.name}: ` : "";
}

// ---- colours ----

// palette of Okabe and Ito, which colour-blind readers can distinguish; lighter on dark ground for contrast
const COLOURS = {
  light: ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b07d00", "#3a9bd8", "#8a7900", "#000000"],
  dark: ["#56b4e9", "#ff8a3d", "#2fd0a0", "#e69fc8", "#e6b400", "#8fd0ff", "#f0e442", "#ffffff"],
};
const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3], [14, 4], [5, 2, 2, 2, 2, 2]];

const theme = (() => {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const choices = ["auto", "light", "dark"];
  const texts = { auto: "◐ auto", light: "☀ light", dark: "☾ dark" };
  const button = document.getElementById("theme");
  let choice = "auto";
  let printing = false;
  const name = () => (printing ? "light" : choice === "auto" ? (system.matches ? "dark" : "light") : choice);
  function apply() {
    document.documentElement.dataset.theme = name();
    button.textContent = texts[choice];
    button.setAttribute("aria-label", `Colours: ${choice === "auto" ? "same as the system" : choice}; click to change`);
    document.dispatchEvent(new CustomEvent("themechange", { detail: name() }));
  }
  button.addEventListener("click", () => {
    choice = choices[(choices.indexOf(choice) + 1) % choices.length];
    apply();
  });
  system.addEventListener("change", apply);
  addEventListener("beforeprint", () => { printing = true; apply(); });
  addEventListener("afterprint", () => { printing = false; apply(); });
  document.documentElement.dataset.theme = name();
  return { name, apply };
})();

/** Colour number k in the current theme. */
function colour(k) {
  const list = COLOURS[theme.name()];
  return list[k % list.length];
}

/** A colour of the style sheet. */
function styleColour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

// polynomial fit of viridis (Zucker, CC0): perceptually uniform, readable in grey
const VIRIDIS = [
  [0.2777273272, 0.0054073445, 0.3340998053], [0.1050930431, 1.4046135299, 1.3845901626],
  [-0.3308618287, 0.2148475595, 0.0950951630], [-4.6342304990, -5.7991009734, -19.3324409563],
  [6.2282699363, 14.1799333668, 56.6905526007], [4.7763849978, -13.7451453777, -65.3530326334],
  [-5.4354558559, 4.6458526122, 26.3124352496],
];

/** Shade of viridis for 0 … 1 as [r, g, b] of 0 … 255. */
function viridis(x) {
  const t = Math.min(1, Math.max(0, x));
  return [0, 1, 2].map((channel) => {
    const sum = VIRIDIS.reduceRight((value, row) => value * t + row[channel], 0);
    return Math.round(255 * Math.min(1, Math.max(0, sum)));
  });
}

// ---- time, shared by all views ----

/** The time that the 3D view shows and the plots mark. Subscribers are notified of changes. */
const timeline = {
  time: null,
  subscribers: new Set(),
  /** Sets the time (s); `source` is not notified. */
  set(time, source) {
    timeline.time = time;
    for (const subscriber of timeline.subscribers) if (subscriber !== source) subscriber(time);
  },
  subscribe(subscriber) {
    timeline.subscribers.add(subscriber);
    return () => timeline.subscribers.delete(subscriber);
  },
};
