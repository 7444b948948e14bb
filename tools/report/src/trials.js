// Single trials: those that failed, the worst, and all; what they cost; and by what they were made.
import { copyButton, h, section } from "./dom.js";
import { cellLabel, figure, seconds, splitLabel } from "./format.js";
import { table } from "./table.js";

const command = (text) => h("span", {}, h("code", {}, text), " ", copyButton(text));

export function worstSection(data) {
  const info = (name) => data.metrics.find((m) => m.name === name);
  const cellColumn = { title: "cell", value: (row) => row.cell, show: (row) => cellLabel(data.cells[row.cell], row.cell), search: (row) => cellLabel(data.cells[row.cell], row.cell) };
  const replay = { title: "to make it again", value: (row) => row.replay, show: (row) => command(row.replay) };
  const worst = table("worst_trials", [
    { title: "metric", value: (row) => splitLabel(info(row.metric).label).name },
    cellColumn,
    { title: "trial", number: true, value: (row) => row.trial },
    { title: "error", number: true, value: (row) => row.value * info(row.metric).scale, show: (row) => `${figure(row.value * info(row.metric).scale)} ${splitLabel(info(row.metric).label).unit}` },
    { title: "x RMSE of its cell", number: true, hint: "above 3: look at it", value: (row) => Math.abs(row.value) / data.cells[row.cell].metrics[row.metric].rmse,
      show: (row) => (Math.abs(row.value) / data.cells[row.cell].metrics[row.metric].rmse).toFixed(2), className: (row) => (Math.abs(row.value) > 3 * data.cells[row.cell].metrics[row.metric].rmse ? "warn" : "") },
    replay,
  ], data.worst);
  const failures = data.failures.length === 0 ? h("p", {}, "No trial failed.") : table("failed_trials", [
    cellColumn, { title: "trial", number: true, value: (row) => row.trial }, { title: "status", value: (row) => row.status },
    { title: "reason", wrap: true, value: (row) => row.reason }, replay,
  ], data.failures).element;
  return section("worst", "Failed and worst trials", "The five largest errors of td and of the trajectory over all cells. The command simulates, estimates and evaluates that trial again; with --dump FOLDER it leaves the recording.",
    failures, worst.element);
}

export function trialsSection(data) {
  if (!data.trials || !data.trials.trial) return null;
  const t = data.trials;
  const rows = t.trial.map((trial, i) => ({ trial, cell: t.cell[i], ok: t.ok[i], status: t.status[i], run_id: t.run_id[i], iterations: t.iterations[i], metrics: t.metrics[i] }));
  const shown = data.metrics.filter((m) => m.in_table || m.name === "td_convergence_s");
  const list = table("trials", [
    ...(data.cells.length > 1 ? [{ title: "cell", value: (row) => row.cell, show: (row) => cellLabel(data.cells[row.cell], row.cell), search: (row) => cellLabel(data.cells[row.cell], row.cell) }] : []),
    { title: "trial", number: true, value: (row) => row.trial },
    { title: "status", value: (row) => row.status, className: (row) => (row.ok ? "" : "bad") },
    ...shown.map((m) => ({ title: m.label, number: true, value: (row) => (row.metrics[m.name] === undefined ? undefined : row.metrics[m.name] * m.scale), show: (row) => figure(row.metrics[m.name] * m.scale) })),
    { title: "iterations", number: true, value: (row) => row.iterations },
    { title: "run", value: (row) => row.run_id, show: (row) => h("code", {}, row.run_id) },
  ], rows);
  return section("trials", "All trials", null, h("details", {}, h("summary", {}, `${rows.length} trials`), list.element));
}

const kParts = [["simulate_s", "simulate"], ["estimate_s", "estimate"], ["evaluate_s", "evaluate, with the bound"]];

export function timingSection(data) {
  const rows = data.cells.flatMap((cell, index) => kParts.filter(([part]) => cell.timing[part]).map(([part, title]) => ({ cell, index, title, ...cell.timing[part] })));
  if (rows.length === 0) return null;
  const total = rows.reduce((sum, row) => sum + row.sum_s, 0);
  const column = (title, i) => ({ title: `${title} [s]`, number: true, value: (row) => row.q[i], show: (row) => figure(row.q[i]) });
  return section("timing", "Time", `Processor time of one thread; ${seconds(total)} altogether. It depends on the machine and its load, and enters no verdict.`,
    table("timing", [
      ...(data.cells.length > 1 ? [{ title: "cell", value: (row) => row.index, show: (row) => cellLabel(row.cell, row.index), search: (row) => cellLabel(row.cell, row.index) }] : []),
      { title: "part", value: (row) => row.title }, column("median", 3), column("5 %", 1), column("95 %", 5), column("longest", 6),
    ], rows).element);
}

export function provenanceSection(data) {
  return section("provenance", "Provenance", "Enough to make the same numbers again: same packages and processor model, same bytes.",
    h("dl", {}, data.provenance.flatMap(([name, text]) => [h("dt", {}, name), h("dd", {}, text)])),
    data.config ? h("details", {}, h("summary", {}, "resolved configuration, with every default"), h("pre", { tabindex: "0" }, JSON.stringify(data.config, null, 2))) : null);
}
