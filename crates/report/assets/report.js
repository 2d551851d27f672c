// The page from top to bottom.

document.title = data.runs.map((run) => run.title).join(" · ") || "Report";
main.append(element("h1", {}, data.runs.length === 1 ? data.runs[0].title : `${data.runs.length} runs compared`));
main.append(...data.runs.map(statusLine), keyFigures() ?? "");
verdictSection();
sceneSection();
historySection();
spectraSection();
spectrogramSection();
modesSection();
irregularitySection();
rideSection();
statisticsSection();
textsSection();
informationSection();
theme.apply();
if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
document.documentElement.dataset.ready = "true";
