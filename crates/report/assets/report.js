// The page from top to bottom.

const STATUS = {
  finished: "finished",
  failed: "failed",
  interrupted: "interrupted",
  terminated: "ended by a unit",
  undefined: "has not ended",
};

/** How one run ended. */
function statusLine(run) {
  const summary = run.summary ?? {};
  const name = STATUS[summary.status] ?? summary.status;
  const reached = summary.reached == null ? "" : ` at ${number(summary.reached)} s of ${number(summary.stop)} s`;
  const line = element("p", { class: "status" },
    element("span", { class: `badge ${summary.status ?? "open"}` }, name),
    data.runs.length > 1 ? ` ${run.name}: ${run.title},` : "", reached);
  if (!summary.error) return line;
  const causes = summary.error.causes.map((text) => element("li", {}, text));
  return element("div", {}, line, element("div", { class: "error", role: "alert" }, element("ol", {}, causes),
    summary.error.help ? element("p", {}, summary.error.help) : null));
}

document.title = data.runs.map((run) => run.title).join(" · ") || "Report";
main.append(element("h1", {}, data.runs.length === 1 ? data.runs[0].title : `${data.runs.length} runs compared`));
main.append(...data.runs.map(statusLine));
sceneSection();
historySection();
statisticsSection();
theme.apply();
document.documentElement.dataset.ready = "true";
