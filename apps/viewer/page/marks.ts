// What is drawn over a panel: marked points, where the CT's points are at the pose, epipolar lines.
import { epipolar_line } from "./landmarks";
import type { Live } from "./live";
import { moved_point, pixel_of, product } from "./geometry";

const MARKED = "#ffe14d", PROJECTED = "#4de1ff";

function line_through(context: CanvasRenderingContext2D, a: number[], b: number[]): void {
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1, far = 1e4 / length;
  context.beginPath();
  context.moveTo(a[0] - far * (b[0] - a[0]), a[1] - far * (b[1] - a[1]));
  context.lineTo(b[0] + far * (b[0] - a[0]), b[1] + far * (b[1] - a[1]));
  context.stroke();
}

function cross(context: CanvasRenderingContext2D, [x, y]: number[], name: string): void {
  context.beginPath();
  for (const [dx, dy] of [[6, 0], [0, 6]]) { context.moveTo(x - dx, y - dy); context.lineTo(x + dx, y + dy); }
  context.stroke();
  context.fillText(name, x + 8, y - 6);
}

// Red over what is ignored: `factors` and offsets of panel = factor * pixel + offset.
function draw_mask(live: Live, index: number, context: CanvasRenderingContext2D, [fx, fy, ox, oy]: number[]): void {
  const picture = live.mask_picture(index);
  if (!picture) return;
  context.save();
  context.imageSmoothingEnabled = false;
  context.setTransform(fx, 0, 0, fy, ox - fx / 2, oy - fy / 2);
  context.drawImage(picture, 0, 0);
  context.restore();
}

function draw_polygon(live: Live, index: number, context: CanvasRenderingContext2D, at: (pixel: number[]) => number[]): void {
  const { polygon } = live.store.state;
  if (polygon?.view !== index) return;
  context.strokeStyle = context.fillStyle = MARKED;
  context.beginPath();
  polygon.corners.forEach((corner, i) => { const [x, y] = at(corner); if (i) context.lineTo(x, y); else context.moveTo(x, y); });
  context.stroke();
  polygon.corners.forEach((corner) => { const [x, y] = at(corner); context.fillRect(x - 3, y - 3, 6, 6); });
}

export function draw_marks(live: Live, index: number, panel: HTMLCanvasElement): void {
  const { scene, state } = live.store, view = scene.views[index], context = panel.getContext("2d")!;
  const density = panel.width / live.panel_size(index)[0], [fx, fy, ox, oy] = live.image_from_panel(index);
  const at = ([u, v]: number[]) => [(u - ox) / fx * density, (v - oy) / fy * density];
  context.lineWidth = 1.5 * density;
  context.font = `${12 * density}px sans-serif`;
  draw_mask(live, index, context, [density / fx, density / fy, -ox / fx * density, -oy / fy * density]);
  draw_polygon(live, index, context, at);
  state.landmarks.forEach((landmark, number) => {
    const marked = landmark.pixels[index];
    context.strokeStyle = context.fillStyle = MARKED;
    if (marked) cross(context, at(marked), landmark.name);
    if (number === state.marking) {
      scene.views.forEach((other, i) => {
        const pixel = landmark.pixels[i], line = i !== index && pixel ? epipolar_line(live.store.volume, live.store.pose, view, other, pixel) : null;
        if (line) line_through(context, at(line[0]), at(line[1]));
      });
    }
    const point = landmark.ct_mm && moved_point(product(view.camera_from_world, live.store.pose), landmark.ct_mm);
    if (!point || point[2] <= 0) return;
    const [x, y] = at(pixel_of(view, point));
    context.strokeStyle = PROJECTED;
    context.beginPath();
    context.arc(x, y, 5 * density, 0, 2 * Math.PI);
    context.stroke();
  });
}
