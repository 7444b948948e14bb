// Builds the page from the data in it.
import { axesSection } from "./axes.js";
import { drawCharts, followThePage } from "./chart.js";
import { distributionSection } from "./distributions.js";
import { h } from "./dom.js";
import { nightlyPage } from "./nightly.js";
import { overTimeSection } from "./overtime.js";
import { summarySection, verdict } from "./summary.js";
import { provenanceSection, timingSection, trialsSection, worstSection } from "./trials.js";

function sweepPage(data) {
  const runs = data.cells.reduce((sum, cell) => sum + cell.n, 0);
  return {
    title: [data.name, h("small", {}, `${runs} trials in ${data.cells.length} ${data.cells.length === 1 ? "cell" : "cells"}`)],
    lead: verdict(data),
    sections: [summarySection, axesSection, overTimeSection, distributionSection, worstSection, trialsSection, timingSection, provenanceSection].map((make) => make(data)),
  };
}

const pages = { sweep: sweepPage, nightly: nightlyPage };

const data = JSON.parse(document.getElementById("data").textContent);
const page = pages[data.kind](data);
const sections = page.sections.filter(Boolean);
const links = sections.map((section) => h("li", {}, h("a", { href: `#${section.id}` }, section.querySelector("h2").textContent)));
document.body.append(
  h("header", {}, h("h1", {}, page.title), page.lead),
  h("nav", { "aria-label": "sections" }, h("ul", {}, links)),
  h("main", {}, sections),
  h("footer", {}, "Made by Plumbline. Charts: Apache ECharts, Apache License 2.0."));
followThePage();
for (const section of sections) section.dispatchEvent(new Event("attached"));
drawCharts();
document.documentElement.dataset.ready = "true";
