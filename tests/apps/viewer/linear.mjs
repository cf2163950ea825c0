// Matrices as rows, worked out here again: the tests must not believe the page's own arithmetic.
export const product = (a, b) => a.map((row) => b[0].map((_, c) => row.reduce((sum, x, k) => sum + x * b[k][c], 0)));
export const apply = (m, [x, y, z]) => m.slice(0, 3).map((row) => row[0] * x + row[1] * y + row[2] * z + row[3]);
export const rows_of = (column_major) => [0, 1, 2, 3].map((r) => [0, 1, 2, 3].map((c) => column_major[4 * c + r]));
export function inverse(m) {  // of a rigid motion
  const t = m.map((row) => row[3]);
  return [...[0, 1, 2].map((r) => [m[0][r], m[1][r], m[2][r], -(m[0][r] * t[0] + m[1][r] * t[1] + m[2][r] * t[2])]), [0, 0, 0, 1]];
}
export const shift = ([x, y, z]) => [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]];
// Rodrigues, about an axis through the origin.
export function turn([x, y, z], angle) {
  const n = Math.hypot(x, y, z), [a, b, c] = [x / n, y / n, z / n], s = Math.sin(angle), v = 1 - Math.cos(angle);
  const k = 1 - v;
  return [[k + a * a * v, a * b * v - c * s, a * c * v + b * s, 0], [a * b * v + c * s, k + b * b * v, b * c * v - a * s, 0],
    [a * c * v - b * s, b * c * v + a * s, k + c * c * v, 0], [0, 0, 0, 1]];
}
export const about = (centre, motion) => product(product(shift(centre), motion), shift(centre.map((x) => -x)));
export const euler = (a, b, c) => product(product(turn([0, 0, 1], c), turn([0, 1, 0], b)), turn([1, 0, 0], a));
export const project = (view, [x, y, z]) => {
  const [[fx, skew, cx], [, fy, cy]] = view.intrinsics_px;
  return [(fx * x + skew * y) / z + cx, (fy * y) / z + cy];
};
// z K^-1 (u, v, 1).
export const unproject = (view, [u, v], z) => {
  const [[fx, skew, cx], [, fy, cy]] = view.intrinsics_px, y = (v - cy) / fy;
  return [z * ((u - cx - skew * y) / fx), z * y, z];
};
export const farthest = (a, b) => Math.max(...a.flatMap((row, r) => row.map((x, c) => Math.abs(x - b[r][c]))));
