"use strict";
// The pictures of a report: X-rays under DRRs, zoomed to the object, with its outline and the letters of the patient's sides.

// The first of one object; those of several as the overlay's picture has them.
const OUTLINES = [[255, 150, 0], [60, 170, 255], [0, 200, 140], [240, 228, 66], [230, 130, 190], [120, 140, 255], [255, 90, 60], [200, 200, 200]];

function pixelsOf(image) {
  const canvas = el("canvas", { width: image.naturalWidth, height: image.naturalHeight }), context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return { canvas, context, picture: context.getImageData(0, 0, canvas.width, canvas.height) };
}

// Each DRR outlined in a colour of its own over the base.
function withOutlines(base, layers) {
  const { canvas, context, picture } = pixelsOf(base);
  layers.forEach((layer, k) => drawOutline(picture, pixelsOf(layer).picture, OUTLINES[k % OUTLINES.length]));
  context.putImageData(picture, 0, 0);
  return canvas;
}

// Where the DRR is steep: its grey values change by more than a share of their range across two pixels, and by more than beside the line. Of a
// picture that is smooth all over (a chest fills it), what is steep for it.
function drawOutline(picture, drr, rgb) {
  const { width, height } = picture;
  const place = (x, y) => Math.min(height - 1, Math.max(0, y)) * width + Math.min(width - 1, Math.max(0, x)), grey = (x, y) => drr.data[4 * place(x, y)];
  const slopes = Array.from({ length: width * height }, (_, i) => { const x = i % width, y = (i - x) / width; return [grey(x + 1, y) - grey(x - 1, y), grey(x, y + 1) - grey(x, y - 1)]; });
  const steepness = slopes.map(([dx, dy]) => Math.hypot(dx, dy));
  const rising = steepness.filter((steep) => steep > 0.5).sort((a, b) => a - b), high = Math.max(6, Math.min(36, rising[Math.floor(0.97 * rising.length)] ?? 36)), low = 0.4 * high;
  steepness.forEach((steep, i) => {
    const x = i % width, y = (i - x) / width, [dx, dy] = slopes[i].map((d) => Math.round(d / (steep || 1)));
    if (steep < steepness[place(x + dx, y + dy)] || steep <= steepness[place(x - dx, y - dy)]) return;
    const share = Math.min(1, Math.max(0, (steep - low) / (high - low)));
    for (let c = 0; c < 3; c += 1) picture.data[4 * i + c] += share * (rgb[c] - picture.data[4 * i + c]);
  });
}

// The part of the picture that shows the objects, with a margin; the whole picture where that is nearly all of it.
function boxOfObjects(layers) {
  const { naturalWidth: width, naturalHeight: height } = layers[0];
  let [left, top, right, bottom] = [width, height, -1, -1];
  for (const { data } of layers.map((layer) => pixelsOf(layer).picture)) for (let y = 0; y < height; y += 1) for (let x = 0; x < width; x += 1) {
    if (data[4 * (y * width + x)] < 12) continue;
    left = Math.min(left, x); right = Math.max(right, x); top = Math.min(top, y); bottom = Math.max(bottom, y);
  }
  const margin = Math.round(0.12 * Math.max(right - left, bottom - top)) + 4;
  const x = Math.max(0, left - margin), y = Math.max(0, top - margin), w = Math.min(width, right + margin + 1) - x, h = Math.min(height, bottom + margin + 1) - y;
  return right < 0 || w * h > 0.8 * width * height ? { x: 0, y: 0, w: width, h: height } : { x, y, w, h };
}

function cut(source, { x, y, w, h }, mirrored) {
  const canvas = el("canvas", { width: w, height: h }), context = canvas.getContext("2d");
  if (mirrored) context.setTransform(-1, 0, 0, 1, w, 0);
  context.drawImage(source, x, y, w, h, 0, 0, w, h);
  return canvas.toDataURL();
}

// The patient's sides at the right and lower edge of a view: the nearest direction, and a second where it is far off the axes.
function letterOf(direction) {
  const names = [["L", "R"], ["P", "A"], ["H", "F"]];
  return direction.map((value, axis) => [Math.abs(value), names[axis][value > 0 ? 0 : 1]]).filter(([size]) => size > 0.4).sort((a, b) => b[0] - a[0]).slice(0, 2).map(([, name]) => name).join("");
}
function sidesOf(camera_from_world, world_from_ct) {
  const row = (r) => [0, 1, 2].map((c) => [0, 1, 2].reduce((sum, k) => sum + camera_from_world[r][k] * world_from_ct[k][c], 0));
  const minus = (v) => v.map((x) => -x);
  return { right: letterOf(row(0)), left: letterOf(minus(row(0))), bottom: letterOf(row(1)), top: letterOf(minus(row(1))) };
}

const loaded = (uri) => new Promise((resolve, reject) => { const image = new Image(); image.onload = () => resolve(image); image.onerror = reject; image.src = uri; });

// images: [{title, base: {label, uri}, layers: [{label, uri}], objects: [{label, uri}] where there are several}]; sides: of each, or none. Left of the slider the X-ray, right of it what a button chose.
function overlays(images, sides = []) {
  return el("div", { class: "overlays" + (images.length === 1 ? " single" : "") }, images.map((image, i) => overlay(image, sides[i])));
}

function overlay(image, sides) {
  const last = image.layers.length - 1, state = { layer: last + 1, zoomed: true, mirrored: false };
  const base = el("img", { src: image.base.uri, alt: image.base.label }), top = el("img", { class: "top", alt: "", src: image.layers[last].uri });
  const right = el("span", { class: "tag right" }), marks = ["left", "right", "top", "bottom"].map((side) => el("span", { class: `side ${side}`, "aria-hidden": "true" }));
  const frame = el("div", { class: "frame" }, base, top, el("div", { class: "edge" }), el("span", { class: "tag left" }, image.base.label), right, marks);
  const slide = el("input", { type: "range", min: 0, max: 100, value: 0, step: 0.5, "aria-label": "slide between the images of " + image.title });
  const set = (value) => { slide.value = value; frame.style.setProperty("--cut", value + "%"); };
  slide.addEventListener("input", () => set(slide.value));
  const objects = image.objects ?? [], legend = objects.map(({ label }, k) => el("span", { class: "object" }, el("i", { style: `background:rgb(${OUTLINES[k % OUTLINES.length]})` }), label));
  const labels = [...image.layers.map((layer) => layer.label), objects.length ? "outlines of the objects" : `outline of the ${image.layers[last].label}`];
  const buttons = labels.map((label, k) => el("button", { type: "button", onclick: () => { state.layer = k; set(k > last ? 0 : 50); draw(); } }, label));
  const zoom = el("button", { type: "button", onclick: () => { state.zoomed = !state.zoomed; draw(); } }, objects.length ? "zoomed to the objects" : "zoomed to the object");
  const mirror = el("button", { type: "button", title: "Pictures are what the detector sees from the source; mirrored, what one sees who stands at the detector.", onclick: () => { state.mirrored = !state.mirrored; draw(); } }, "mirrored");
  const sources = Promise.all([image.base, ...image.layers, ...objects].map((layer) => loaded(layer.uri))).then(([x, ...pictures]) => {
    const drrs = pictures.slice(0, last + 1), outlined = objects.length ? pictures.slice(last + 1) : [drrs[last]];
    return { x, drrs: [...drrs, withOutlines(x, outlined)], box: boxOfObjects(outlined) };
  });
  async function draw() {
    buttons.forEach((b, k) => b.setAttribute("aria-pressed", String(k === state.layer)));
    zoom.setAttribute("aria-pressed", String(state.zoomed));
    mirror.setAttribute("aria-pressed", String(state.mirrored));
    right.textContent = top.alt = labels[state.layer];
    for (const mark of marks) mark.textContent = sides ? sides[{ left: state.mirrored ? "right" : "left", right: state.mirrored ? "left" : "right" }[mark.classList[1]] ?? mark.classList[1]] : "";
    const { x, drrs, box } = await sources, part = state.zoomed ? box : { x: 0, y: 0, w: x.naturalWidth, h: x.naturalHeight };
    base.src = cut(x, part, state.mirrored);
    top.src = cut(drrs[state.layer], part, state.mirrored);
  }
  set(0);
  draw();
  return el("div", { class: "overlay" }, el("h3", {}, image.title), frame, slide, el("div", { class: "layers" }, buttons, zoom, mirror), legend.length ? el("div", { class: "objects" }, legend) : null);
}
