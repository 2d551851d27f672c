// The page of a study from top to bottom.

headSection();
mapSection();
effectsSection();
quantileSection();
paretoSection();
relationsSection();
tableSection();
main.append(element("p", { class: "note" }, `Study in ${data.folder}. Created by maglev ${data.version}.`));
theme.apply();
if (matchMedia("print").matches) hideHollow(true);
if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
document.documentElement.dataset.ready = "true";
