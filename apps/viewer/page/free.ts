// Where a volume is empty: rays leap over it.
import type { Volume } from "./data";

export const BLOCK = 4;  // voxels a side

export interface Free { size: number[]; blocks: Uint8Array }  // x fastest

// Of blocks of the volume with a voxel of zeros around it: 0 where a ray may meet something between two voxels, otherwise
// how many blocks away (along the axis on which that is most) the nearest such block is.
export function free_blocks({ size: [nx, ny, nz], values }: Volume): Free {
  const size = [nx, ny, nz].map((n) => Math.ceil((n + 2) / BLOCK)), [bx, by] = size;
  const blocks = new Uint8Array(size[0] * size[1] * size[2]).fill(255);
  for (let z = 0, i = 0; z < nz; z += 1) {
    for (let y = 0; y < ny; y += 1) {
      for (let x = 0; x < nx; x += 1, i += 1) if (values[i]) mark(blocks, bx, by, x, y, z);
    }
  }
  spread(blocks, size);
  return { size, blocks };
}

// A voxel counts from the voxel before it to the one after: cells x and x + 1 of the padded volume.
function mark(blocks: Uint8Array, bx: number, by: number, x: number, y: number, z: number): void {
  for (let k = 0; k < 8; k += 1) {
    const [i, j, l] = [x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)].map((cell) => Math.floor(cell / BLOCK));
    blocks[(l * by + j) * bx + i] = 0;
  }
}

// The chessboard distance in two sweeps.
function spread(blocks: Uint8Array, [bx, by, bz]: number[]): void {
  const before = Array.from({ length: 13 }, (_, k) => [k % 3 - 1, Math.floor(k / 3) % 3 - 1, Math.floor(k / 9) - 1]);
  for (const sign of [1, -1]) {
    for (let n = 0; n < blocks.length; n += 1) {
      const at = sign > 0 ? n : blocks.length - 1 - n, x = at % bx, y = Math.floor(at / bx) % by, z = Math.floor(at / (bx * by));
      for (const [dx, dy, dz] of before) {
        const [i, j, k] = [x + sign * dx, y + sign * dy, z + sign * dz];
        if (i < 0 || j < 0 || k < 0 || i >= bx || j >= by || k >= bz) continue;
        blocks[at] = Math.min(blocks[at], blocks[(k * by + j) * bx + i] + 1);
      }
    }
  }
}
