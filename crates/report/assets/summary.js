// Status, key figures, modes, details of the run, ride quality.

const STATUS = {
  finished: "finished",
  failed: "failed",
  interrupted: "interrupted",
  stopped: "ended by a stop condition",
  terminated: "ended by a unit",
  measured: "measured",
};

/** How one run ended. */
function statusLine(run) {
  const summary = run.summary ?? {};
  const name = summary.status ? STATUS[summary.status] ?? summary.status : "has not ended";
  const reached = summary.reached == null ? "" : ` at ${number(summary.reached)} s of ${number(summary.stop)} s`;
  const line = element("p", { class: "status" },
    element("span", { class: `badge ${summary.status ?? "open"}` }, name),
    data.runs.length > 1 ? element("strong", {}, ` ${run.name}: `) : " ", data.runs.length > 1 ? run.title + (reached && `,${reached}`) : reached);
  const changes = changed(run);
  if (!summary.error && summary.ended_by) return element("div", {}, line, changes, element("p", {}, summary.ended_by));
  if (!summary.error) return element("div", {}, line, changes);
  const causes = (summary.error.causes ?? []).map((text) => element("li", {}, text));
  return element("div", {}, line, changes, element("div", { class: "error", role: "alert" }, element("ol", {}, causes),
    summary.error.help ? element("p", {}, summary.error.help) : null));
}

/** The settings that changed the scenario, and its title if that no longer fits. */
function changed(run) {
  const settings = run.changes.length > 0 ? `changed: ${run.changes.join(", ")}` : "";
  const scenario = run.scenario_title ? `scenario "${run.scenario_title}"` : "";
  const text = [scenario, settings].filter(Boolean).join(", ");
  return text ? element("p", { class: "changes" }, text) : null;
}

/** Key figures of a run: [{ label, value, unit, note, incomparable }]; the speed of computing depends on the machine. */
function figuresOf(run) {
  const list = [...run.figures];
  const { summary, least_damped: mode } = run;
  if (summary?.real_time_factor > 0) {
    const note = `${number(summary.wall_time?.run_seconds, 3)} s for ${number(summary.steps, 9)} steps`;
    list.push({ label: "Computing speed", value: summary.real_time_factor, unit: "× real time", note, incomparable: true });
  }
  if (mode) {
    const { damping_ratio: damping, frequency_hz: frequency } = mode.continuous;
    list.push({ label: "Least damped coupled mode", value: 100 * damping, unit: "%", note: `at ${number(frequency, 4)} Hz, linearised at the start${uncoupled(run) ? `, without ${uncoupled(run)}` : ""}: ${shares(mode.participation)}` });
  }
  return list;
}

/** Key figures: tiles for one run, a table with differences for several. */
function keyFigures() {
  const lists = data.runs.map(figuresOf);
  if (lists.every((list) => list.length === 0)) return null;
  if (lists.length > 1) return compared(lists);
  return element("dl", { class: "tiles" }, lists[0].map((it) => {
    const shown = shownUnit(it.unit, Math.abs(it.value));
    return element("div", { class: "tile" }, element("dt", {}, it.label),
      element("dd", {}, element("strong", {}, number(it.value * shown.factor, 4)), ` ${shown.unit}`), element("dd", { class: "small" }, it.note));
  }));
}

/** Participation, summed over instances whose names differ only in numbers: "ems_# (48) 29 %". */
function shares(participation) {
  const groups = new Map();
  for (const [name, share] of Object.entries(participation)) {
    const key = name.replace(/\d+/g, "#");
    const group = groups.get(key) ?? { count: 0, share: 0, name };
    groups.set(key, { count: group.count + 1, share: group.share + share, name: group.name });
  }
  const list = [...groups].sort((a, b) => b[1].share - a[1].share).filter(([, it]) => it.share >= 0.01);
  return list.map(([key, it]) => `${it.count > 1 ? `${key} (${it.count})` : it.name} ${(100 * it.share).toFixed(0)} %`).join(", ");
}

/** Names of the instances that share no mode with another one. */
function uncoupled(run) {
  return (run.modes?.apart ?? []).filter((it) => it.states.length === it.of).map((it) => it.instance).join(", ");
}

/** Describes which states of an instance are not coupled at the operating point. */
function apartFrom({ instance, of, states }) {
  if (states.length === of) {
    return `${instance} is not coupled: none of its ${of} states shares a mode with another unit at this operating point. The verdict does not cover the stability of the system with ${instance}.`;
  }
  return `${states.length} of ${of} states of ${instance} share no mode with another unit at this operating point: ${states.slice(0, 6).join(", ")}${states.length > 6 ? ", …" : ""}.`;
}

function modesSection() {
  const runs = data.runs.filter((run) => run.modes);
  if (runs.length === 0) return;
  const it = section("modes", "Modes of the coupled system");
  for (const run of runs) {
    const { modes, stable, stepped_stable: stepped, step, operating_point: point } = run.modes;
    const missing = uncoupled(run);
    const without = missing ? `, WITHOUT ${missing}` : "";
    const says = (flag) => (flag ? "stable" : "UNSTABLE");
    it.append(element("p", {}, `${runPrefix(run)}At this operating point (t = ${number(point.time)} s, the start of the run)${without}: the continuous system is ${says(stable)}, as stepped with ${number(step)} s it is ${says(stepped)}; ${modes.length} modes.`));
    for (const apart of run.modes.apart) it.append(element("p", { class: apart.states.length === apart.of ? "error" : "hint" }, apartFrom(apart)));
    const columns = [
      { title: "frequency (Hz)", numeric: true, of: (row) => row.continuous.frequency_hz, text: (row) => number(row.continuous.frequency_hz, 5) },
      { title: "damping ratio", numeric: true, of: (row) => row.continuous.damping_ratio, text: (row) => number(row.continuous.damping_ratio, 3) },
      { title: "as stepped (Hz)", numeric: true, of: (row) => row.stepped?.frequency_hz, text: (row) => number(row.stepped?.frequency_hz, 5) },
      { title: "damping ratio as stepped", numeric: true, of: (row) => row.stepped?.damping_ratio, text: (row) => number(row.stepped?.damping_ratio, 3) },
      { title: "participation", of: (row) => shares(row.participation) + kindOfMode(run, row) },
    ];
    const { table, filter } = sortable("Least damped first", columns, modes);
    const box = element("input", { type: "checkbox" });
    const only = () => filter((row) => !box.checked || (row.participation[run.guideway?.instance] ?? 0) >= 0.1);
    box.addEventListener("change", only);
    if (run.guideway) it.append(element("label", { class: "choice" }, box, " only modes of the girders"));
    it.append(scrolling("Modes", table));
  }
}

/** What a mode in which hardly anything but a girder moves is: that of a girder without train, or of one below it. */
function kindOfMode(run, mode) {
  if ((mode.participation[run.guideway?.instance] ?? 0) < 0.99) return "";
  if (!run.empty_girders) return " (only girders)";
  return run.empty_girders[run.modes.modes.indexOf(mode)] ? " (an empty girder)" : " (a girder under the train)";
}

/** A table of names and values. */
function facts(rows) {
  return element("table", { class: "facts" }, element("tbody", {}, rows.filter(([, value]) => value != null && value !== "")
    .map(([name, value]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value)))));
}

/** Where the wall time went. The units' time is an estimate, which leaves a rest for the master only on one thread. */
function wallTime(wall, threads) {
  const rest = wall.master_seconds == null ? "" : `, master ${number(wall.master_seconds, 3)} s`;
  const units = rest === "" && threads <= 1 ? "nearly all in the units" : `units ${number(wall.units_seconds, 3)} s${threads > 1 ? ` on ${threads} threads` : ""}`;
  return `${number(wall.total_seconds, 3)} s: start ${number(wall.start_seconds, 3)} s, ${units}${rest}`;
}

function runInformation(run) {
  const summary = run.summary ?? {};
  const algorithm = summary.algorithm ?? {};
  const parts = [];
  if (data.runs.length > 1) parts.push(element("h3", {}, run.name));
  const wall = summary.wall_time ?? {};
  parts.push(facts([
    ["scenario", summary.scenario], ["description", run.description],
    ["simulated", summary.stop == null ? null : `${number(summary.start)} s to ${number(summary.reached)} s of ${number(summary.stop)} s, step ${number(summary.step)} s`],
    ["recorded", summary.rows == null ? null : `${number(summary.rows, 9)} rows of ${run.signals.length} signals`],
    ["coupling", algorithm.name ? `${algorithm.name}, extrapolation of degree ${algorithm.extrapolation}${algorithm.derivatives ? " with output derivatives" : ""}` : null],
    ["accuracy", algorithm.accuracy?.explanation],
    ["command line", (summary.overrides ?? []).join(", ")],
    ["wall time", wall.total_seconds == null ? null : wallTime(wall, algorithm.threads)],
    ["resumed", summary.resumed ? `${summary.resumed} times` : null],
    ["events", Object.entries(summary.events ?? {}).map(([kind, count]) => `${count} ${kind}`).join(", ")],
    ["master", summary.master_version], ["folder", run.folder],
  ]));
  const units = Object.entries(summary.units ?? {}).map(([name, it]) => ({ name, ...it }));
  if (units.length > 0) {
    const columns = [
      { title: "unit", of: (row) => row.name }, { title: "model", of: (row) => row.model }, { title: "version", of: (row) => row.version },
      { title: "instances", numeric: true, of: (row) => row.instances }, { title: "time in steps (s)", numeric: true, of: (row) => row.step_seconds, text: (row) => number(row.step_seconds, 3) },
      { title: "exported by", of: (row) => row.generation_tool }, { title: "GUID", of: (row) => row.guid },
    ];
    parts.push(scrolling("Units", sortable("Units", columns, units).table));
  }
  for (const it of run.parameters) parts.push(parameterTable(it));
  const messages = summary.messages ?? [];
  if (messages.length > 0) {
    parts.push(element("details", {}, element("summary", {}, `Messages of the units (${messages.length})`),
      element("ul", { class: "messages" }, messages.slice(0, 100).map((it) => element("li", {}, `${number(it.time, 7)} s, ${it.instance}: ${it.text}`)))));
  }
  if (run.scenario) parts.push(element("details", {}, element("summary", {}, "Scenario as run"), element("pre", { tabindex: "0" }, run.scenario)));
  return parts;
}

function parameterTable({ instances, unit, values }) {
  const columns = [
    { title: "parameter", of: (row) => row.name }, { title: "value", numeric: true, of: (row) => row.value, text: (row) => (typeof row.value === "number" ? number(row.value, 7) : String(row.value)) },
    { title: "unit", of: (row) => prettyUnit(row.unit) }, { title: "", of: (row) => (row.given ? "set by the scenario" : "default of the unit") }, { title: "description", of: (row) => row.description },
  ];
  const given = values.filter((row) => row.given).length;
  return element("details", {}, element("summary", {}, `Parameters of ${instances} (${unit}): ${values.length}, ${given} set by the scenario`),
    scrolling(`Parameters of ${instances}`, sortable(instances, columns, values).table));
}

function informationSection() {
  section("run", "Details of the run", data.runs.flatMap(runInformation), element("p", { class: "note" }, `Created by maglev ${data.version}.`));
}

/** Ride quality at the points of the scenario. */
function rideSection() {
  const directions = ["vertical", "lateral", "longitudinal"];
  const rows = data.runs.flatMap((run) => (run.summary?.ride_quality?.points ?? []).flatMap((point) =>
    directions.filter((direction) => point[direction]).map((direction) => ({ run: run.name, point, direction, ...point[direction] }))));
  const warnings = data.runs.flatMap((run) => (run.summary?.ride_quality?.points ?? []).flatMap((point) => (point.warnings ?? []).map((text) => `${runPrefix(run)}${text}`)));
  if (rows.length === 0 && warnings.length === 0) return;
  const value = (title, key, digits = 3) => ({ title, numeric: true, of: (row) => row[key], text: (row) => number(row[key], digits) });
  const columns = [
    { title: "point", of: (row) => row.point.name },
    ...(data.runs.length > 1 ? [{ title: "run", of: (row) => row.run }] : []),
    { title: "direction", of: (row) => row.direction },
    { title: "weighting", of: (row) => row.weighting },
    value("a_w (m/s²)", "weighted_rms"), value("MTVV (m/s²)", "maximum_transient"), value("VDV (m/s^1.75)", "vibration_dose"),
    value("crest factor", "crest_factor"), value("Sperling W_z", "sperling_index"),
    { title: "rating", of: (row) => row.sperling_comfort },
    { title: "all directions", of: (row) => (row.point.vibration_total == null ? null : `${number(row.point.vibration_total, 3)} m/s²: ${(row.point.comfort ?? []).join(" or ")}`) },
  ];
  const table = rows.length === 0 ? null : scrolling("Ride quality",
    sortable("Accelerations weighted according to ISO 2631-1, and Sperling's comfort index", columns, rows).table);
  section("ride", "Ride quality", table, warnings.length > 0 ? element("p", { class: "note" }, warnings.join("; ")) : null);
}
