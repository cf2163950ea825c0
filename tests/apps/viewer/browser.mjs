// What the viewer's tests share: a browser, a page that must load nothing and throw nothing, and a count of what does not hold.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, realpathSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import puppeteer from "puppeteer-core";

export const [chromium, raylign, shots, data] = process.argv.slice(2);

let problems = 0;
export function expect(holds, what) {
  if (holds) return;
  problems += 1;
  console.error(`FAILED: ${what}`);
}
export const expect_near = (value, wanted, tolerance, what) =>
  expect(Math.abs(value - wanted) <= tolerance, `${what}: ${value}, and not ${wanted} within ${tolerance}`);

// Runs the program; returns what it printed. Codes other than `codes` end the test.
export function run(args, codes = [0]) {
  try {
    return execFileSync(raylign, args, { encoding: "utf8", maxBuffer: 1 << 28, stdio: ["ignore", "pipe", "pipe"] });
  } catch (failure) {
    if (codes.includes(failure.status)) return failure.stdout;
    throw new Error(`raylign ${args.join(" ")} ended with ${failure.status}: ${failure.stderr}`);
  }
}

export const launch = () => puppeteer.launch({ executablePath: chromium, protocolTimeout: 300000,
  args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--hide-scrollbars"] });

// Opens a page offline. `prepare`: done to the tab first. Resolves when the first full DRRs are there, or the reason why not.
export async function open(browser, file, { width = 1280, height = 900, is_report = false, prepare = async () => {} } = {}) {
  const tab = await browser.newPage(), url = pathToFileURL(realpathSync(file)).href;
  tab.on("pageerror", (error) => expect(false, `${file}: script error: ${error.message}`));
  tab.on("console", (message) => { if (message.type() === "error") expect(false, `${file}: console: ${message.text()}`); });
  tab.on("request", (request) => { if (!/^(data|blob):/.test(request.url()) && request.url() !== url) expect(false, `${file} loads ${request.url()}`); });
  tab.on("dialog", async (dialog) => { expect(false, `${file} opens a dialog: ${dialog.message()}`); await dialog.dismiss(); });
  await tab.setOfflineMode(true);
  await tab.setViewport({ width, height });
  await prepare(tab);
  await tab.goto(url, { waitUntil: "load", timeout: 120000 });
  if (!is_report) await settled(tab);
  return tab;
}

// Nothing moves, and what is shown is the full picture of the state.
export const settled = (tab) => tab.waitForFunction(() => globalThis.raylign?.at_rest, { timeout: 240000, polling: 50 });

export const pose_of = (tab) => tab.evaluate(() => Array.from(raylign.store.pose));
export async function set_pose(tab, rows) {
  await tab.evaluate((m) => raylign.store.move([0, 1, 2, 3].flatMap((c) => [0, 1, 2, 3].map((r) => m[r][c]))), rows);
  await settled(tab);
}

// Of the page: canvases of the views, in CSS pixels of the window.
export const canvas_box = async (tab, view) => {
  const canvas = (await tab.$$(">>> .panel canvas"))[view];
  await canvas.scrollIntoView();
  return canvas.boundingBox();
};

export async function drag(tab, from, to, { button = "left", key } = {}) {
  if (key) await tab.keyboard.down(key);
  await tab.mouse.move(...from);
  await tab.mouse.down({ button });
  await tab.mouse.move(...to, { steps: 4 });
  await tab.mouse.up({ button });
  if (key) await tab.keyboard.up(key);
  await settled(tab);
}

// What the page hands out, as files.
export async function take_downloads(browser, folder) {
  mkdirSync(folder, { recursive: true });
  const session = await browser.target().createCDPSession();
  await session.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: resolve(folder), eventsEnabled: true });
}
export async function downloaded(path) {
  for (let i = 0; i < 200 && !existsSync(path); i += 1) await new Promise((done) => { setTimeout(done, 50); });
  return readFileSync(path);
}

export function finish(summary) {
  console.log(summary);
  process.exit(problems ? 1 : 0);
}
