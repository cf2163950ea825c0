// Opens report pages as a reader would, offline: node open_report.mjs CHROMIUM FOLDER PAGE...
// Fails on a script error, on anything that the page tries to load, on a slider that does not move the picture, on a
// heading that does not sort, on an empty chart or verdict, on text that runs out of the page, on an outline that shows
// nothing, and on serious findings of axe-core. Saves screenshots at three widths and a PDF of each page to FOLDER.
import { mkdirSync, readFileSync, realpathSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, join } from "node:path";
import { pathToFileURL } from "node:url";
import puppeteer from "puppeteer-core";

const [chromium, folder, ...pages] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const browser = await puppeteer.launch({
  executablePath: chromium,
  args: ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"],
});
let problems = 0;
const expect = (page, holds, what) => {
  if (holds) return;
  problems += 1;
  console.error(`${page}: ${what}`);
};

async function checkSlider(tab, name) {
  const sliders = await tab.$$(".overlay input[type=range]");
  for (const slider of sliders.slice(0, 2)) {
    const cut = () => slider.evaluate((s) => getComputedStyle(s.parentElement.querySelector("img.top")).clipPath);
    const before = await cut();
    await slider.scrollIntoView();
    const box = await slider.boundingBox();
    await tab.mouse.click(box.x + 0.2 * box.width, box.y + box.height / 2);
    const after = await cut();
    expect(name, before !== after && /1[5-9]|2[0-5]/.test(after), `the slider moves the picture from ${before} to ${after}`);
    const loaded = await slider.evaluate((s) => [...s.parentElement.querySelectorAll("img")].every((i) => i.complete && i.naturalWidth > 0));
    expect(name, loaded, "a picture is broken");
    const buttons = await slider.evaluateHandle((s) => s.parentElement.querySelectorAll(".layers button"));
    const shown = () => slider.evaluate((s) => s.parentElement.querySelector("img.top").src.length + s.parentElement.querySelector(".tag.right").textContent);
    const count = await buttons.evaluate((b) => b.length);
    if (count > 1) {
      const last = await shown();
      await buttons.evaluate((b) => b[0].click());
      expect(name, last !== await shown(), "a layer's button shows another layer");
      await buttons.evaluate((b) => b[b.length - 1].click());
    }
    await tab.mouse.click(box.x + 0.5 * box.width, box.y + box.height / 2);
  }
  return sliders.length;
}

async function checkSorting(tab, name) {
  const works = await tab.evaluate(() => [...document.querySelectorAll("table")].every((table) => {
    const heading = table.querySelector("th");
    const texts = () => [...table.querySelectorAll("tbody tr")].map((row) => row.textContent).sort().join("|");
    const before = texts();
    heading.click();
    const rising = heading.getAttribute("aria-sort") === "ascending";
    heading.click();
    return rising && heading.getAttribute("aria-sort") === "descending" && texts() === before;
  }));
  expect(name, works, "a heading sorts its table and loses no row");
}

// The pictures begin with the outline of what was found: orange over grey. Mirrored, they are the same from the other side.
async function checkOutline(tab, name) {
  await tab.waitForFunction(() => [...document.querySelectorAll(".overlay img")].every((i) => i.complete && i.src.length > 100), { timeout: 20000 });
  const seen = () => tab.evaluate(() => [...document.querySelectorAll(".overlay")].map((overlay) => {
    const image = overlay.querySelector("img.top"), canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height), columns = new Array(canvas.width).fill(0);
    for (let i = 0; i < data.length; i += 4) columns[(i / 4) % canvas.width] += data[i] > data[i + 2] + 60 ? 1 : 0;
    return { pressed: overlay.querySelector("[aria-pressed=true]").textContent, columns };
  }));
  const before = await seen();
  for (const { pressed, columns } of before) expect(name, pressed.startsWith("outline") && columns.reduce((a, b) => a + b, 0) > 10, `${pressed} is drawn`);
  await tab.evaluate(() => document.querySelectorAll(".overlay").forEach((overlay) => [...overlay.querySelectorAll("button")].at(-1).click()));
  await new Promise((resolve) => { setTimeout(resolve, 500); });
  (await seen()).forEach(({ columns }, i) => expect(name, columns.toReversed().join() === before[i].columns.join(), "mirrored, the outline is the same from the other side"));
  await tab.evaluate(() => document.querySelectorAll(".overlay").forEach((overlay) => [...overlay.querySelectorAll("button")].at(-1).click()));
}

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
async function checkAccessible(tab, name) {
  await tab.addScriptTag({ content: axe });
  const { violations } = await tab.evaluate(() => globalThis.axe.run(document, { resultTypes: ["violations"] }));
  for (const v of violations) expect(name, !["serious", "critical"].includes(v.impact), `axe ${v.id}: ${v.help}: ${v.nodes[0].html.slice(0, 160)}`);
}

for (const file of pages) {
  const name = basename(file);
  const tab = await browser.newPage();
  const url = pathToFileURL(realpathSync(file)).href;
  tab.on("pageerror", (error) => expect(name, false, `script error: ${error.message}`));
  tab.on("console", (message) => { if (message.type() === "error") expect(name, false, `console: ${message.text()}`); });
  tab.on("request", (request) => { if (!request.url().startsWith("data:") && request.url() !== url) expect(name, false, `loads ${request.url()}`); });
  await tab.setOfflineMode(true);
  await tab.setViewport({ width: 1280, height: 900 });
  await tab.goto(url, { waitUntil: "load", timeout: 120000 });

  const found = await tab.evaluate(() => ({
    verdict: document.querySelector("#verdict strong")?.textContent ?? "",
    first: document.querySelector("main")?.children[1]?.id ?? "",
    charts: document.querySelectorAll(".chart svg:not(.sample)").length,
    marks: [...document.querySelectorAll(".chart svg:not(.sample)")].map((svg) => svg.querySelectorAll("path, rect, circle, line").length),
    withoutCharts: document.querySelector("#no-charts") !== null,
    pictures: document.querySelectorAll(".overlay").length,
    rows: document.querySelectorAll("tbody tr").length,
    command: document.querySelector("pre")?.textContent ?? "",
    bad: /NaN|undefined|\[object/.test(document.querySelector("main").innerText),
    overflow: document.documentElement.scrollWidth - innerWidth,
  }));
  expect(name, found.verdict.length > 5 && found.first === "verdict", "the verdict comes first");
  expect(name, found.withoutCharts || (found.charts > 0 && found.marks.every((n) => n > 3)), `charts are drawn: ${found.marks}`);
  expect(name, found.rows > 0, "tables have rows");
  expect(name, found.command.includes("raylign"), "the command to repeat is there");
  expect(name, !found.bad, "no NaN, undefined or [object] in the text");
  expect(name, found.overflow <= 0, `the page is ${found.overflow} px too wide`);
  if (found.pictures > 0) await checkOutline(tab, name);
  await checkAccessible(tab, name);
  for (const width of [1920, 1280]) {
    await tab.setViewport({ width, height: 900 });
    await tab.evaluate(() => scrollTo(0, 0));
    await tab.screenshot({ path: join(folder, name.replace(/\.html$/, `_${width}.png`)), fullPage: true });
  }
  const sliders = await checkSlider(tab, name);
  await tab.pdf({ path: join(folder, name.replace(/\.html$/, ".pdf")), format: "A4", printBackground: true });
  await checkSorting(tab, name);
  await tab.setViewport({ width: 400, height: 800 });
  // Charts are drawn anew for the new width: a busy machine takes its time.
  await tab.waitForFunction(() => document.documentElement.scrollWidth <= innerWidth, { timeout: 20000 }).catch(() => {});
  const narrow = await tab.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  expect(name, narrow <= 0, `on a telephone the page is ${narrow} px too wide`);
  await tab.screenshot({ path: join(folder, name.replace(/\.html$/, "_400.png")), fullPage: true });
  console.log(`${name}: "${found.verdict}", ${found.charts} charts, ${sliders} sliders, ${found.rows} rows`);
  await tab.close();
}
await browser.close();
process.exit(problems ? 1 : 0);
