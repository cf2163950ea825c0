// Gradient correlation of X-ray and DRR: core/CONVENTIONS.md, section 7.
import type { Pixels, View } from "./data";

export interface Filter { smooth: number[]; derivative: number[]; radius: number }

// Sigma 3 and radius 9 on the finest level; half of it for each halving, down to 1.
export function filter_at(halvings: number): Filter {
  const sigma = Math.max(1, 3 / 2 ** halvings), radius = Math.max(1, Math.round((9 * sigma) / 3));
  const offsets = Array.from({ length: 2 * radius + 1 }, (_, i) => i - radius);
  const bell = offsets.map((k) => Math.exp((-0.5 * k * k) / (sigma * sigma)));
  const total = bell.reduce((a, b) => a + b), slope = bell.reduce((sum, g, i) => sum + offsets[i] ** 2 * g, 0);
  return { radius, smooth: bell.map((g) => g / total), derivative: bell.map((g, i) => (offsets[i] * g) / slope) };
}

function correlated({ width, height, values }: Pixels, taps: number[], along_x: boolean): Pixels {
  const out = new Float32Array(width * height), radius = (taps.length - 1) / 2;
  const last = (along_x ? width : height) - 1, stride = along_x ? 1 : width;
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const here = along_x ? x : y, base = y * width + x - here * stride;
      let sum = 0;
      for (let k = -radius; k <= radius; k += 1) sum += taps[k + radius] * values[base + Math.min(last, Math.max(0, here + k)) * stride];
      out[y * width + x] = sum;
    }
  }
  return { width, height, values: out };
}

export function gradients(image: Pixels, filter: Filter): Pixels[] {
  return [correlated(correlated(image, filter.derivative, true), filter.smooth, false),
    correlated(correlated(image, filter.smooth, true), filter.derivative, false)];
}

// A masked pixel takes every pixel within the radius out.
function eroded(weights: Float32Array, width: number, height: number, radius: number): Float32Array {
  const pass = (in_: Float32Array, along_x: boolean) => in_.map((_, i) => {
    const x = i % width, y = (i - x) / width;
    for (let k = -radius; k <= radius; k += 1) {
      const px = along_x ? x + k : x, py = along_x ? y : y + k;
      if (px >= 0 && py >= 0 && px < width && py < height && in_[py * width + px] === 0) return 0;
    }
    return weights[i];
  });
  return pass(pass(weights, true), false);
}

export interface Fixed { channels: Pixels[]; weights: Float32Array; filter: Filter }

export function fixed_channels(image: Pixels, weights: Float32Array, halvings: number): Fixed {
  const filter = filter_at(halvings);
  const usable = { ...image, values: image.values.map((value, i) => (weights[i] === 0 ? 0 : value)) };
  return { filter, channels: gradients(usable, filter), weights: eroded(weights, image.width, image.height, filter.radius) };
}

function normalized(a: Float32Array, b: Float32Array, weights: Float32Array): number {
  let w = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (let i = 0; i < a.length; i += 1) {
    w += weights[i]; sa += weights[i] * a[i]; sb += weights[i] * b[i];
    saa += weights[i] * a[i] * a[i]; sbb += weights[i] * b[i] * b[i]; sab += weights[i] * a[i] * b[i];
  }
  const variance = (saa - (sa * sa) / w) * (sbb - (sb * sb) / w);
  return sbb - (sb * sb) / w > 1e-12 * sbb && variance > 0 ? (sab - (sa * sb) / w) / Math.sqrt(variance) : 0;
}

// Mean over both gradients, in [-1, 1]; 1 = alike, 0 = unrelated. The program's cost is 1 minus this.
export function correlation(fixed: Fixed, drr: Pixels): number {
  const moving = gradients(drr, fixed.filter);
  return (normalized(fixed.channels[0].values, moving[0].values, fixed.weights) + normalized(fixed.channels[1].values, moving[1].values, fixed.weights)) / 2;
}

// 2 x 2 means weighted by the weights; a last odd row or column is dropped.
export function halved(image: Pixels, weights: Float32Array): { image: Pixels; weights: Float32Array } {
  const width = image.width >> 1, height = image.height >> 1;
  const values = new Float32Array(width * height), coarse = new Float32Array(width * height);
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      let weight = 0, value = 0;
      for (let k = 0; k < 4; k += 1) {
        const i = (2 * y + (k >> 1)) * image.width + 2 * x + (k & 1);
        weight += weights[i];
        value += weights[i] * image.values[i];
      }
      values[y * width + x] = weight > 0 ? value / weight : 0;
      coarse[y * width + x] = weight / 4;
    }
  }
  return { image: { width, height, values }, weights: coarse };
}

// X-rays of a view at each halving, made when asked for.
export class Pyramid {
  private levels: { image: Pixels; weights: Float32Array }[];
  private fixed: Fixed[] = [];
  constructor(private view: View, image: Pixels, weights: Float32Array) { this.levels = [{ image, weights }]; }
  at(halvings: number): Fixed {
    while (this.levels.length <= halvings) {
      const { image, weights } = this.levels[this.levels.length - 1];
      this.levels.push(halved(image, weights));
    }
    const { image, weights } = this.levels[halvings];
    return (this.fixed[halvings] ??= fixed_channels(image, weights, this.view.halvings + halvings));
  }
}
