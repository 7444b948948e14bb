// How a metric depends on the axes of the sweep: one axis as a line with intervals, two as a heat map, more as lines by
// the axis with the most values.
import { chart, drawCharts, whiskers } from "./chart.js";
import { h, section, select } from "./dom.js";
import { figure, shortKey, splitLabel, valueText } from "./format.js";

const figures = {
  rmse: { title: "RMSE", of: (m, scale) => m.rmse * scale },
  efficiency: { title: "RMSE / bound", of: (m) => m.efficiency, plain: true },
  mean: { title: "mean (bias of signed errors)", of: (m, scale) => m.mean * scale },
  nees_mean: { title: "mean NEES / its dimension", of: (m) => (m.nees_mean === undefined ? undefined : m.nees_mean / m.nees_dof), plain: true },
};

// Axes that step together show as one, with the values of all.
function axesOf(data) {
  const keys = Object.keys(data.cells[0].axes);
  const column = (key) => data.cells.map((cell) => valueText(cell.axes[key]));
  const groups = [];
  for (const key of keys) {
    const values = column(key);
    const same = groups.find((g) => {
      const pairs = new Set(values.map((v, i) => `${g.labels[i]}\u0000${v}`));
      return pairs.size === new Set(g.labels).size && pairs.size === new Set(values).size;
    });
    if (same) same.others.push(key);
    else groups.push({ key, labels: values, others: [] });
  }
  return groups.map((g) => {
    const unique = [...new Set(g.labels)];
    const numbers = unique.map(Number);
    const sortable = numbers.every(Number.isFinite);
    const numeric = sortable && unique.length > 3;
    const order = sortable ? unique.slice().sort((a, b) => Number(a) - Number(b)) : unique;
    return { key: g.key, name: [g.key, ...g.others].map(shortKey).join(", "), labels: g.labels, unique: order, numeric };
  }).filter((axis) => axis.unique.length > 1);
}

function unitOf(info, kind) {
  const { unit } = splitLabel(info.label);
  return unit && !figures[kind].plain ? ` [${unit}]` : "";
}

function points(data, axes, name, kind) {
  const info = data.metrics.find((m) => m.name === name);
  return data.cells.map((cell, i) => {
    const m = cell.metrics[name];
    const ci = m && (kind === "rmse" ? m.rmse_ci95?.map((v) => v * info.scale) : kind === "mean" ? m.mean_ci95?.map((v) => v * info.scale) : kind === "efficiency" ? m.efficiency_ci95 : null);
    return { at: axes.map((axis) => axis.labels[i]), y: m ? figures[kind].of(m, info.scale) : undefined, ci, cell, crlb: kind === "rmse" && m?.crlb !== undefined ? m.crlb * info.scale : undefined };
  });
}

function csv(axes, list) {
  return [[...axes.map((a) => a.key), "value", "ci95_lo", "ci95_hi", "bound", "n_ok", "n"],
    ...list.map((p) => [...p.at, p.y, p.ci?.[0], p.ci?.[1], p.crlb, p.cell.n_ok, p.cell.n])];
}

function lineChart(data, axes, name, kind) {
  const info = data.metrics.find((m) => m.name === name);
  const list = points(data, axes, name, kind);
  const along = axes.reduce((best, axis, i) => (axis.unique.length > axes[best].unique.length ? i : best), 0);
  const axis = axes[along];
  const key = (p) => axes.map((a, i) => (i === along ? null : `${a.name} = ${p.at[i]}`)).filter(Boolean).join(", ");
  const groups = [...new Set(list.map(key))].slice(0, 8);
  const x = (p) => (axis.numeric ? Number(p.at[along]) : axis.unique.indexOf(p.at[along]));
  const positive = list.every((p) => p.y === undefined || p.y > 0);
  const values = list.map((p) => p.y).filter((v) => v > 0);
  const log = positive && kind !== "efficiency" && Math.max(...values) > 20 * Math.min(...values);
  const label = splitLabel(info.label).name;
  return chart({
    name: `axis_${name}_${kind}`, title: `${label}: ${figures[kind].title} over ${axis.name}`, tall: true, rows: () => csv(axes, list),
    caption: "Bars are 95 % intervals, where there are enough trials for one.",
    option: (theme) => ({
      xAxis: axis.numeric ? { type: "value", name: axis.name, scale: true, boundaryGap: ["4%", "4%"] } : { type: "category", name: axis.name, data: axis.unique },
      yAxis: { type: log ? "log" : "value", name: `${figures[kind].title}${unitOf(info, kind)}`, axisLabel: { formatter: (v) => String(Number(v.toPrecision(3))) } },
      tooltip: { trigger: "item" },
      series: groups.flatMap((group, g) => {
        const colour = theme.colours[g % theme.colours.length];
        const mine = list.filter((p) => key(p) === group && p.y !== undefined).sort((a, b) => x(a) - x(b));
        const title = group || figures[kind].title;
        return [
          { name: title, type: "line", color: colour, data: mine.map((p) => [x(p), p.y]), symbolSize: 7, tooltip: { formatter: (e) => {
            const p = mine[e.dataIndex];
            return `${axis.name} = ${p.at[along]}${group ? `<br>${group}` : ""}<br><b>${figure(p.y)}</b>${unitOf(info, kind)}${p.ci ? `<br>95 % ${figure(p.ci[0])} to ${figure(p.ci[1])}` : ""}<br>${p.cell.n_ok}/${p.cell.n} ok`;
          } } },
          whiskers(title, mine.filter((p) => p.ci).map((p) => [x(p), p.ci[0], p.ci[1]]), colour),
          ...(mine.some((p) => p.crlb !== undefined) ? [{ name: groups.length > 1 ? `bound, ${group}` : "Cramer-Rao bound", type: "line", color: groups.length > 1 ? colour : theme.colours[2],
            lineStyle: { type: "dotted" }, symbol: "none", data: mine.map((p) => [x(p), p.crlb]) }] : []),
        ];
      }),
    }),
  });
}

function heatMap(data, axes, name, kind) {
  const info = data.metrics.find((m) => m.name === name);
  const [ax, ay] = axes;
  const list = points(data, axes, name, kind);
  const values = list.map((p) => p.y).filter((v) => v !== undefined);
  const [lo, hi] = [Math.min(...values), Math.max(...values)];
  const log = lo > 0 && hi > 20 * lo;
  const map = (v) => (log ? Math.log10(v) : v);
  return chart({
    name: `map_${name}_${kind}`, title: `${splitLabel(info.label).name}: ${figures[kind].title}${unitOf(info, kind)}`, tall: true, rows: () => csv(axes, list),
    caption: `A cell each, darker is larger${log ? ", on a logarithmic scale" : ""}. A cell without a figure had no trial that gave an answer, or nothing is claimed of it.`,
    option: (theme) => ({
      legend: null, grid: { left: 84, right: 16, top: 14, bottom: 48 },
      xAxis: { type: "category", name: ax.name, data: ax.unique, splitArea: { show: false } },
      yAxis: { type: "category", name: ay.name, data: ay.unique, gap: 62 },
      visualMap: { show: false, min: map(lo), max: map(hi) || 1, dimension: 2, inRange: { color: ["#d7e8f7", "#7fb2de", "#2f73b3", "#123d6b"] } },
      tooltip: { trigger: "item", formatter: (e) => {
        const p = list[e.value[3]];
        return `${ax.name} = ${p.at[0]}<br>${ay.name} = ${p.at[1]}<br><b>${figure(p.y)}</b>${unitOf(info, kind)}${p.ci ? `<br>95 % ${figure(p.ci[0])} to ${figure(p.ci[1])}` : ""}<br>${p.cell.n_ok}/${p.cell.n} ok`;
      } },
      series: [{ type: "heatmap", data: list.map((p, i) => [ax.unique.indexOf(p.at[0]), ay.unique.indexOf(p.at[1]), p.y === undefined ? "-" : map(p.y), i]),
        label: { show: list.length <= 120, formatter: (e) => figure(list[e.value[3]].y), color: "#000", textBorderColor: "#fff", textBorderWidth: 2 },
        itemStyle: { borderColor: theme.page, borderWidth: 1 } }],
    }),
  });
}

export function axesSection(data) {
  const axes = axesOf(data);
  if (axes.length === 0) return null;
  const metrics = data.metrics.filter((m) => m.in_table && data.cells.some((c) => c.metrics[m.name]));
  if (metrics.length === 0) return null;
  const preferred = ["td_error_s", "ate_position_m"].filter((name) => metrics.some((m) => m.name === name));
  const chosen = [preferred[0] ?? metrics[0].name, preferred[1] ?? metrics[Math.min(1, metrics.length - 1)].name];
  let kind = "rmse";
  const host = h("div", { class: "charts" });
  const show = () => {
    host.replaceChildren(...chosen.map((name) => (axes.length === 2 && axes.every((a) => a.unique.length > 2) ? heatMap : lineChart)(data, axes, name, kind)));
    drawCharts();
  };
  const pick = (i) => select(i === 0 ? "left" : "right", metrics.map((m) => [m.name, splitLabel(m.label).name]), chosen[i], (name) => { chosen[i] = name; show(); });
  const element = section("axes", "Over the sweep's axes", `What changes with ${axes.map((a) => a.key).join(" and ")}.`,
    h("div", { class: "controls" }, pick(0), pick(1), select("figure", Object.entries(figures).map(([k, f]) => [k, f.title]), kind, (k) => { kind = k; show(); })), host);
  element.addEventListener("attached", show, { once: true });
  return element;
}
