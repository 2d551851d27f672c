// Frequency responses and margins of loops, from response.json.

const RESPONSE_FIGURES = {
  "response": "Frequency responses",
  "loop-bode": "Bode diagram of the loops",
  "nyquist": "Nyquist diagram; the circle around −1 has the modulus margin as its radius",
  "nichols": "Nichols diagram; contours |1 + L| = 0.25 and 0.5",
  "sensitivity": "Sensitivity",
  "loci": "Characteristic loci of all loops",
  "root-locus": "Root locus; marks at its first value, rays of damping ratio 0.05, 0.1 and 0.2",
};

function marginColumns() {
  const at = (it) => (it?.frequency_hz == null ? "" : ` (${number(it.frequency_hz, 4)} Hz)`);
  const gain = (it) => (it ? `×${number(it.factor, 4)}${at(it)}` : "none");
  return [
    { title: "loop broken at", of: (row) => row.at },
    { title: "gain down to", numeric: true, of: (row) => row.margins.gain_down?.factor, text: (row) => gain(row.margins.gain_down) },
    { title: "gain up to", numeric: true, of: (row) => row.margins.gain_up?.factor, text: (row) => gain(row.margins.gain_up) },
    { title: "phase", numeric: true, of: (row) => row.margins.phase?.degrees, text: ({ margins: { phase } }) => (phase ? `${number(phase.degrees, 4)}°${phase.direction === "lead" ? " lead" : ""}${at(phase)}` : "none") },
    { title: "delay", numeric: true, of: (row) => row.margins.delay?.seconds, text: ({ margins: { delay } }) => (delay ? `${number(1e3 * delay.seconds, 4)} ms${at(delay)}` : "none") },
    { title: "modulus", numeric: true, of: (row) => row.margins.modulus.value, text: ({ margins: { modulus } }) => `${number(modulus.value, 4)}${at(modulus)}` },
    { title: "largest |S|", numeric: true, of: (row) => 1 / row.margins.modulus.value, text: (row) => number(1 / row.margins.modulus.value, 4) },
  ];
}

function responseSection() {
  const runs = data.runs.filter((run) => run.response);
  if (runs.length === 0) return;
  const it = section("margins", "Frequency responses and margins");
  const wide = (label, table) => element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": label }, table);
  for (const run of runs) {
    const { time, stable, responses, loops, sampled, equal, independent, figures } = run.response;
    const state = stable ? "stable" : "UNSTABLE: there are no margins, and no run shows these responses";
    it.append(element("p", { class: stable ? "hint" : "error" }, `${runPrefix(run)}Of the system linearised at t = ${number(time)} s, the start of the run. It is ${state}.`));
    if (responses.length > 0) {
      const columns = [
        { title: "from", of: (row) => row.from },
        { title: "to", of: (row) => row.to },
        { title: "largest amplitude", numeric: true, of: (row) => row.peak, text: (row) => `${number(row.peak, 4)} ${row.unit}` },
        { title: "at (Hz)", numeric: true, of: (row) => row.frequency_hz, text: (row) => number(row.frequency_hz, 5) },
      ];
      it.append(wide("Frequency responses", sortable("Frequency responses", columns, responses).table));
    }
    const rows = loops.filter((row) => row.margins);
    if (equal) rows.push({ at: "the same change in all loops", margins: equal });
    if (rows.length > 0) {
      const held = sampled ? `; values are held for ${number(sampled[0])} s and act ${sampled[1]} samples later` : "";
      it.append(wide("Margins", sortable(`Margins, each loop broken while the others are closed${held}`, marginColumns(), rows).table));
    }
    if (independent) it.append(element("p", {}, `Different changes in all loops: the least singular value of I + L is ${number(independent.value, 4)}${independent.frequency_hz == null ? "" : ` at ${number(independent.frequency_hz, 4)} Hz`}.`));
    for (const [name, svg] of figures) {
      const text = RESPONSE_FIGURES[name] ?? name;
      const image = element("img", { src: `data:image/svg+xml;utf8,${encodeURIComponent(svg)}`, alt: text, loading: "lazy", style: "width: 100%; height: auto; background: white" });
      it.append(element("figure", {}, image, element("figcaption", {}, text)));
    }
  }
}
