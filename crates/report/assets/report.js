// The page from top to bottom.

const heading = data.title ?? (data.runs.length === 1 ? data.runs[0].title : `${data.runs.length} runs compared`);
document.title = data.title ?? (data.runs.map((run) => run.title).join(" · ") || "Report");
main.append(element("h1", {}, heading));
main.append(...data.runs.map(statusLine), keyFigures() ?? "");
verdictSection();
sceneSection();
historySection();
spectraSection();
filledSections();
spectrogramSection();
modesSection();
responseSection();
irregularitySection();
rideSection();
statisticsSection();
textsSection();
informationSection();
theme.apply();
if (matchMedia("print").matches) hideHollow(true);
if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
document.documentElement.dataset.ready = "true";
