// DRRs and panels by WebGL 2, on one canvas that is never shown: panels are copied from it.
import type { mat4 } from "gl-matrix";
import cast_source from "./cast.frag";
import vertex_source from "./cast.vert";
import compose_source from "./compose.frag";
import type { Pixels, Scene, SceneObject, View } from "./data";
import { BLOCK, free_blocks } from "./free";
import { ray_frame, window_of, type Box } from "./geometry";
import { MODES, type State, type Window } from "./state";

export interface Range { low: number; high: number }

// What a panel shows of a view. Lens: where its middle is, in CSS pixels.
export interface PanelLook { view: number; size_css: number[]; density: number; image_from_panel: number[]; xray: Range; drr: Range; lens: number[] | null }

const LENS_RADIUS = 70, LENS_ZOOM = 2;  // CSS pixels; how much larger things are in it

// What is shown over an X-ray: the sum of all objects, and the one chosen; what of the X-ray's pixels it covers.
interface Shown { lines: WebGLTexture; bin: number; covers_px: number[] }

const within = (range: Range, window: Window): [number, number] =>
  [range.low + window.low * (range.high - range.low), range.low + Math.max(window.high, window.low + 1e-3) * (range.high - range.low)];

const NOTHING = { width: 1, height: 1, values: new Float32Array(1) };
// While something moves, rays of rough pictures are sampled more rarely, too.
const ROUGH_STEPS = 2;

export class Engine {
  readonly canvas = document.createElement("canvas");
  private gl: WebGL2RenderingContext;
  private cast_program!: WebGLProgram;
  private compose_programs: (WebGLProgram | null)[] = [];  // by mode, made when asked for
  private wide: [number, number] = [0, 0];                 // what textures of one and of two numbers hold them in
  private volumes: WebGLTexture[] = [];
  private free: WebGLTexture[] = [];
  private frame!: WebGLFramebuffer;
  private xrays: WebGLTexture[] = [];
  private drrs: Shown[] = [];

  // Throws an Error that says what is missing.
  constructor(private scene: Scene, private images: (Pixels | null)[], on_lost: () => void, on_restored: (problem: string) => void) {
    const gl = this.canvas.getContext("webgl2", { antialias: false, depth: false, alpha: false });
    if (!gl) throw new Error("this browser offers no WebGL 2");
    this.gl = gl;
    this.canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); on_lost(); });
    this.canvas.addEventListener("webglcontextrestored", () => on_restored(this.problem_of_building()));
    this.build();
  }

  private problem_of_building(): string {
    try { this.build(); } catch (error) { return (error as Error).message; }
    return "";
  }

  private build(): void {
    const gl = this.gl, sides = this.scene.objects.flatMap(({ volume }) => volume.size);
    if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("WebGL 2 cannot draw numbers here (EXT_color_buffer_float is missing)");
    const largest = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number;
    if (Math.max(...sides) + 2 > largest) throw new Error(`volumes may have ${largest} voxels a side here`);
    // Where float32 cannot be filtered, float16 can: it is for looking only.
    this.wide = gl.getExtension("OES_texture_float_linear") ? [gl.R32F, gl.RG32F] : [gl.R16F, gl.RG16F];
    this.cast_program = this.program(cast_source, `#define BLOCK ${BLOCK}`);
    this.compose_programs = MODES.map(() => null);
    this.volumes = this.scene.objects.map((object) => this.volume_texture(object));
    this.free = this.scene.objects.map((object) => this.free_texture(object));
    this.frame = gl.createFramebuffer()!;
    this.xrays = [];
    this.drrs = this.scene.views.map(() => ({ lines: this.shown_texture(1, 1, gl.RG, new Float32Array(2)), bin: 1, covers_px: [1, 1] }));
    this.set_xrays(this.images);
  }

  // The X-rays of another frame.
  set_xrays(images: (Pixels | null)[]): void {
    this.images = images;
    this.xrays.forEach((texture) => this.gl.deleteTexture(texture));
    this.xrays = images.map((image) => { const { width, height, values } = image ?? NOTHING; return this.shown_texture(width, height, this.gl.RED, values); });
  }

  // `defines`: lines that follow the fragment shader's #version.
  private program(fragment: string, defines: string): WebGLProgram {
    const gl = this.gl, program = gl.createProgram()!;
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex_source], [gl.FRAGMENT_SHADER, fragment.replace("\n", `\n${defines}\n`)]] as const) {
      const shader = gl.createShader(type)!;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(shader)}`);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(`shaders do not link: ${gl.getProgramInfoLog(program)}`);
    return program;
  }

  // With a voxel of zeros around it.
  private volume_texture({ volume: { size: [nx, ny, nz], values } }: SceneObject): WebGLTexture {
    const gl = this.gl;
    const padded = new Uint8Array((nx + 2) * (ny + 2) * (nz + 2));
    for (let z = 0; z < nz; z += 1) {
      for (let y = 0; y < ny; y += 1) padded.set(values.subarray((z * ny + y) * nx, (z * ny + y + 1) * nx), ((z + 1) * (ny + 2) + y + 1) * (nx + 2) + 1);
    }
    const texture = gl.createTexture()!;
    gl.bindTexture(gl.TEXTURE_3D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8, nx + 2, ny + 2, nz + 2, 0, gl.RED, gl.UNSIGNED_BYTE, padded);
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(gl.TEXTURE_3D, side, gl.CLAMP_TO_EDGE);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_3D, filter, gl.LINEAR);
    return texture;
  }

  private free_texture({ volume }: SceneObject): WebGLTexture {
    const gl = this.gl, { size: [nx, ny, nz], blocks } = free_blocks(volume), texture = gl.createTexture()!;
    gl.bindTexture(gl.TEXTURE_3D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8UI, nx, ny, nz, 0, gl.RED_INTEGER, gl.UNSIGNED_BYTE, blocks);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_3D, filter, gl.NEAREST);
    return texture;
  }

  private texture_2d(filter: number): WebGLTexture {
    const gl = this.gl, texture = gl.createTexture()!;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const when of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, when, filter);
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    return texture;
  }
  private shown_texture(width: number, height: number, numbers: number, values: Float32Array): WebGLTexture {
    const gl = this.gl, texture = this.texture_2d(gl.LINEAR);
    gl.texImage2D(gl.TEXTURE_2D, 0, this.wide[numbers === gl.RED ? 0 : 1], width, height, 0, numbers, gl.FLOAT, values);
    return texture;
  }

  get lost(): boolean { return this.gl.isContextLost(); }

  // The DRR of an object in a view, `bin` image pixels to one of its own. Only the pixels that can meet the object are drawn.
  cast(object: number, index: number, pose: mat4, bin: number): Pixels {
    const gl = this.gl, view = this.scene.views[index];
    const [width, height] = view.size_px.map((n) => Math.max(1, Math.floor(n / bin)));
    const drr = { width, height, values: new Float32Array(width * height) };
    const window = window_of(this.scene.objects[object].volume, view, pose, bin, [width, height]);
    if (!window) return drr;
    const target = this.texture_2d(gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, width, height, 0, gl.RED, gl.FLOAT, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
    gl.viewport(0, 0, width, height);
    gl.scissor(window.x, window.y, window.width, window.height);
    gl.enable(gl.SCISSOR_TEST);
    this.use_rays(object, view, pose, bin);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
    this.read(window, drr);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteTexture(target);
    return drr;
  }

  private read({ x, y, width, height }: Box, { width: columns, values }: Pixels): void {
    const gl = this.gl, is_single = gl.getParameter(gl.IMPLEMENTATION_COLOR_READ_FORMAT) === gl.RED && gl.getParameter(gl.IMPLEMENTATION_COLOR_READ_TYPE) === gl.FLOAT;
    const step = is_single ? 1 : 4, read = new Float32Array(step * width * height);
    gl.readPixels(x, y, width, height, is_single ? gl.RED : gl.RGBA, gl.FLOAT, read);
    for (let row = 0; row < height; row += 1) {
      const from = step * row * width, to = (y + row) * columns + x;
      if (is_single) values.set(read.subarray(from, from + width), to);
      else for (let i = 0; i < width; i += 1) values[to + i] = read[from + 4 * i];
    }
  }

  // What compose() is to lay over the X-ray of a view.
  show(index: number, sum: Pixels, chosen: Pixels, bin: number): void {
    const gl = this.gl, { width, height } = sum, lines = new Float32Array(2 * width * height);
    sum.values.forEach((value, i) => { lines[2 * i] = value; lines[2 * i + 1] = chosen.values[i]; });
    gl.deleteTexture(this.drrs[index].lines);
    this.drrs[index] = { lines: this.shown_texture(width, height, gl.RG, lines), bin, covers_px: [width * bin, height * bin] };
  }
  // What a panel was drawn from: others where something has come anew.
  sources(index: number): unknown[] { return [this.xrays[index], this.drrs[index]]; }

  private use_rays(object: number, view: View, pose: mat4, bin: number): void {
    const gl = this.gl, { volume } = this.scene.objects[object], program = this.cast_program, frame = ray_frame(volume, view, pose);
    const at = (name: string) => gl.getUniformLocation(program, name);
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_3D, this.volumes[object]);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_3D, this.free[object]);
    gl.uniform1i(at("u_volume"), 0);
    gl.uniform1i(at("u_free"), 1);
    gl.uniform3fv(at("u_source_voxel"), frame.source_voxel);
    gl.uniform3fv(at("u_size_voxels"), volume.size);
    gl.uniformMatrix3fv(at("u_voxel_from_camera"), false, frame.voxel_from_camera as number[]);
    gl.uniformMatrix3fv(at("u_camera_from_pixel"), false, frame.camera_from_pixel as number[]);
    gl.uniform1f(at("u_step_mm"), (Math.min(...volume.spacing_mm) / 2) * (bin > 1 ? ROUGH_STEPS : 1));
    gl.uniform1f(at("u_depth_max_mm"), view.sdd_mm ?? 1e30);
    gl.uniform1f(at("u_per_mm"), volume.per_mm);
    gl.uniform1f(at("u_bin"), bin);
  }

  // Draws a panel into its canvas.
  compose(look: PanelLook, state: State, panel: HTMLCanvasElement): void {
    const gl = this.gl, size = look.size_css.map((n) => Math.max(1, Math.round(n * look.density)));
    if (this.canvas.width < size[0]) this.canvas.width = size[0];
    if (this.canvas.height < size[1]) this.canvas.height = size[1];
    if (panel.width !== size[0]) panel.width = size[0];
    if (panel.height !== size[1]) panel.height = size[1];
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, size[0], size[1]);
    this.use_look(look, state, size);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    panel.getContext("2d")!.drawImage(this.canvas, 0, this.canvas.height - size[1], size[0], size[1], 0, 0, size[0], size[1]);
  }

  private program_of(mode: number): WebGLProgram { return (this.compose_programs[mode] ??= this.program(compose_source, `#define MODE ${mode}`)); }

  private use_look(look: PanelLook, state: State, size: number[]): void {
    const gl = this.gl, program = this.program_of(MODES.indexOf(state.mode)), view = this.scene.views[look.view], [fx, fy, ox, oy] = look.image_from_panel;
    const at = (name: string) => gl.getUniformLocation(program, name), drr = this.drrs[look.view];
    gl.useProgram(program);
    [this.xrays[look.view], drr.lines].forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    ["u_xray", "u_drr"].forEach((name, unit) => gl.uniform1i(at(name), unit));
    gl.uniform2fv(at("u_xray_window"), within(look.xray, state.xray_windows[look.view]));
    gl.uniform2fv(at("u_drr_window"), within(look.drr, state.drr_window));
    gl.uniform2fv(at("u_image_px"), view.size_px);
    gl.uniform2fv(at("u_drr_px"), drr.covers_px);
    gl.uniform4f(at("u_image_from_panel"), fx / look.density, fy / look.density, ox, oy);
    gl.uniform2fv(at("u_panel_px"), size);
    gl.uniform1f(at("u_bin"), drr.bin);
    gl.uniform1f(at("u_share"), state.share);
    gl.uniform1i(at("u_has_xray"), this.images[look.view] ? 1 : 0);
    const [x, y] = look.lens ?? [0, 0], d = look.density;
    gl.uniform4f(at("u_lens"), d * x, d * y, look.lens ? d * LENS_RADIUS : 0, LENS_ZOOM);
  }
}
