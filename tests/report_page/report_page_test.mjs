// node report_page_test.mjs PROGRAM [SCREENSHOTS]: what a reader of a report does, in Chromium without a network.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { Browser, Page, programs } from "./chromium.mjs";
import { experiment, invent, run } from "./sweeps.mjs";

const kSkip = 77;
const [program, screenshots] = process.argv.slice(2);
const chromium = programs.find((name) => { try { execFileSync("which", [name], { stdio: "ignore" }); return true; } catch { return false; } });
if (!chromium) {
  console.log(`skipped: none of ${programs.join(", ")} is installed`);
  process.exit(kSkip);
}

const folder = mkdtempSync(join(tmpdir(), "plumbline-page-"));
const browser = new Browser(chromium, join(folder, "profile"));
await browser.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: folder });
const page = await Page.open(browser);
const ready = "document.documentElement.dataset.ready === 'true'";

// Loads the file and checks what holds of every page; returns the best of three times, in ms.
async function open(file) {
  const times = [];
  for (let i = 0; i < 3; ++i) times.push(await page.load(`file://${file}`, ready));
  assert.deepEqual(page.problems, [], "nothing on the console");
  assert.deepEqual(page.requests.filter((url) => !/^(file|data|blob):/.test(url)), [], "nothing from the network");
  await checkCharts();
  return Math.min(...times);
}

// Drawn: marks beyond what an empty frame with its axes holds.
async function checkCharts() {
  await page.until("document.documentElement.dataset.drawn === 'true'");
  const charts = await page.evaluate(`[...document.querySelectorAll("figure")].map((figure) => ({ name: figure.dataset.name,
    paths: [...figure.querySelectorAll(".chart svg path")].filter((p) => (p.getAttribute("d") ?? "").length > 20 && !/NaN/.test(p.getAttribute("d"))).length,
    broken: figure.querySelector(".chart svg")?.outerHTML.includes("NaN") ?? true }))`);
  assert.ok(charts.length >= 2, "charts");
  for (const chart of charts) {
    assert.ok(!chart.broken, `${chart.name} is drawn with finite figures`);
    assert.ok(chart.paths >= 3, `${chart.name} has ${chart.paths} paths`);
  }
}

async function downloaded(name, click) {
  rmSync(join(folder, name), { force: true });
  await page.evaluate(click);
  for (let i = 0; i < 250; ++i) {
    if (existsSync(join(folder, name)) && statSync(join(folder, name)).size > 0) return readFileSync(join(folder, name));
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  throw new Error(`no download of ${name}`);
}

const column = (table, title) => page.evaluate(`(() => {
  const table = document.querySelector('[data-name="${table}"]');
  const at = [...table.querySelectorAll("th")].findIndex((th) => th.textContent === "${title}");
  return [...table.querySelectorAll("tbody tr")].map((row) => row.children[at].textContent);
})()`);
const clickHeading = (table, title) => page.evaluate(`[...document.querySelectorAll('[data-name="${table}"] th button')].find((b) => b.textContent === "${title}").click()`);

async function checkTables() {
  await clickHeading("worst_trials", "trial");
  const up = (await column("worst_trials", "trial")).map(Number);
  assert.deepEqual(up, up.slice().sort((a, b) => a - b), "sorted by number");
  await clickHeading("worst_trials", "trial");
  assert.deepEqual((await column("worst_trials", "trial")).map(Number), up.slice().sort((a, b) => b - a), "and the other way round");
  const all = (await column("summary", "metric")).length;
  await page.evaluate(`(() => { const input = document.querySelector('[data-name="summary"] input[type=search]'); input.value = "td error"; input.dispatchEvent(new Event("input")); })()`);
  const some = await column("summary", "metric");
  assert.ok(some.length > 0 && some.length < all && some.every((name) => name.includes("td error")), "filtered");
}

async function checkDownloads() {
  const csv = (await downloaded("ecdf_ate_position_m.csv", `document.querySelector('figure[data-name="ecdf_ate_position_m"] .csv').click()`)).toString();
  const rows = csv.split("\r\n");
  assert.equal(rows[0], "cell,share,value_mm");
  assert.equal(rows.length, 101 + 2, "a row a quantile, and the end");
  const table = (await downloaded("summary.csv", `document.querySelector('[data-name="summary"] .csv').click()`)).toString();
  assert.match(table, /^metric,unit,mean,RMSE,/);
  const png = await downloaded("ecdf_ate_position_m.png", `document.querySelector('figure[data-name="ecdf_ate_position_m"] .png').click()`);
  assert.deepEqual([...png.subarray(0, 4)], [0x89, 0x50, 0x4e, 0x47], "a PNG");
}

async function screenshot(name) {
  if (screenshots) writeFileSync(join(screenshots, `${name}.png`), await page.screenshot());
}

try {
  experiment(folder, "real", 1);
  run(program, folder, "run", "real.yaml", "--out", "real");

  experiment(folder, "thousand", 1000);
  const thousand = invent(program, folder, "thousand", "real");
  const size = statSync(thousand).size;
  assert.ok(size < 3e6, `${size} bytes are under 3 MB`);
  const time_ms = await open(thousand);
  console.log(`1,000 trials: ${(size / 1e6).toFixed(2)} MB, opens in ${time_ms.toFixed(0)} ms`);
  assert.ok(time_ms < 2000, `${time_ms} ms are under 2 s`);
  await checkTables();
  await checkDownloads();
  await screenshot("thousand");
  await page.send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: "dark" }] });
  await checkCharts();
  await screenshot("dark");
  await page.send("Emulation.setEmulatedMedia", { features: [] });
  const pdf = await page.send("Page.printToPDF", { printBackground: true });
  assert.ok(pdf.data.length > 50000, "prints");
  assert.deepEqual(page.problems, []);

  experiment(folder, "map", 4, "{scenario.camera.td_s: [0, 0.01, 0.02], scenario.camera.pixel_sigma_px: [0.5, 1, 2]}");
  await open(invent(program, folder, "map", "real"));
  assert.ok(await page.evaluate(`document.querySelector('figure[data-name="map_td_error_s_rmse"]') !== null`), "two axes make a heat map");
  await screenshot("map");

  experiment(folder, "one_axis", 25, "{scenario.camera.td_s: [-0.02, -0.01, 0, 0.01, 0.02]}");
  await open(invent(program, folder, "one_axis", "real"));
  await page.evaluate(`(() => { const list = document.querySelector("#time select"); list.value = "3"; list.dispatchEvent(new Event("change")); })()`);
  await checkCharts();
  await screenshot("one_axis");
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
console.log("ok");
