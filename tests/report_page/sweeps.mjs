// Folders of results of any size, made from one trial that the program has run.
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const kScenario = `scenario:
  duration_s: 2
  world: {landmarks: 1000}
  points: {per_frame: 20}
  camera: {readout_s: 0.01}
  imu: {gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.0e-5, accel_noise_density_m_s2_sqrt_hz: 2.0e-3, accel_bias_walk_m_s3_sqrt_hz: 3.0e-3}
estimator: {type: sliding_window, keyframe_rate_hz: 10}
set: {eval.crlb: true}
`;

export function experiment(folder, name, trials, axes = "") {
  const file = join(folder, `${name}.yaml`);
  writeFileSync(file, `experiment: {trials: ${trials}${axes ? `, axes: ${axes}` : ""}}\n${kScenario}`);
  return file;
}

export const run = (program, folder, ...words) => execFileSync(program, words, { cwd: folder, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });

// Of the plan of `name`, each run the real one with figures that differ from trial to trial; every hundredth failed.
export function invent(program, folder, name, real) {
  run(program, folder, "plan", `${name}.yaml`, "--out", name);
  const manifest = JSON.parse(readFileSync(join(folder, name, "manifest.json"), "utf8"));
  const [row] = readFileSync(join(folder, real, "results.jsonl"), "utf8").trim().split("\n").map((line) => JSON.parse(line));
  const [timing] = readFileSync(join(folder, real, "timings.jsonl"), "utf8").trim().split("\n").map((line) => JSON.parse(line));
  const series = readFileSync(join(folder, real, "series", `${row.run_id}.json`), "utf8");
  mkdirSync(join(folder, name, "series"), { recursive: true });
  let rows = "";
  let timings = "";
  let count = 0;
  manifest.cells.forEach((_, cell) => {
    for (let trial = 0; trial < manifest.experiment.trials; ++trial) {
      const factor = 0.5 + ((count * 7919) % 1000) / 1000 + 0.1 * cell;
      const run_id = count.toString(16).padStart(16, "0");
      const ok = count++ % 100 !== 99;
      const metrics = Object.fromEntries(Object.entries(row.metrics).map(([k, m]) => [k, { ...m, value: m.value * factor }]));
      rows += JSON.stringify({ ...row, run_id, cell, trial, ok, status: ok ? row.status : "diverged", reason: ok ? "" : "made up", metrics: ok ? metrics : {} }) + "\n";
      timings += JSON.stringify({ ...timing, run_id, cell, trial }) + "\n";
      if (ok) writeFileSync(join(folder, name, "series", `${run_id}.json`), series);
    }
  });
  writeFileSync(join(folder, name, "results.jsonl"), rows);
  writeFileSync(join(folder, name, "timings.jsonl"), timings);
  run(program, folder, "report", name);
  return join(folder, name, "report.html");
}
