// A night beside its baseline: gates, trends over nights, the pairs that were compared.
import { chart, drawCharts } from "./chart.js";
import { copyButton, h, section, select } from "./dom.js";
import { cellLabel, figure, short, splitLabel } from "./format.js";
import { verdict } from "./summary.js";
import { table } from "./table.js";
import { provenanceSection } from "./trials.js";

const place = (x) => (Object.keys(x.axes).length === 0 ? x.experiment : `${x.experiment}, ${cellLabel(x, 0)}`);
const same = (a, b) => a.experiment === b.experiment && JSON.stringify(a.axes) === JSON.stringify(b.axes);
const verdictClass = { red: "bad", better: "good", unchanged: "good", green: "good", "not compared": "warn" };

function labelOf(data, name) {
  const info = data.metrics.find((m) => m.name === name);
  return info ? splitLabel(info.label).name : name.replaceAll("_", " ");
}

function gatesSection(data) {
  const order = ["red", "not compared", "better", "green", "unchanged"];
  const rows = data.gates.slice().sort((a, b) => order.indexOf(a.verdict) - order.indexOf(b.verdict));
  const scale = (g) => data.metrics.find((m) => m.name === g.name)?.scale ?? 1;
  const unit = (g) => splitLabel(data.metrics.find((m) => m.name === g.name)?.label ?? "").unit;
  const rmse = (title, key) => ({ title, number: true, value: (g) => (g[key] === undefined ? undefined : g[key] * scale(g)), show: (g) => (g[key] === undefined ? "" : `${figure(g[key] * scale(g))} ${unit(g)}`) });
  const common = [
    { title: "verdict", value: (g) => g.verdict, className: (g) => verdictClass[g.verdict] },
    { title: "experiment", value: place },
    { title: "gate", value: (g) => (g.kind === "consistency" ? `NEES of ${labelOf(data, g.name)}` : labelOf(data, g.name)) },
  ];
  const lookAt = { title: "look at", value: (g) => g.replay, hint: "the trial that got worse most; the button copies the command that makes it again",
    show: (g) => (g.replay ? h("span", { title: g.replay }, `trial ${g.replay.split(" ").at(-1)} `, copyButton(g.replay)) : "") };
  const comparisons = table("gates", [
    ...common,
    rmse("baseline", "rmse_a"), rmse("tonight", "rmse_b"),
    { title: "ratio", number: true, hint: "tonight over baseline, seed by seed; above 1 is worse", value: (g) => g.ratio, show: (g) => (g.ratio === undefined ? "" : g.ratio.toFixed(4)) },
    { title: "95 % interval", value: (g) => (g.ci95 ? `${g.ci95[0].toFixed(4)} to ${g.ci95[1].toFixed(4)}` : "") },
    { title: "p", number: true, hint: "after Holm's correction for all comparisons of the night", value: (g) => g.p, show: (g) => (g.p === undefined ? "" : g.p < 1e-3 ? g.p.toExponential(0) : short(g.p)) },
    { title: "found from", number: true, hint: "the smallest ratio that four of five such nights would find", value: (g) => g.detectable, show: (g) => (g.detectable ? g.detectable.toFixed(3) : "") },
    lookAt,
  ], rows.filter((g) => g.ratio !== undefined));
  const others = table("other_gates", [...common, { title: "figures", wrap: true, value: (g) => g.message }, lookAt], rows.filter((g) => g.ratio === undefined));
  return section("gates", "Gates", "Each seed is compared with itself in the baseline, so that the noise is the same on both sides. Red needs both: certain after correction for all comparisons, and larger than the practical minimum.",
    rows.some((g) => g.ratio !== undefined) ? comparisons.element : null, h("h3", { class: "part" }, "Failures, identity and consistency"), others.element);
}

// All ratios with their intervals, worst first.
function ratiosSection(data) {
  const gates = data.gates.filter((g) => g.ratio !== undefined && g.ci95).sort((a, b) => a.ratio - b.ratio).slice(-40);
  if (gates.length === 0) return null;
  const names = gates.map((g) => `${labelOf(data, g.name)} | ${place(g)}`);
  const figureElement = chart({
    name: "ratios", title: "Tonight / baseline", tall: true, rows: () => [["gate", "ratio", "lo", "hi", "verdict"], ...gates.map((g, i) => [names[i], g.ratio, ...g.ci95, g.verdict])],
    caption: "Ratio of paired errors with its 95 % interval; to the right of 1 is worse. These intervals are of one comparison each; the verdict corrects for their number.",
    option: (theme) => ({
      legend: null, grid: { left: 250, right: 20, top: 10, bottom: 44 },
      xAxis: { type: "value", name: "ratio", scale: true }, yAxis: { type: "category", data: names, axisLabel: { width: 235, overflow: "truncate", fontSize: 11 } },
      tooltip: { trigger: "item", formatter: (e) => gates[e.dataIndex].message },
      series: [
        { type: "custom", encode: { x: [1, 2], y: 0 }, silent: true, data: gates.map((g, i) => [i, g.ci95[0], g.ci95[1]]), renderItem(_, api) {
          const [x1, y] = api.coord([api.value(1), api.value(0)]);
          const x2 = api.coord([api.value(2), api.value(0)])[0];
          return { type: "line", shape: { x1, x2, y1: y, y2: y }, style: { stroke: theme.muted, lineWidth: 2 } };
        } },
        { type: "scatter", symbolSize: 9, data: gates.map((g, i) => ({ value: [g.ratio, i], itemStyle: { color: { red: theme.failed, better: theme.ok }[g.verdict] ?? theme.colours[0] } })),
          markLine: { silent: true, symbol: "none", label: { show: false }, lineStyle: { color: theme.text, type: "solid", width: 1 }, data: [{ xAxis: 1 }] } },
      ],
    }),
  });
  figureElement.querySelector(".chart").style.height = `${90 + 22 * gates.length}px`;
  return section("ratios", "All comparisons", null, figureElement);
}

function trendChart(data, metric) {
  const info = data.metrics.find((m) => m.name === metric);
  const { name, unit } = splitLabel(info.label);
  const nights = [...new Map(data.trends.map((t) => [t.night, t])).values()].sort((a, b) => a.night - b.night);
  const label = (t) => `${t.night}\n${t.started.slice(5, 10)}`;
  const series = data.cells.map((cell) => {
    const points = nights.map((n) => data.trends.find((t) => t.night === n.night && t.metric === metric && same(t, cell)));
    const reference = points.find((p) => p && p.night === data.baseline) ?? points.find(Boolean);
    return { cell, points, reference };
  });
  return chart({
    name: `trend_${metric}`, title: `${name}: RMSE over nights`, tall: true,
    rows: () => [["night", "started", "commit", "experiment", "axes", `rmse_${unit}`, "n", "red"], ...data.trends.filter((t) => t.metric === metric).map((t) => [t.night, t.started, t.commit, t.experiment, JSON.stringify(t.axes), t.rmse * info.scale, t.n, t.red])],
    caption: "The seeds are the same each night, so an unchanged program draws a level line. Large marks: nights that were red.",
    option: (theme) => ({
      xAxis: { type: "category", data: nights.map(label), name: "night" }, yAxis: { type: "value", name: "RMSE / baseline [%]", min: (v) => Math.floor(Math.min(v.min, 98)), max: (v) => Math.ceil(Math.max(v.max, 102)) }, tooltip: { trigger: "item" },
      series: series.map(({ cell, points, reference }, i) => {
        return { name: place(cell), type: "line", color: theme.colours[i % 8], symbolSize: (_, p) => (points[p.dataIndex]?.red ? 12 : 6),
          data: points.map((p) => (p ? { value: (100 * p.rmse) / reference.rmse, itemStyle: { color: p.red ? theme.failed : theme.colours[i % 8] } } : "-")),
          tooltip: { formatter: (e) => `${place(cell)}<br>night ${nights[e.dataIndex].night}, ${nights[e.dataIndex].started}<br>${nights[e.dataIndex].commit}<br><b>${figure(points[e.dataIndex].rmse * info.scale)} ${unit}</b>` } };
      }),
    }),
  });
}

function pairsChart(data, cell, metric) {
  const info = data.metrics.find((m) => m.name === metric);
  const { name, unit } = splitLabel(info.label);
  const pairs = cell.pairs[metric];
  const scaled = (values) => values.map((v) => v * info.scale);
  const [x, y] = [scaled(pairs.baseline), scaled(pairs.tonight)];
  const hi = 1.05 * Math.max(...x, ...y);
  return chart({
    name: `pairs_${metric}`, title: `${name}: seed by seed`, tall: true,
    rows: () => [["trial", `baseline_${unit}`, `tonight_${unit}`], ...pairs.trial.map((t, i) => [t, x[i], y[i]])],
    caption: "A dot a seed. Above the line: worse tonight. On it: the same.",
    option: (theme) => ({
      legend: null, xAxis: { type: "value", name: `baseline${unit ? ` [${unit}]` : ""}`, min: 0, max: hi, axisLabel: { showMaxLabel: false } },
      yAxis: { type: "value", name: `tonight${unit ? ` [${unit}]` : ""}`, min: 0, max: hi, axisLabel: { showMaxLabel: false } },
      tooltip: { trigger: "item", formatter: (e) => (e.seriesType === "scatter" ? `trial ${pairs.trial[e.dataIndex]}<br>baseline ${figure(x[e.dataIndex])}<br>tonight ${figure(y[e.dataIndex])} ${unit}` : "") },
      series: [
        { type: "line", data: [[0, 0], [hi, hi]], symbol: "none", color: theme.muted, silent: true, lineStyle: { width: 1 } },
        { type: "scatter", symbolSize: 7, color: theme.colours[0], data: x.map((v, i) => ({ value: [v, y[i]], itemStyle: { color: y[i] > x[i] ? theme.failed : y[i] < x[i] ? theme.ok : theme.muted, opacity: 0.8 } })) },
      ],
    }),
  });
}

function trendsSection(data) {
  let metric = data.metrics[0].name;
  const host = h("div", { class: "charts" });
  let cell = data.cells.findIndex((c) => data.gates.some((g) => g.verdict === "red" && same(g, c)));
  if (cell < 0) cell = 0;
  const show = () => {
    const comparable = data.cells[cell].pairs[metric]?.trial.length > 0;
    host.replaceChildren(trendChart(data, metric), comparable ? pairsChart(data, data.cells[cell], metric) : h("p", { class: "note" }, "No pairs: this cell has no baseline."));
    drawCharts();
  };
  const red = data.gates.find((g) => g.verdict === "red" && data.metrics.some((m) => m.name === g.name));
  if (red) metric = red.name;
  const element = section("trends", "Nights and pairs", null,
    h("div", { class: "controls" },
      select("metric", data.metrics.map((m) => [m.name, splitLabel(m.label).name]), metric, (name) => { metric = name; show(); }),
      select("pairs of", data.cells.map((c, i) => [i, place(c)]), cell, (i) => { cell = Number(i); show(); })), host);
  element.addEventListener("attached", show, { once: true });
  return element;
}

function runtimeSection(data) {
  const cells = table("cells", [
    { title: "experiment", value: place, show: (c) => h("a", { href: c.report }, place(c)) },
    { title: "ok", number: true, value: (c) => c.n_ok, show: (c) => `${c.n_ok}/${c.n}`, className: (c) => (c.n_ok < c.n ? "bad" : "") },
    { title: "fresh seeds", number: true, value: (c) => c.n_fresh },
    ...["median_s", "baseline_s"].map((key) => ({ title: key === "median_s" ? "a trial [s]" : "baseline [s]", number: true,
      value: (c) => (key === "median_s" ? c : data.runtime.find((r) => same(r, c)))?.[key], show: (c) => figure((key === "median_s" ? c : data.runtime.find((r) => same(r, c)))?.[key]) })),
    { title: "time ratio", number: true, hint: "processor time of the estimator, tonight over baseline; never a reason for red", value: (c) => data.runtime.find((r) => same(r, c))?.ratio,
      show: (c) => data.runtime.find((r) => same(r, c))?.ratio.toFixed(2) ?? "", className: (c) => (data.runtime.find((r) => same(r, c))?.slower ? "warn" : "") },
  ], data.cells);
  return section("experiments", "Experiments and time", "Each name leads to the whole report of that experiment.", cells.element);
}

export function nightlyPage(data) {
  return {
    title: [data.name, h("small", {}, data.subtitle)],
    lead: verdict(data),
    sections: [gatesSection, ratiosSection, trendsSection, runtimeSection, provenanceSection].map((make) => make(data)),
  };
}
