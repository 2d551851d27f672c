// Tables of the signals: statistics, final texts of Strings.

/** A table that sorts by any column: columns [{ title, of: row => value, text?: row => text }]. */
function sortable(caption, columns, rows) {
  const body = element("tbody");
  let order = { column: null, up: true };
  const heads = columns.map((column, k) =>
    element("th", { scope: "col", class: column.numeric ? "number" : "" },
      element("button", { type: "button", onclick: () => sort(k) }, column.title)));
  function fill(sorted) {
    body.replaceChildren(...sorted.map((row) => element("tr", {}, columns.map((column, k) => {
      const text = column.text ? column.text(row) : column.of(row);
      return k === 0 ? element("th", { scope: "row" }, text) : element("td", { class: column.numeric ? "number" : "" }, text ?? "–");
    }))));
  }
  function sort(k) {
    order = { column: k, up: order.column === k ? !order.up : true };
    heads.forEach((head, j) => head.setAttribute("aria-sort", j === k ? (order.up ? "ascending" : "descending") : "none"));
    const compare = (a, b) => {
      const [x, y] = [columns[k].of(a) ?? -Infinity, columns[k].of(b) ?? -Infinity];
      return typeof x === "number" ? x - y : String(x).localeCompare(String(y), "en", { numeric: true });
    };
    fill([...rows].sort((a, b) => (order.up ? compare(a, b) : compare(b, a))));
  }
  fill(rows);
  const table = element("table", { class: "sortable" }, element("caption", {}, caption), element("thead", {}, element("tr", {}, heads)), body);
  return { table, filter: (keep) => fill(rows.filter(keep)) };
}

/** Final values of String signals. */
function textsSection() {
  const rows = data.runs.flatMap((run) => Object.entries(run.summary?.signals ?? {})
    .filter(([, it]) => it.final_text != null)
    .map(([name, it]) => ({ run: run.name, name, text: it.final_text })));
  if (rows.length === 0) return;
  const columns = [
    { title: "signal", of: (row) => row.name },
    ...(data.runs.length > 1 ? [{ title: "run", of: (row) => row.run }] : []),
    { title: "final value", of: (row) => row.text },
  ];
  section("texts", "String signals", scrolling("String signals", sortable("Final values of String signals", columns, rows).table));
}

function statisticsSection() {
  const rows = data.runs.flatMap((run) => Object.entries(run.summary?.signals ?? {})
    .filter(([, it]) => it.points)
    .map(([name, it]) => ({ run: run.name, name, ...it, shown: shownUnit(it.unit, Math.max(Math.abs(it.min), Math.abs(it.max))) })));
  if (rows.length === 0) return;
  const value = (title, key, digits = 5) => ({ title, numeric: true, of: (row) => row[key], text: (row) => number(row[key] * row.shown.factor, digits) });
  const time = (title, key) => ({ title, numeric: true, of: (row) => row[key], text: (row) => number(row[key], 7) });
  const columns = [
    { title: "signal", of: (row) => row.name },
    ...(data.runs.length > 1 ? [{ title: "run", of: (row) => row.run }] : []),
    { title: "unit", of: (row) => row.shown.unit },
    value("min", "min"), time("at (s)", "time_of_min"), value("max", "max"), time("at (s)", "time_of_max"),
    value("mean", "mean"), value("RMS", "rms"), value("final", "final"),
  ];
  const { table, filter } = sortable("Extremes and means over all communication points", columns, rows);
  const input = element("input", { type: "search", placeholder: "filter", "aria-label": "Filter the table" });
  input.addEventListener("input", () => filter((row) => row.name.toLowerCase().includes(input.value.toLowerCase())));
  section("statistics", "Extremes and means", input, scrolling("Extremes and means", table));
}
