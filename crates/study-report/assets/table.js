// All points: to sort, to filter, with links to single reports.

/** Rows shown at first, and added by the button. */
const ROWS = 200;

/** A test from the text of the filter: words that a row contains, and comparisons such as speed>10 or status=failed. */
function testOf(text) {
  const tests = text.trim().split(/\s+/).filter(Boolean).map((word) => {
    const parts = /^(.+?)(>=|<=|!=|=|>|<)(.*)$/.exec(word);
    const column = parts && points.columns.find((it) => [it.name, it.title].some((name) => name.toLowerCase() === parts[1].toLowerCase()));
    const own = parts && { point: (k) => points.numbers[k], status: points.status, limits: points.verdict }[parts[1].toLowerCase()];
    if (column || own) {
      const value = (k) => (own ? own(k) : column.texts ? column.texts[column.values[k]] : column.values[k] * shownOf(column).factor);
      const wanted = Number(parts[3]);
      const same = (k) => (typeof value(k) === "number" ? Math.abs(value(k) - wanted) <= 1e-4 * Math.abs(wanted) : String(value(k)).toLowerCase() === parts[3].toLowerCase());
      return { ">": (k) => value(k) > wanted, "<": (k) => value(k) < wanted, ">=": (k) => value(k) >= wanted, "<=": (k) => value(k) <= wanted, "=": same, "!=": (k) => !same(k) }[parts[2]];
    }
    const part = word.toLowerCase();
    return (k) => `${points.status(k)} ${points.verdict(k)} ${points.messages.get(points.numbers[k]) ?? ""} ${points.columns.filter((it) => it.texts).map((it) => it.texts[it.values[k]]).join(" ")}`.toLowerCase().includes(part);
  });
  return (k) => tests.every((test) => test(k));
}

class PointTable {
  constructor(parent) {
    this.shown = ROWS;
    this.order = { column: null, up: true };
    this.filter = element("input", { type: "search", placeholder: "filter: failed, speed>10, status=finished", "aria-label": "Filter the points", class: "filter" });
    this.filter.addEventListener("input", () => { this.shown = ROWS; this.fill(); });
    this.count = element("p", { class: "note", "aria-live": "polite" });
    this.more = element("button", { type: "button", class: "action" }, "more rows");
    this.more.addEventListener("click", () => { this.shown += 5 * ROWS; this.fill(); });
    this.columns = this.list();
    this.heads = this.columns.map((column, n) => element("th", { scope: "col", class: column.numeric ? "number" : "" }, element("button", { type: "button", onclick: () => this.sort(n) }, column.title)));
    this.body = element("tbody");
    const table = element("table", { class: "sortable" }, element("caption", {}, "All points"), element("thead", {}, element("tr", {}, this.heads)), this.body);
    parent.append(this.filter, scrolling("Points", table), this.count, this.more);
    selection.subscribers.push(() => this.fill());
    this.fill();
  }

  list() {
    const of = (column) => ({ title: titleOf(column), numeric: !column.texts, of: (k) => column.values[k], text: (k) => textOf(column, column.values[k]) });
    const kind = (name) => points.columns.filter((it) => it.kind === name);
    const judged = data.verdicts.some((it) => it !== "");
    return [
      { title: "point", numeric: true, of: (k) => points.numbers[k], text: (k) => this.link(k) },
      ...kind("factor").map(of),
      ...kind("seeds").map((column) => ({ ...of(column), text: (k) => number(column.values[k], 12) })),
      { title: "status", of: points.status },
      ...points.columns.filter((it) => it.kind === "figure").map(of),
      ...(judged ? [{ title: "limits", of: points.verdict }] : []),
      ...(points.reached.some(Number.isFinite) ? [{ title: "reached (s)", numeric: true, of: (k) => points.reached[k], text: (k) => number(points.reached[k], 6) }] : []),
      ...(points.messages.size > 0 ? [{ title: "message", of: (k) => points.messages.get(points.numbers[k]) ?? "" }] : []),
    ];
  }

  /** The number of a point, as a link to its report if there is one. */
  link(k) {
    const text = number(points.numbers[k], 9);
    const path = points.reports.get(k);
    return path ? element("a", { href: path }, text) : text;
  }

  sort(n) {
    this.order = { column: n, up: this.order.column === n ? !this.order.up : true };
    this.heads.forEach((head, k) => head.setAttribute("aria-sort", k === n ? (this.order.up ? "ascending" : "descending") : "none"));
    this.fill();
  }

  fill() {
    const test = testOf(this.filter.value);
    let rows = Array.from({ length: points.count }, (_, k) => k).filter((k) => selection.has(k) && test(k));
    if (this.order.column !== null) {
      const { of } = this.columns[this.order.column];
      const sign = this.order.up ? 1 : -1;
      const known = (value) => (typeof value === "number" ? Number.isFinite(value) : value !== "");
      // what is missing comes last, both ways
      rows.sort((a, b) => {
        const [x, y] = [of(a), of(b)];
        if (known(x) !== known(y)) return known(x) ? -1 : 1;
        return sign * (typeof x === "number" ? x - y || 0 : String(x).localeCompare(String(y), "en", { numeric: true }));
      });
    }
    const all = rows.length;
    rows = rows.slice(0, this.shown);
    this.body.replaceChildren(...rows.map((k) => element("tr", { class: points.well[k] ? "" : "lost" }, this.columns.map((column, n) => {
      const text = column.text ? column.text(k) : column.of(k);
      return n === 0 ? element("th", { scope: "row", class: "number" }, text) : element("td", { class: column.numeric ? "number" : "" }, text);
    }))));
    this.count.textContent = `${number(all, 9)} of ${number(points.count, 9)} points${all > rows.length ? `, the first ${rows.length} are shown` : ""}. ${points.reports.size > 0 ? "The numbers of points whose results were kept are links to their reports." : ""}`;
    this.more.hidden = all <= rows.length;
  }
}

function tableSection() {
  const it = section("points", "Points");
  it.view = new PointTable(it);
}
