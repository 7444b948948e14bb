// Each cell's trials: cumulative distribution and boxes.
import { chart, drawCharts } from "./chart.js";
import { h, section, select } from "./dom.js";
import { cellLabel, figure, splitLabel } from "./format.js";

const kCells = 24;

// A signed error counts by its size where the distribution is to be compared with a limit.
function ecdfChart(data, name) {
  const info = data.metrics.find((m) => m.name === name);
  const { name: label, unit } = splitLabel(info.label);
  const cells = data.cells.map((cell, index) => ({ title: cellLabel(cell, index), values: cell.ecdf?.[name]?.map((v) => v * info.scale) })).filter((c) => c.values).slice(0, 8);
  return chart({
    name: `ecdf_${name}`, title: `${label}: share of trials below a value`, tall: true,
    rows: () => [["cell", "share", `value_${unit}`], ...cells.flatMap((c) => c.values.map((v, i) => [c.title, i / 100, v]))],
    caption: data.cells.length > 8 ? "The first eight cells." : "Steeper is more repeatable, further to the left is better (for signed errors: nearer to 0).",
    option: (theme) => ({
      xAxis: { type: "value", name: `${label}${unit ? ` [${unit}]` : ""}`, scale: true, axisLabel: { formatter: (v) => String(Number(v.toPrecision(4))) } },
      yAxis: { type: "value", name: "share of trials", min: 0, max: 1 }, tooltip: { trigger: "item", formatter: (e) => `${e.seriesName}<br>${(100 * e.value[1]).toFixed(0)} % of trials below ${figure(e.value[0])} ${unit}` },
      series: cells.map((c, i) => ({ name: c.title, type: "line", symbolSize: 5, symbol: "circle", showSymbol: false, step: false, color: theme.colours[i % 8], data: c.values.map((v, k) => [v, k / 100]) })),
    }),
  });
}

function boxChart(data, name) {
  const info = data.metrics.find((m) => m.name === name);
  const { name: label, unit } = splitLabel(info.label);
  const cells = data.cells.map((cell, index) => ({ title: cellLabel(cell, index), values: cell.ecdf?.[name]?.map((v) => v * info.scale) })).filter((c) => c.values).slice(0, kCells);
  const box = (v) => [5, 25, 50, 75, 95].map((p) => v[p]);
  return chart({
    name: `boxes_${name}`, title: `${label}: boxes by cell`, tall: true,
    rows: () => [["cell", "q05", "q25", "median", "q75", "q95", "min", "max"], ...cells.map((c) => [c.title, ...box(c.values), c.values[0], c.values[100]])],
    caption: `Box: the middle half of the trials and their median. Whiskers: 5 to 95 %. Dots: least and largest.${data.cells.length > kCells ? ` The first ${kCells} cells.` : ""}`,
    option: (theme) => ({
      legend: null, grid: { left: 64, right: 16, top: 14, bottom: 48 },
      xAxis: { type: "category", data: cells.map((c) => c.title), axisLabel: { width: 150, overflow: "truncate" } },
      yAxis: { type: "value", name: `${label}${unit ? ` [${unit}]` : ""}`, scale: !info.signed }, tooltip: { trigger: "item", formatter: (e) => {
        const c = cells[e.dataIndex % cells.length];
        return `${c.title}<br>median ${figure(c.values[50])} ${unit}<br>25 to 75 %: ${figure(c.values[25])} to ${figure(c.values[75])}<br>5 to 95 %: ${figure(c.values[5])} to ${figure(c.values[95])}<br>least ${figure(c.values[0])}, largest ${figure(c.values[100])}`;
      } },
      series: [
        { type: "boxplot", data: cells.map((c) => box(c.values)), boxWidth: [12, 60], itemStyle: { color: theme.raised, borderColor: theme.colours[0], borderWidth: 1.5 } },
        { type: "scatter", symbolSize: 5, color: theme.colours[0], data: cells.flatMap((c, i) => [[i, c.values[0]], [i, c.values[100]]]), tooltip: { formatter: (e) => figure(e.value[1]) + " " + unit } },
      ],
    }),
  });
}

export function distributionSection(data) {
  const metrics = data.metrics.filter((m) => data.cells.some((c) => c.ecdf?.[m.name]));
  if (metrics.length === 0) return null;
  let name = (metrics.find((m) => m.name === "ate_position_m") ?? metrics[0]).name;
  const host = h("div", { class: "charts" });
  const show = () => {
    host.replaceChildren(ecdfChart(data, name), boxChart(data, name));
    drawCharts();
  };
  const element = section("distributions", "Distributions", "How the trials of each cell are spread. A long tail hides in an RMSE; here it shows.",
    h("div", { class: "controls" }, select("metric", metrics.map((m) => [m.name, splitLabel(m.label).name]), name, (chosen) => { name = chosen; show(); })), host);
  element.addEventListener("attached", show, { once: true });
  return element;
}
