// One cell over time: td, errors by axis, NEES, and the path.
import { area, chart, columnRows, drawCharts, line } from "./chart.js";
import { h, section, select } from "./dom.js";
import { cellLabel, figure } from "./format.js";

const timeAxis = { type: "value", name: "time since the first estimate [s]", min: "dataMin", max: "dataMax", axisLabel: { showMinLabel: false, showMaxLabel: false } };
const zero = (theme, name, t) => line(name, [t[0], t[t.length - 1]], [0, 0], theme.text, { width: 1 });
const negative = (values) => values.map((v) => -v);

// Of the largest of the values from the instant on that a share of the time has passed.
function lateRange(columns, share) {
  return 1.15 * Math.max(...columns.flatMap((c) => c.slice(Math.floor(share * c.length)).map(Math.abs)));
}

function tdCharts(cell) {
  const td = cell.bands.td_ms;
  const sigma = cell.bands.td_sigma_ms;
  const bound = cell.bands.bound_td_ms;
  if (!td && !bound) return [];
  const truth = `truth: td = ${figure(1e3 * cell.td_s) || "0"} ms`;
  const rows = () => columnRows([
    ...(td ? [["t_s", td.t_s], ["td_error_q05_ms", td.q05], ["td_error_median_ms", td.median], ["td_error_q95_ms", td.q95],
      ["td_error_rms_ms", td.rms], ["estimator_sigma_rms_ms", sigma.rms]] : []),
    ...(bound ? [["bound_t_s", bound.t_s], ["bound_ms", bound.rms]] : []),
  ]);
  const signed = (limit) => (theme) => {
    const [blue, orange, green] = theme.colours;
    const sigma3 = sigma.rms.map((s) => 3 * s);
    const bound3 = bound?.rms.map((s) => 3 * s);
    return {
      xAxis: timeAxis, yAxis: { type: "value", name: "td error [ms]", ...(limit ? { min: -limit, max: limit, axisLabel: { showMinLabel: false, showMaxLabel: false } } : {}) },
      tooltip: { trigger: "axis" },
      series: [
        area("5 to 95 % of trials", td.t_s, td.q05, td.q95, blue, 0.25),
        zero(theme, truth, td.t_s),
        line("median", td.t_s, td.median, blue),
        line("estimator's 3 sigma", td.t_s, sigma3, orange, { type: "dashed" }),
        { ...line("estimator's 3 sigma", td.t_s, negative(sigma3), orange, { type: "dashed" }), tooltip: { show: false } },
        ...(bound ? [line("3 x bound", bound.t_s, bound3, green, { type: "dotted" }),
          { ...line("3 x bound", bound.t_s, negative(bound3), green, { type: "dotted" }), tooltip: { show: false } }] : []),
      ],
    };
  };
  const logarithmic = (theme) => {
    const [blue, orange, green] = theme.colours;
    return {
      xAxis: timeAxis, yAxis: { type: "log", name: "td [ms]", axisLabel: { formatter: (v) => String(Number(v.toPrecision(2))) } }, tooltip: { trigger: "axis" },
      series: [
        ...(td ? [line("RMSE over trials", td.t_s, td.rms, blue), line("estimator's sigma", td.t_s, sigma.rms, orange, { type: "dashed" })] : []),
        ...(td || !cell.metrics.td_error_s ? [] : [line("RMSE of the final estimate", [bound.t_s[0], bound.t_s.at(-1)], Array(2).fill(1e3 * cell.metrics.td_error_s.rmse), blue, { type: "dashed" })]),
        ...(bound ? [line("Cramer-Rao bound", bound.t_s, bound.rms, green, { type: "dotted" })] : []),
      ],
    };
  };
  const list = [];
  if (td) {
    list.push(chart({ name: "td_convergence", title: "td convergence, from a tenth of the time on",
      caption: "The error starts at the prior's; the figure shows what remains.", rows,
      option: signed(lateRange([td.q05, td.q95, sigma.rms.map((s) => 3 * s)], 0.1)) }));
  }
  list.push(chart({ name: "td_rmse", title: td ? "td: error, stated sigma and bound" : "td: how well it can be known with the data so far", rows, option: logarithmic,
    caption: td ? "Logarithmic. Blue above orange: the estimator is too sure. Blue near green: no estimator could do better."
      : "A batch estimator has one td at the end: the dashed line is its RMSE. The dotted line is the Cramer-Rao bound from the data up to each instant." }));
  return list;
}

function errorChart(cell, kind, axis, unit) {
  const band = cell.bands[`${kind}_${axis}_${unit}`];
  if (!band) return null;
  // A batch states a covariance of its last state only.
  const stated = cell.bands[`${kind}_sigma_${axis}_${unit}`];
  const deviation = stated ?? band;
  const sigma3 = deviation.rms.map((r) => 3 * r);
  const name3 = stated ? "estimator's 3 sigma, before alignment" : "3 sigma over trials";
  return chart({
    name: `${kind}_error_${axis}`, title: `${kind} error, ${axis}`,
    rows: () => columnRows([["t_s", band.t_s], [`q05_${unit}`, band.q05], [`median_${unit}`, band.median], [`q95_${unit}`, band.q95], [`rms_${unit}`, band.rms],
      ...(stated ? [["stated_t_s", stated.t_s], [`estimator_sigma_rms_${unit}`, stated.rms]] : [])]),
    option: (theme) => ({
      xAxis: timeAxis, yAxis: { type: "value", name: `error [${unit === "deg" ? "\u00b0" : unit}]` }, tooltip: { trigger: "axis" },
      series: [
        area("5 to 95 % of trials", band.t_s, band.q05, band.q95, theme.colours[0], 0.25),
        line("median", band.t_s, band.median, theme.colours[0]),
        line(name3, deviation.t_s, sigma3, theme.colours[1], { type: "dashed" }),
        { ...line(name3, deviation.t_s, negative(sigma3), theme.colours[1], { type: "dashed" }), tooltip: { show: false } },
      ],
    }),
  });
}

function neesChart(cell, block) {
  const band = cell.nees_bands?.[block];
  if (!band) return null;
  return chart({
    name: `nees_${block}`, title: `NEES of ${block}, dimension ${band.dof}`,
    caption: "Mean over trials. Inside the shaded 95 % band the stated covariance fits the errors; above it the estimator is too sure of itself.",
    rows: () => columnRows([["t_s", band.t_s], ["mean_nees", band.mean], ["band_lo", band.lo], ["band_hi", band.hi]]),
    option: (theme) => ({
      xAxis: timeAxis, yAxis: { type: "value", name: "mean NEES", min: 0 }, tooltip: { trigger: "axis" },
      series: [
        area("95 % band", band.t_s, band.lo, band.hi, theme.colours[2], 0.22),
        line("mean NEES", band.t_s, band.mean, theme.colours[0]),
        line("expected", band.t_s, band.t_s.map(() => band.dof), theme.colours[2], { type: "dotted" }),
      ],
    }),
  });
}

// Equal scales: the shorter side is widened to the frame's shape, about 1.35 to 1.
function frame(xs, ys) {
  const range = (values) => [Math.min(...values), Math.max(...values)];
  let [x0, x1] = range(xs);
  let [y0, y1] = range(ys);
  const shape = 1.35;
  const height = 1.12 * Math.max(y1 - y0, (x1 - x0) / shape, 1e-6);
  const grow = (lo, hi, size) => [(lo + hi - size) / 2, (lo + hi + size) / 2];
  [x0, x1] = grow(x0, x1, height * shape);
  [y0, y1] = grow(y0, y1, height);
  return { x: { min: x0, max: x1 }, y: { min: y0, max: y1 } };
}

// So that the largest error is about a twentieth of the path's size: 1, 2, 5, 10 and so on.
function exaggeration(path) {
  const size = Math.max(...path.truth.map((v) => Math.max(...v) - Math.min(...v)));
  const error = Math.max(...path.truth.flatMap((v, i) => v.map((x, k) => Math.abs(path.estimate[i][k] - x))));
  const wanted = size / (20 * error);
  if (!(wanted > 2) || !Number.isFinite(wanted)) return 1;
  const decade = 10 ** Math.floor(Math.log10(wanted));
  return [5, 2, 1].find((k) => k * decade <= wanted) * decade;
}

function pathChart(cell, title, a, b) {
  const { median, worst } = cell.paths;
  const times = exaggeration(worst);
  const magnified = (path) => path.truth.map((truth, i) => truth.map((v, k) => v + times * (path.estimate[i][k] - v)));
  const [usual, bad] = [magnified(median), magnified(worst)];
  const limits = frame([worst.truth[a], bad[a]].flat(), [worst.truth[b], bad[b]].flat());
  const names = ["x", "y", "z"];
  const mm = (path) => `${figure(1e3 * path.ate_position_m)} mm`;
  const trace = (name, xyz, colour, style) => ({ ...line(name, xyz[a], xyz[b], colour, style) });
  const hidden = { showMinLabel: false, showMaxLabel: false, formatter: (v) => String(Number(v.toPrecision(3))) };
  return chart({
    name: `path_${names[a]}${names[b]}`, title, tall: true,
    caption: `${times > 1 ? `Errors are drawn ${times} times as large as they are. ` : ""}${worst.t_s.length} instants, joined by straight lines.`,
    rows: () => columnRows([["t_s", worst.t_s], ...["x", "y", "z"].map((n, i) => [`truth_${n}_m`, worst.truth[i]]),
      ...["x", "y", "z"].map((n, i) => [`worst_${n}_m`, worst.estimate[i]]), ...["x", "y", "z"].map((n, i) => [`median_${n}_m`, median.estimate[i]])]),
    option: (theme) => ({
      xAxis: { type: "value", name: `${names[a]} [m]`, ...limits.x, axisLabel: hidden }, yAxis: { type: "value", name: `${names[b]} [m]`, ...limits.y, axisLabel: hidden },
      tooltip: { trigger: "item" },
      series: [
        trace("truth", worst.truth, theme.text, { width: 4, opacity: 0.3 }),
        trace(`median trial, ATE ${mm(median)}`, usual, theme.colours[0], { width: 1.5 }),
        trace(`worst trial, ATE ${mm(worst)}`, bad, theme.colours[1], { width: 1.5, type: "dashed" }),
      ],
    }),
  });
}

function part(title, charts, className = "charts") {
  const present = charts.filter(Boolean);
  return present.length ? [h("h3", { class: "part" }, title), h("div", { class: className }, present)] : [];
}

export function overTimeSection(data) {
  const cells = data.cells.map((cell, index) => ({ cell, index })).filter(({ cell }) => cell.series > 0);
  if (cells.length === 0) return null;
  const host = h("div", { "aria-live": "polite" });
  const show = (index) => {
    const cell = data.cells[index];
    host.replaceChildren(
      ...part("Time offset td", tdCharts(cell)),
      ...part("Errors of position and orientation, after alignment", [
        ...["x", "y", "z"].map((axis) => errorChart(cell, "position", axis, "mm")),
        ...["x", "y", "z"].map((axis) => errorChart(cell, "rotation", axis, "deg"))], "charts three"),
      ...part("Consistency", ["pose", "velocity", "bias"].map((block) => neesChart(cell, block)), "charts three"),
      ...part("Path, after alignment", cell.paths.worst ? [pathChart(cell, "from above", 0, 1), pathChart(cell, "from the side", 0, 2)] : []));
    drawCharts();
  };
  const options = cells.map(({ cell, index }) => [index, cellLabel(cell, index)]);
  const omitted = data.cells.length - cells.length;
  const element = section("time", "Over time", `Over the trials of one cell. ${omitted > 0 ? `${omitted} further cells, without series or beyond the first 24, are not shown here.` : ""}`,
    cells.length > 1 ? h("div", { class: "controls" }, select("cell", options, cells[0].index, show)) : null, host);
  element.addEventListener("attached", () => show(cells[0].index), { once: true });
  return element;
}
