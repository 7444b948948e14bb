// A chart: a figure with a title, its data as CSV, and itself as PNG. Colours follow the page, light or dark, and are
// light on paper.
import { h } from "./dom.js";
import { saveCsv, savePng } from "./download.js";
import { echarts } from "./echarts.js";
import { short } from "./format.js";

const charts = [];

function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const get = (name) => style.getPropertyValue(`--${name}`).trim();
  return {
    text: get("text"), muted: get("muted"), line: get("line"), page: get("page"), raised: get("raised"),
    ok: get("ok"), failed: get("failed"), colours: Array.from({ length: 8 }, (_, i) => get(`c${i}`)),
  };
}

const paper = {
  text: "#17212b", muted: "#55636f", line: "#d5dbe1", page: "#ffffff", raised: "#f5f7f9", ok: "#1a7f4b", failed: "#b3261e",
  colours: ["#1f6fb4", "#c8541a", "#2b8a57", "#8a4fa8", "#a88a12", "#b0406a", "#3a9aa5", "#6b6b6b"],
};

function merged(option, theme) {
  const axis = (a) => ({
    nameLocation: "middle", nameGap: a.gap ?? 28, nameTextStyle: { color: theme.muted },
    axisLine: { lineStyle: { color: theme.line } },
    splitLine: { lineStyle: { color: theme.line, opacity: 0.6 }, show: a.type !== "category" }, ...a, axisLabel: { color: theme.muted, hideOverlap: true, ...a.axisLabel },
  });
  const names = new Set(option.series.map((series) => series.name));
  return {
    animation: false, color: theme.colours, textStyle: { fontFamily: "system-ui, DejaVu Sans, sans-serif" },
    aria: { enabled: true }, grid: { left: 64, right: 16, top: 44, bottom: 46 }, ...option,
    legend: option.legend === null ? undefined
      : { type: names.size > 6 ? "scroll" : "plain", top: 0, pageIconColor: theme.muted, pageTextStyle: { color: theme.muted }, itemWidth: 18, itemHeight: 8, textStyle: { color: theme.text, fontSize: 11 }, ...option.legend },
    tooltip: { confine: true, backgroundColor: theme.raised, borderColor: theme.line, textStyle: { color: theme.text, fontSize: 12 },
      valueFormatter: (v) => (typeof v === "number" ? short(v) : v), ...option.tooltip },
    xAxis: axis(option.xAxis), yAxis: axis({ gap: 48, ...option.yAxis }),
  };
}

// spec: { name, title, caption, tall, option(theme), rows() }
export function chart(spec) {
  const box = h("div", { class: "chart", role: "img", "aria-label": spec.title });
  const entry = { spec, box, instance: null };
  charts.push(entry);
  const png = () => {
    const svg = entry.instance.renderToSVGString();
    savePng(spec.name, svg, box.clientWidth, box.clientHeight, readTheme().page);
  };
  return h("figure", { class: spec.tall ? "tall" : undefined, "data-name": spec.name },
    h("header", {}, h("h3", {}, spec.title),
      h("button", { class: "action csv", type: "button", onclick: () => saveCsv(spec.name, spec.rows()) }, "CSV"),
      h("button", { class: "action png", type: "button", onclick: png }, "PNG")),
    box, spec.caption ? h("figcaption", {}, spec.caption) : null);
}

function draw(entry, theme) {
  entry.instance ??= echarts.init(entry.box, null, { renderer: "svg" });
  entry.instance.setOption(merged(entry.spec.option(theme), theme), true);
}

const root = document.documentElement;
const isDrawn = (entry) => entry.instance !== null;
let busy = false;

// In slices, so that the page can be read and scrolled meanwhile.
function drawInTurn() {
  const until = performance.now() + 40;
  for (const entry of charts.filter((e) => !isDrawn(e))) {
    if (performance.now() > until) break;
    draw(entry, readTheme());
  }
  busy = !charts.every(isDrawn);
  root.dataset.drawn = String(!busy);
  if (busy) setTimeout(drawInTurn);
}

// Draws the charts that are new in the page and forgets those that have left it.
export function drawCharts() {
  for (let i = charts.length - 1; i >= 0; --i) {
    if (charts[i].box.isConnected) continue;
    charts[i].instance?.dispose();
    charts.splice(i, 1);
  }
  if (!busy) drawInTurn();
}

export function followThePage() {
  const redraw = (theme) => {
    for (const entry of charts) {
      draw(entry, theme);
      entry.instance.resize();
    }
  };
  window.addEventListener("resize", () => { for (const entry of charts) entry.instance?.resize(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw(readTheme()));
  window.addEventListener("beforeprint", () => redraw(paper));
  window.addEventListener("afterprint", () => redraw(readTheme()));
}

// The area between two lines.
export function area(name, x, lo, hi, colour, opacity = 0.2) {
  return {
    name, type: "custom", z: 1, itemStyle: { color: colour, opacity }, encode: { x: 0, y: [1, 2] }, tooltip: { show: false },
    data: x.map((t, i) => [t, lo[i], hi[i]]), clip: true, silent: true,
    renderItem(params, api) {
      if (params.dataIndex > 0) return null;
      const upper = x.map((t, i) => api.coord([t, hi[i]]));
      const lower = x.map((t, i) => api.coord([t, lo[i]])).reverse();
      return { type: "polygon", shape: { points: [...upper, ...lower] }, style: { fill: colour, opacity } };
    },
  };
}

export function line(name, x, y, colour, style = {}) {
  return {
    name, type: "line", showSymbol: false, color: colour, z: 3, lineStyle: { width: 1.8, ...style }, itemStyle: { color: colour },
    data: x.map((t, i) => [t, y[i]]),
  };
}

// Whiskers of intervals: [x, lo, hi] each.
export function whiskers(name, points, colour) {
  return {
    name, type: "custom", z: 2, encode: { x: 0, y: [1, 2] }, data: points, silent: true, itemStyle: { color: colour },
    renderItem(_, api) {
      const [x, lo] = api.coord([api.value(0), api.value(1)]);
      const hi = api.coord([api.value(0), api.value(2)])[1];
      const cap = (y) => ({ type: "line", shape: { x1: x - 4, x2: x + 4, y1: y, y2: y }, style: { stroke: colour, lineWidth: 1.5 } });
      return { type: "group", children: [cap(lo), cap(hi), { type: "line", shape: { x1: x, x2: x, y1: lo, y2: hi }, style: { stroke: colour, lineWidth: 1.5 } }] };
    },
  };
}

// Columns side by side: [["t", t], ["x", x]] -> rows with a heading.
export function columnRows(columns) {
  const length = Math.max(...columns.map(([, values]) => values.length));
  return [columns.map(([name]) => name), ...Array.from({ length }, (_, i) => columns.map(([, values]) => values[i]))];
}
