// Figures and limits: the verdicts of maglev run, or of maglev report --criteria.

/** A value in a unit that suits; a deflection over a span as 1/N. */
function judgedNumber(row, value) {
  if (value == null) return null;
  if (row.fraction && value > 0 && value < 0.2) return `1/${(1 / value).toFixed(0)}`;
  const shown = shownUnit(row.unit, Math.abs(value));
  return `${number(value * shown.factor, 4)} ${shown.unit}`.trim();
}

function verdictSection() {
  const rows = data.runs.flatMap((run) => run.verdicts.map((it) => ({ run: run.name, ...it })));
  if (rows.length === 0) return;
  const words = { passed: "passed", failed: "FAILED", not_judged: "not judged", no_limit: "" };
  const bound = (row) => [["min", row.min], ["max", row.max]].filter(([, value]) => value != null).map(([word, value]) => `${word} ${judgedNumber(row, value)}`).join(", ");
  const margin = (row) => (row.relative_margin != null ? `${number(100 * row.relative_margin, 3)} %` : judgedNumber(row, row.margin));
  const place = (row) => [row.place, row.detail, row.time == null ? "" : `at ${number(row.time, 7)} s`, row.reason].filter(Boolean).join("; ");
  const columns = [
    { title: "criterion", of: (row) => (row.judged > 1 ? `${row.title} (${row.judged})` : row.title) },
    ...(data.runs.length > 1 ? [{ title: "run", of: (row) => row.run }] : []),
    { title: "figure", numeric: true, of: (row) => row.value, text: (row) => judgedNumber(row, row.value) },
    { title: "limit", of: bound },
    { title: "margin", numeric: true, of: (row) => row.relative_margin ?? row.margin, text: margin },
    { title: "verdict", of: (row) => words[row.outcome] ?? row.outcome },
    { title: "where and when", of: place },
    { title: "source", of: (row) => [row.source, row.note].filter(Boolean).join("; ") },
  ];
  const failed = rows.filter((row) => row.outcome === "failed");
  const text = failed.length > 0 ? `${failed.length} of ${rows.length} fail: ${failed.map((row) => row.title).join(", ")}.` : null;
  section("limits", "Figures and limits", text ? element("p", { class: "error" }, text) : null,
    scrolling("Figures and limits", sortable("Margins in per cent of the limit", columns, rows).table));
}
