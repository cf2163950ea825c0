// What the page hands out. It writes nothing by itself and sends nothing anywhere.
import type { mat4 } from "gl-matrix";
import { rows_from_matrix } from "./geometry";

// pose.json, as `raylign register --start` reads it.
export const pose_json = (pose: mat4): string => JSON.stringify({ raylign: 1, world_from_ct: rows_from_matrix(pose) }, null, 1) + "\n";

export function download(name: string, content: BlobPart, type: string): void {
  const link = document.createElement("a"), address = URL.createObjectURL(new Blob([content], { type }));
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

// Files opened from disk may not always use the clipboard.
export async function copy_text(text: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
}
