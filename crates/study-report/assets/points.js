// The points of a study: columns, which points have ended well, what the reader has selected.

const points = (() => {
  const numbers = arrays.get(data.points);
  const columns = data.columns.map((it, index) => ({ ...it, index, values: arrays.get(it.values) }));
  const status = arrays.get(data.status);
  const verdict = arrays.get(data.verdict);
  const well = Uint8Array.from(status, (code) => (["finished", "stopped"].includes(data.statuses[code]) ? 1 : 0));
  return {
    count: numbers.length,
    numbers,
    columns,
    well,
    reached: arrays.get(data.reached),
    setting: arrays.get(data.setting),
    status: (k) => data.statuses[status[k]],
    verdict: (k) => data.verdicts[verdict[k]],
    reports: new Map(data.reports),
    messages: new Map(data.messages),
    factors: columns.filter((it) => it.kind === "factor"),
    seeds: columns.filter((it) => it.kind === "seeds"),
    figures: columns.filter((it) => it.kind === "figure" && !it.texts),
  };
})();

/** 1 for points that did not end well, as a figure. */
const LOST = { title: "part that ended early or failed", name: "ended early or failed", unit: "", limits: [null, null], values: Float64Array.from(points.well, (it) => 1 - it), lost: true };
const someLost = LOST.values.some((it) => it === 1) && LOST.values.some((it) => it === 0);

/** Figures to choose from. */
function allFigures() {
  return someLost ? [...points.figures, LOST] : points.figures;
}

/** Values of a column that occur, rising. */
function levelsOf(column) {
  column.levels ??= Float64Array.from(new Set(column.values)).sort();
  return column.levels;
}

/** Unit and factor in which a column is shown: { unit, factor }. */
function shownOf(column) {
  if (column.lost || column.texts) return { unit: "", factor: 1 };
  column.shown ??= column.kind === "figure" ? shownUnit(column.unit, largest(column.values)) : { unit: prettyUnit(column.unit), factor: 1 };
  return column.shown;
}

/** Title of a column with its unit. */
function titleOf(column) {
  return withUnit(column.title, shownOf(column).unit);
}

/** A value of a column as text, without unit. */
function textOf(column, value, digits = 5) {
  if (column.texts) return column.texts[value] || "–";
  return number(value * shownOf(column).factor, digits);
}

/** Points that the reader has selected by parallel coordinates; null for all. Subscribers are called on changes. */
const selection = {
  kept: null,
  subscribers: [],
  has: (k) => selection.kept === null || selection.kept[k] === 1,
  set(kept) {
    selection.kept = kept;
    for (const subscriber of selection.subscribers) subscriber();
  },
};

/** Quantile of sorted numbers by linear interpolation. */
function quantile(sorted, part) {
  if (sorted.length === 0) return NaN;
  const at = part * (sorted.length - 1);
  const low = Math.floor(at);
  return low + 1 < sorted.length ? sorted[low] + (at - low) * (sorted[low + 1] - sorted[low]) : sorted[low];
}

function meanOf(list) {
  return list.reduce((sum, value) => sum + value, 0) / list.length;
}

/** A choice from a list; options [[key, text]]. `change` gets the key. */
function choice(label, options, value, change) {
  const list = options.map(([key, text]) => element("option", { value: key, selected: String(key) === String(value) }, text));
  const select = element("select", { "aria-label": label }, list);
  select.addEventListener("change", () => change(select.value));
  return element("label", { class: "choice" }, `${label} `, select);
}

/** A choice from columns. */
function columnChoice(label, columns, value, change) {
  return choice(label, columns.map((it, k) => [k, it.title]), columns.indexOf(value), (key) => change(columns[Number(key)]));
}
