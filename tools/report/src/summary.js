// The verdict, and the table of all cells and metrics.
import { h, section } from "./dom.js";
import { cellLabel, figure, interval, short, splitLabel } from "./format.js";
import { table } from "./table.js";

const kHeadline = ["ate_position_m", "ate_rotation_deg", "td_error_s", "readout_error_s", "extrinsic_position_m", "extrinsic_rotation_deg", "extrinsic", "final_state"];

export function verdict(data) {
  return h("div", { class: `verdict ${data.verdict.level}`, role: "status" },
    h("strong", {}, { ok: "\u2713 ", attention: "! ", failed: "\u2717 " }[data.verdict.level] + data.verdict.headline),
    h("ul", {}, data.verdict.findings.map((finding) => h("li", {}, finding))));
}

const outside = (m) => m.nees_band95 && (m.nees_mean < m.nees_band95[0] || m.nees_mean > m.nees_band95[1]);

export function summarySection(data) {
  const rows = data.cells.flatMap((cell, index) => data.metrics
    .filter((info) => cell.metrics[info.name] && (info.in_table || cell.metrics[info.name].nees_mean !== undefined))
    .map((info) => ({ cell, index, info, m: cell.metrics[info.name], label: splitLabel(info.label) })));
  let all = false;
  const scaled = (row, value) => (row.info.in_table && value !== undefined ? value * row.info.scale : undefined);
  const number = (title, get, hint) => ({
    title, number: true, hint, value: (row) => scaled(row, get(row.m)),
    show: (row) => figure(scaled(row, get(row.m)), row.m.rmse * row.info.scale),
  });
  const columns = [
    ...(data.cells.length > 1 ? [{ title: "cell", value: (row) => row.index, show: (row) => cellLabel(row.cell, row.index), search: (row) => cellLabel(row.cell, row.index) }] : []),
    { title: "metric", value: (row) => row.label.name },
    { title: "unit", value: (row) => row.info.in_table ? row.label.unit : "" },
    number("mean", (m) => m.mean, "of signed errors: the bias"),
    number("RMSE", (m) => m.rmse, "root of the mean square over the trials"),
    { title: "95 % interval", value: (row) => row.info.in_table ? interval(row.m.rmse_ci95, row.info.scale, row.m.rmse * row.info.scale) : "", hint: "of the RMSE" },
    number("bound", (m) => m.crlb, "Cramer-Rao: the least RMSE that an unbiased estimator can have"),
    { title: "RMSE / bound", number: true, hint: "1 is the best possible", value: (row) => row.info.in_table ? row.m.efficiency : undefined,
      show: (row) => row.info.in_table && row.m.efficiency !== undefined ? row.m.efficiency.toFixed(2) : "" },
    { title: "NEES", number: true, hint: "mean squared error in units of the estimator's own covariance; marked where it is outside the band",
      value: (row) => row.m.nees_mean, show: (row) => short(row.m.nees_mean), className: (row) => (outside(row.m) ? "warn" : "") },
    { title: "95 % band", value: (row) => (row.m.nees_band95 ? row.m.nees_band95.map(short).join(" to ") : ""), hint: "where the mean NEES of a consistent estimator lies" },
    { title: "ok", number: true, value: (row) => row.cell.n_ok, show: (row) => `${row.cell.n_ok}/${row.cell.n}`,
      className: (row) => (row.cell.n_ok < row.cell.n ? "bad" : "") },
  ];
  const list = table("summary", columns, rows, {
    keep: (row) => all || kHeadline.includes(row.info.name),
    controls: h("label", {}, h("input", { type: "checkbox", onchange: (event) => { all = event.currentTarget.checked; list.refresh(); } }), "all metrics"),
  });
  const notes = data.cells.flatMap((cell, index) => [
    cell.note ? `${cellLabel(cell, index)}: ${cell.note}.` : null,
    cell.metrics && Object.keys(cell.metrics).length === 0 ? `${cellLabel(cell, index)}: no trial gave an answer.` : null,
    cell.td_convergence ? `${cellLabel(cell, index)}: td converged for good in ${cell.td_convergence.n_converged} of ${cell.n_ok} trials${cell.td_convergence.median_s ? `, median after ${figure(cell.td_convergence.median_s)} s` : ""}.` : null,
  ].filter(Boolean));
  return section("summary", "Summary",
    "Errors over all trials of a cell. The bound is what no unbiased estimator can beat. A NEES in its band means that the estimator's stated uncertainty fits its errors; above, it is too sure of itself; below, too timid. One in twenty lies outside by chance.",
    list.element, notes.length ? h("ul", { class: "note" }, notes.map((note) => h("li", {}, note))) : null);
}
