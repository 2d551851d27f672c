// What was studied, and how its points ended.

/** The values of a factor in words. */
function rangeOf(column) {
  const given = data.study.factors?.[column.name] ?? {};
  if (given.distribution) {
    const [kind, parameters] = Object.entries(given.distribution)[0] ?? [];
    return `${kind}: ${Object.entries(parameters ?? {}).map(([name, value]) => `${name.replaceAll("_", " ")} ${typeof value === "number" ? number(value) : value}`).join(", ")}`;
  }
  const levels = levelsOf(column);
  if (column.kind === "seeds") return `${given.seeds ?? levels.length} seeds`;
  if (column.texts) return column.texts.join(", ");
  if (levels.length <= 12) return [...levels].map((value) => number(value)).join(", ");
  return `${levels.length} values from ${number(levels[0])} to ${number(levels[levels.length - 1])}`;
}

function headSection() {
  const { study } = data;
  document.title = data.title;
  main.append(element("h1", {}, data.title));
  const counts = new Map();
  for (let k = 0; k < points.count; k++) counts.set(points.status(k), (counts.get(points.status(k)) ?? 0) + 1);
  const all = study.as_run?.points;
  const open = all > points.count ? ` of ${number(all, 9)}; the study is not complete` : "";
  const badges = [...counts].sort((a, b) => b[1] - a[1]).map(([status, count]) => element("span", { class: `badge ${status}` }, `${number(count, 9)} ${status}`));
  main.append(element("p", { class: "status" }, `${number(points.count, 9)} points${open}: `, badges.flatMap((it) => [it, " "])));
  const judged = { passed: 0, failed: 0, "not-judged": 0 };
  for (let k = 0; k < points.count; k++) if (points.verdict(k) in judged) judged[points.verdict(k)]++;
  if (judged.passed + judged.failed > 0) main.append(element("p", {}, `${number(judged.passed, 9)} points keep all limits, ${number(judged.failed, 9)} do not${judged["not-judged"] ? `, ${number(judged["not-judged"], 9)} are not judged` : ""}.`));
  if (study.description) main.append(element("p", {}, study.description));
  const chosen = study.as_run?.chosen;
  if (chosen) main.append(element("p", {}, `Step for an accuracy of ${number(chosen.accuracy.wanted)}: ${chosen.accuracy.explanation}`));
  const columns = [
    { title: "factor", of: (row) => row.title },
    { title: "unit", of: (row) => prettyUnit(row.unit) },
    { title: "values", of: rangeOf },
    { title: "setting", of: (row) => { const target = study.factors?.[row.name]?.target; return typeof target === "string" ? target : target ? Object.values(target).join(" ") : ""; } },
  ];
  const kinds = { grid: "all combinations", table: "a table", "latin-hypercube": "Latin hypercube", sobol: "Sobol sequence", random: "random", saltelli: "Saltelli's design for Sobol indices" };
  const design = study.design?.kind ?? "grid";
  main.append(scrolling("Factors", sortable(`Factors; design: ${kinds[design] ?? design}`, columns, [...points.factors, ...points.seeds]).table));
}
