// What the program wrote into the page, unpacked.
import type { mat4 } from "gl-matrix";
import { matrix_from_rows } from "./geometry";

export interface Volume {
  name: string;
  size: [number, number, number];
  spacing_mm: number[];
  origin_mm: number[];
  direction: number[][];  // rows
  per_mm: number;         // attenuation that 255 stands for
  halvings: number;
  centre_ct_mm: number[];
  radius_mm: number;
  values: Uint8Array;     // x fastest
}

export interface Pixels { width: number; height: number; values: Float32Array }

export interface View {
  name: string;
  size_px: [number, number];
  intrinsics_px: number[][];
  camera_from_world: mat4;
  sdd_mm: number | null;
  halvings: number;
  image: Pixels | null;
  weights: Float32Array | null;  // null: all ones
}

export interface Scene {
  version: string;
  volume: Volume;
  views: View[];
  start: mat4;                // world_from_ct
  command: string;            // to go on with
  folder: string;             // where it was given
  notes: string[];
}

async function unpacked(base64: string): Promise<Uint8Array> {
  const text = atob(base64);
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i += 1) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The one place where the page's JSON is taken as it is: the program wrote it.
type Json = any;

async function image_of(json: Json, [width, height]: number[]): Promise<Pixels | null> {
  if (!json) return null;
  const bytes = await unpacked(json.data);
  const values = new Float32Array(width * height);
  for (let i = 0; i < values.length; i += 1) values[i] = json.low + (json.high - json.low) * ((bytes[2 * i] + 256 * bytes[2 * i + 1]) / 65535);
  return { width, height, values };
}

async function view_of(json: Json): Promise<View> {
  const weights = json.weights ? Float32Array.from(await unpacked(json.weights), (w) => w / 255) : null;
  return { ...json, camera_from_world: matrix_from_rows(json.camera_from_world), image: await image_of(json.image, json.size_px), weights };
}

export async function read_scene(json: Json): Promise<Scene> {
  const volume: Volume = { ...json.volume, values: await unpacked(json.volume.data) };
  return { ...json, volume, views: await Promise.all(json.views.map(view_of)), start: matrix_from_rows(json.start) };
}
