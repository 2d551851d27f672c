// Sections that other parts of the program fill: notes, tables, pictures.

function cellText(cell) {
  if (cell === "none") return "–";
  if (cell.text != null) return cell.text;
  if (cell.quantity) {
    const { value, unit } = cell.quantity;
    const shown = shownUnit(unit, Math.abs(value ?? 0));
    return `${number(value == null ? null : value * shown.factor, 4)} ${shown.unit}`.trim();
  }
  return number(cell.number, 6);
}

function cellValue(cell) {
  return cell === "none" ? null : cell.text ?? cell.number ?? cell.quantity?.value;
}

/** A picture in the page. */
function captioned(svg, text) {
  const image = element("img", { src: `data:image/svg+xml;utf8,${encodeURIComponent(svg)}`, alt: text, loading: "lazy", style: "width: 100%; height: auto; background: white" });
  return element("figure", {}, image, element("figcaption", {}, text));
}

function filledSections() {
  for (const { id, title, short, notes, tables, figures } of data.sections) {
    SHORT[id] = short;
    const it = section(id, title, ...notes.map(({ text, warning }) => element("p", { class: warning ? "error" : "hint" }, text)));
    for (const { caption, columns, rows } of tables) {
      const heads = columns.map(([name, numeric], k) => ({ title: name, numeric, of: (row) => cellValue(row[k]), text: (row) => cellText(row[k]) }));
      it.append(scrolling(caption, sortable(caption, heads, rows).table));
    }
    it.append(...figures.map(({ svg, caption }) => captioned(svg, caption)));
  }
}
