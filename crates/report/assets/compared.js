// Key figures of several runs, with differences from the first run where these mean something.

/** Runs from which on they are the rows of the table: more columns do not fit on paper. */
const MANY_RUNS = 4;

/**
 * The difference of a figure from that of the first run as text, null if it means nothing: percentages in points, ratios
 * of positive numbers in per cent or as a factor, everything else in its unit.
 */
function difference(it, first) {
  if (!first || it.incomparable || !Number.isFinite(it.value) || !Number.isFinite(first.value)) return null;
  const sign = (value) => (value < 0 ? "−" : "+");
  const change = it.value - first.value;
  if (it.unit === "%") {
    const text = number(Math.abs(change), 2);
    return Number(text) === 0 || change === 0 ? "=" : `${sign(change)}${text} points`;
  }
  if (it.value > 0 && first.value > 0) {
    const ratio = it.value / first.value;
    if (Math.abs(ratio - 1) < 5e-5) return "=";
    if (ratio >= 3 || ratio <= 1 / 3) return `× ${number(ratio, 2)}`;
    return `${sign(change)}${number(100 * Math.abs(ratio - 1), 2)} %`;
  }
  if (change === 0) return "=";
  const shown = shownUnit(it.unit, Math.abs(change));
  return `${sign(change)}${number(Math.abs(change) * shown.factor, 3)} ${shown.unit}`.trim();
}

/** The value of a figure in a cell, with its difference. */
function figureCell(it, first) {
  if (!it) return element("td", { class: "number" }, "–");
  const shown = shownUnit(it.unit, Math.abs(it.value));
  const text = difference(it, first);
  return element("td", { class: "number", title: it.note }, `${number(it.value * shown.factor, 4)} ${shown.unit}`, text && element("span", { class: "small" }, ` ${text}`));
}

/** A column of figures for each run, or a row for each of many runs. */
function compared(lists) {
  const labels = [...new Set(lists.flatMap((list) => list.map((it) => it.label)))];
  const of = (list, label) => list.find((one) => one.label === label);
  const column = (text, numeric = true) => element("th", { scope: "col", class: numeric ? "number" : "" }, text);
  const cell = (k, label) => figureCell(of(lists[k], label), k > 0 ? of(lists[0], label) : null);
  const many = data.runs.length >= MANY_RUNS;
  const head = many ? [column("run", false), ...labels.map((label) => column(label))] : [column("figure", false), ...data.runs.map((run) => column(run.name))];
  const rows = many
    ? data.runs.map((run, k) => [element("th", { scope: "row" }, run.name), ...labels.map((label) => cell(k, label))])
    : labels.map((label) => [element("th", { scope: "row" }, label), ...lists.map((_, k) => cell(k, label))]);
  return scrolling("Key figures", element("table", { class: many ? "many" : "" }, element("caption", {}, `Key figures, with differences from ${data.runs[0].name}`),
    element("thead", {}, element("tr", {}, head)), element("tbody", {}, rows.map((cells) => element("tr", {}, cells)))));
}
