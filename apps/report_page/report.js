"use strict";
// Draws a report from the JSON in the page. Everything shown comes from there: no number is typed in here.

const data = JSON.parse(document.getElementById("data").textContent);
const root = document.getElementById("report");
// Okabe and Ito's colours: told apart with any colour vision. Dashes tell them apart in grey print, too.
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#1b1f24", "#999999"];
const DASHES = ["", "6 3", "2 2", "8 3 2 3", "1 3", "12 4", "4 4", "10 2"];
const colour = (i) => COLOURS[i % COLOURS.length];
const dash = (i) => DASHES[i % DASHES.length];

function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value !== false && value != null) node.setAttribute(name, value === true ? "" : value);
  }
  for (const child of children.flat(Infinity)) if (child != null) node.append(child);
  return node;
}

// With the digits that a registration deserves: a hundredth of a millimetre or degree, no more.
function measured(value, unit) {
  if (value == null) return "–";
  const size = Math.abs(value), space = unit === "°" ? "" : "\u00a0";
  if (size > 0 && size < 0.005) return `< 0.01${space}${unit}`;
  return value.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : 2) + space + unit;
}
const mm = (value) => measured(value, "mm");
const degrees = (value) => measured(value, "°");

function number(value, digits = 3) {
  if (value === null || value === undefined) return "–";
  if (typeof value !== "number") return String(value);
  if (Number.isInteger(value)) return Math.abs(value) >= 10000 ? value.toLocaleString("en") : String(value);
  const size = Math.abs(value);
  if (size >= 1e5 || (size < 1e-3 && size > 0)) return value.toExponential(digits - 1);
  return size >= 100 ? value.toFixed(0) : String(Number(value.toPrecision(digits)));
}
// Logarithmic where the values span more than a decade; labels at 1, 2 and 5 then.
function spanAxis(values) {
  const positive = values.filter((v) => v > 0);
  if (Math.max(...positive) < 10 * Math.min(...positive)) return { grid: true, zero: true };
  return { type: "log", grid: true, tickFormat: (v) => (/^[125](\.0*)?e/.test(v.toExponential()) ? number(v) : "") };
}
// Of costs: not from 0, which would flatten them; logarithmic where they differ much.
const costAxis = (label, values) => ({ label, ...spanAxis(values), zero: false, nice: true, ...(spanAxis(values).type ? {} : { tickFormat: (v) => number(v) }) });
const percent = (share) => (share == null ? "–" : (100 * share).toFixed(share > 0 && share < 0.1 ? 1 : 0) + "\u00a0%");
const megabytes = (bytes) => (bytes == null ? "–" : number(bytes / 1048576) + " MiB");
const seconds = (s) => (s == null ? "–" : s < 1 ? number(1000 * s) + " ms" : number(s) + " s");

function section(title, note, ...content) {
  const node = el("section", {}, el("h2", {}, title), note ? el("p", { class: "note" }, note) : null, ...content);
  root.append(node);
  return node;
}

// The two reasons that matter are seen at once, the others on request. `next`: what to do now.
function verdict(ok, sentence, reasons, cards, next = []) {
  const list = (some) => el("ul", {}, some.map((r) => el("li", {}, r)));
  root.append(el("div", { class: "verdict" + (ok ? "" : " bad"), id: "verdict" }, el("strong", {}, sentence),
    reasons.length ? list(reasons.slice(0, 2)) : null,
    reasons.length > 2 ? el("details", {}, el("summary", {}, `${reasons.length - 2} more reason${reasons.length === 3 ? "" : "s"}`), list(reasons.slice(2))) : null,
    next.length ? el("div", { class: "do-next" }, next) : null,
    el("div", { class: "cards" }, cards.map(([label, value]) => el("div", { class: "card" }, el("b", {}, value), el("span", {}, label))))));
}

// columns: {name, key or value(row), show(value,row), text, long}; those that are empty in every row are left out. Click a heading to sort; Copy takes it to a spreadsheet.
function table(allColumns, rows, isBad = () => false) {
  const valueOf = (column, row) => (column.value ? column.value(row) : row[column.key]);
  const columns = allColumns.filter((c, i) => i === 0 || !rows.length || rows.some((row) => valueOf(c, row) != null && valueOf(c, row) !== ""));
  const shown = (column, row) => (column.show ? column.show(valueOf(column, row), row) : number(valueOf(column, row)));
  const body = el("tbody");
  const fill = (list) => body.replaceChildren(...list.map((row) => el("tr", { class: isBad(row) ? "bad" : null },
    columns.map((c) => el("td", { class: (c.text ? "text" : "") + (c.long ? " long" : ""), "data-name": c.name }, shown(c, row))))));
  let sorted = rows.slice();
  const headings = columns.map((column, i) => {
    const sort = () => {
      const rising = headings[i].getAttribute("aria-sort") !== "ascending";
      headings.forEach((h) => h.removeAttribute("aria-sort"));
      headings[i].setAttribute("aria-sort", rising ? "ascending" : "descending");
      const key = (row) => { const v = valueOf(column, row); return v == null ? Infinity : v; };
      sorted = rows.slice().sort((a, b) => {
        const x = key(a), y = key(b);
        const order = typeof x === "number" && typeof y === "number" ? (x === y ? 0 : x - y) : String(x).localeCompare(String(y));
        return rising ? order : -order;
      });
      fill(sorted);
    };
    return el("th", { class: column.text ? "text" : null, tabindex: 0, scope: "col", title: "sort", onclick: sort,
      onkeydown: (event) => { if (event.key === "Enter") sort(); } }, column.name);
  });
  fill(sorted);
  const copy = el("button", { type: "button" }, "Copy");
  copy.addEventListener("click", async () => {
    const lines = [columns.map((c) => c.name)].concat(sorted.map((row) => columns.map((c) => valueOf(c, row) ?? "")));
    const text = lines.map((cells) => cells.join("\t")).join("\n");
    try { await navigator.clipboard.writeText(text); } catch (refused) {  // files opened from disk may not use the clipboard
      const area = el("textarea"); area.value = text; document.body.append(area); area.select(); document.execCommand("copy"); area.remove();
    }
    copy.textContent = "Copied"; setTimeout(() => { copy.textContent = "Copy"; }, 1500);
  });
  return el("div", {}, el("div", { class: "tools" }, copy), el("div", { class: "wide", tabindex: 0, role: "region", "aria-label": `table: ${columns[0].name}` }, el("table", {}, el("thead", {}, el("tr", {}, headings)), body)));
}

// The line of a legend, as the chart draws it.
function lineSample(i) {
  const line = (name, attributes) => { const node = document.createElementNS("http://www.w3.org/2000/svg", name); Object.entries(attributes).forEach(([k, v]) => node.setAttribute(k, v)); return node; };
  const svg = line("svg", { width: 30, height: 8, class: "sample", "aria-hidden": "true" });
  svg.append(line("line", { x1: 0, x2: 30, y1: 4, y2: 4, stroke: colour(i), "stroke-width": 2, "stroke-dasharray": dash(i) }));
  return svg;
}

// A chart as a file for a paper: vectors, with its title and legend in it.
function svgOf(title, svg, legend) {
  const height = Number(svg.getAttribute("height")), width = Number(svg.getAttribute("width")), top = 26 + (legend.length ? 18 : 0);
  const text = (x, y, size, content) => `<text x="${x}" y="${y}" font-size="${size}" fill="#1b1f24">${content.replace(/[&<>]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[c])}</text>`;
  let x = 8;
  const keys = legend.map(({ label, i, box }) => {
    const key = (box ? `<rect x="${x}" y="32" width="14" height="10" fill="${colour(i)}"/>` : `<line x1="${x}" x2="${x + 26}" y1="37" y2="37" stroke="${colour(i)}" stroke-width="2" stroke-dasharray="${dash(i)}"/>`) + text(x + 30, 41, 11, label);
    x += 44 + 6.2 * label.length;
    return key;
  });
  const inner = new XMLSerializer().serializeToString(svg).replace(/^<svg /, `<svg y="${top}" `);
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${Math.max(width, x)}" height="${height + top}" font-family="sans-serif">${text(8, 18, 14, title)}${keys.join("")}${inner}</svg>`;
}
function save(name, content, type) {
  const link = el("a", { href: URL.createObjectURL(new Blob([content], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const haveCharts = typeof globalThis.Plot === "object";
function chart(title, caption, options, legend = []) {
  const node = el("div", { class: "chart" }, el("h3", {}, title), caption ? el("p", { class: "caption" }, caption) : null);
  if (legend.length) {
    node.append(el("div", { class: "legend" }, legend.map(({ label, i, box }) => el("span", {},
      box ? el("i", { class: "box", style: `background:${colour(i)}` }) : lineSample(i), label))));
  }
  if (!haveCharts) return node;
  const svg = Plot.plot({ width: 520, height: 300, marginLeft: 62, marginTop: 30, marginBottom: 40, style: { fontSize: "12px", background: "none" }, ...options });
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", `chart: ${title}`);
  svg.querySelectorAll("g[aria-label]").forEach((group) => group.removeAttribute("aria-label"));  // names of marks, which a reader of screens cannot use
  const name = title.toLowerCase().replace(/[^a-z0-9]+/g, "_") + ".svg";
  node.append(svg, el("div", { class: "tools" }, el("button", { type: "button", "aria-label": `save the chart ${title} as SVG`, onclick: () => save(name, svgOf(title, svg, legend), "image/svg+xml") }, "SVG")));
  return node;
}
function charts(list) {
  return el("div", {}, haveCharts ? null : el("p", { class: "note", id: "no-charts" },
    "This build of raylign has no charts (npm was not there when it was built); the tables hold the same numbers."),
    haveCharts ? el("div", { class: "charts" }, list()) : null);
}

function manifest(report, more = []) {
  const machine = report.machine ?? data.machine ?? {};
  const rows = [["raylign", report.raylign], ["working directory", report.working_directory], ["machine", machine.host],
    ["processor", machine.processor && `${machine.processor}, ${machine.cores} usable cores`], ["memory", machine.memory_bytes && megabytes(machine.memory_bytes)],
    ["system", machine.system], ["compiler", machine.compiler], ["seed", report.seed ?? report.settings?.seed], ...more].filter(([, v]) => v != null && v !== "");
  section("How to repeat it", null, el("pre", {}, report.command),
    el("dl", {}, rows.flatMap(([k, v]) => [el("dt", {}, k), el("dd", {}, String(v))])),
    report.inputs?.length ? el("div", { style: "margin-top:12px" }, table([{ name: "Input", key: "path", text: true, long: true, show: String }, { name: "SHA-256", key: "sha256", text: true, long: true, show: (v) => el("span", { class: "mono" }, v) }], report.inputs)) : null);
  if (report.notes?.length) section("Notes", "What was decided while reading.", el("ul", {}, report.notes.map((n) => el("li", {}, n))));
}
const backendText = (b) => `${b.name}: ${b.device}, ${b.threads} thread${b.threads === 1 ? "" : "s"}${b.instruction_set ? ", " + b.instruction_set : ""}`;

function heading(title, sub) { root.append(el("header", {}, el("h1", {}, title), el("p", { class: "sub" }, sub))); }

const STAGES = [["prepare", "prepare"], ["drr", "DRR"], ["gradient", "gradient"], ["reduction", "NCC reduction"], ["transfer", "transfer"], ["optimizer", "optimizer, rest"]];
// rows: [{label, times: {prepare, drr, ...}}]: one stacked bar each.
function stageBars(title, caption, rows, stages = STAGES) {
  const bars = rows.flatMap((row) => stages.map(([key, label], i) => ({ row: row.label, stage: label, i, s: row.times[key] ?? 0 }))).filter((b) => b.s > 0);
  return chart(title, caption, {
    marginLeft: Math.min(300, 16 + 6.8 * Math.max(...rows.map((r) => r.label.length))), height: 60 + 34 * rows.length, x: { label: "seconds", grid: true }, y: { label: null, domain: rows.map((r) => r.label) },
    marks: [Plot.barX(bars, { x: "s", y: "row", fill: (b) => colour(b.i), order: null, insetTop: 4, insetBottom: 4, title: (b) => `${b.stage}: ${seconds(b.s)}` }), Plot.ruleX([0])],
  }, stages.map(([, label], i) => ({ label, i, box: true })).filter(({ i }) => bars.some((b) => b.i === i)));
}
