// Chromium by its DevTools protocol over a pipe (messages end in NUL), with neither packages nor ports.
import { spawn } from "node:child_process";

export const programs = ["chromium", "chromium-browser", "google-chrome"];

export class Browser {
  constructor(program, profile) {
    this.process = spawn(program, ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--remote-debugging-pipe",
      "--host-resolver-rules=MAP * ~NOTFOUND", `--user-data-dir=${profile}`], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    this.waiting = new Map();
    this.listeners = [];
    this.next = 1;
    let rest = "";
    this.process.stdio[4].setEncoding("utf8").on("data", (text) => {
      const messages = (rest + text).split("\0");
      rest = messages.pop();
      for (const message of messages) this.#receive(JSON.parse(message));
    });
    this.process.on("exit", (code) => {
      for (const { reject } of this.waiting.values()) reject(new Error(`chromium ended with ${code}`));
    });
  }

  #receive(message) {
    const waiter = this.waiting.get(message.id);
    if (!waiter) return this.listeners.forEach((listen) => listen(message));
    this.waiting.delete(message.id);
    if (message.error) waiter.reject(new Error(`${waiter.method}: ${message.error.message}`));
    else waiter.resolve(message.result);
  }

  send(method, params = {}, sessionId = undefined) {
    const id = this.next++;
    this.process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject, method }));
  }

  async close() {
    const ended = new Promise((resolve) => this.process.on("exit", resolve));
    await this.send("Browser.close").catch(() => {});
    await ended;
  }
}

// A page, what went wrong on it, and what it asked of the network.
export class Page {
  static async open(browser, width = 1280, height = 1000) {
    const page = new Page();
    page.browser = browser;
    const { targetId } = await browser.send("Target.createTarget", { url: "about:blank" });
    ({ sessionId: page.session } = await browser.send("Target.attachToTarget", { targetId, flatten: true }));
    page.problems = [];
    page.requests = [];
    browser.listeners.push(({ method, params, sessionId }) => {
      if (sessionId !== page.session) return;
      if (method === "Runtime.exceptionThrown") page.problems.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
      if (method === "Runtime.consoleAPICalled" && ["error", "warning"].includes(params.type)) page.problems.push(params.args.map((a) => a.value ?? a.description).join(" "));
      if (method === "Log.entryAdded" && params.entry.level === "error") page.problems.push(params.entry.text);
      if (method === "Network.requestWillBeSent") page.requests.push(params.request.url);
    });
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await page.send(`${domain}.enable`);
    await page.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
    return page;
  }

  send(method, params) { return this.browser.send(method, params, this.session); }

  async evaluate(expression) {
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  // Limits count turns of 20 ms, since a busy machine's clock says nothing of what the page has had.
  async until(condition, turns = 3000) {
    for (let i = 0; i < turns; ++i) {
      if (await this.evaluate(condition)) return;
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    throw new Error(`never ${condition}`);
  }

  // Milliseconds from the navigation's start until `condition` holds.
  async load(url, condition, turns = 3000) {
    this.problems.length = 0;
    this.requests.length = 0;
    await this.send("Page.navigate", { url });
    for (let i = 0; i < turns; ++i) {
      const at = await this.evaluate(`document.URL === ${JSON.stringify(url)} && (${condition}) ? performance.now() : 0`).catch(() => 0);
      if (at > 0) return at;
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    throw new Error(`${url}: never ready: ${this.problems.join("; ")}`);
  }

  async screenshot(height = undefined) {
    const full = height ?? await this.evaluate("document.documentElement.scrollHeight");
    const width = await this.evaluate("innerWidth");
    const { data } = await this.send("Page.captureScreenshot", { captureBeyondViewport: true, clip: { x: 0, y: 0, width, height: full, scale: 1 } });
    return Buffer.from(data, "base64");
  }
}
