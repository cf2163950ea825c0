#version 300 es
// One panel: the X-ray with the DRR over it. In: both as line integrals, of the DRR also the object chosen alone. Out: colours of
// the panel's pixels: the object chosen amber, the others blue. MODE: 0 blend, 1 checkerboard, 2 curtain, 3 edges, 4 difference.
precision highp float;
uniform sampler2D u_xray, u_drr;           // DRR: of all objects, of the one chosen
uniform vec2 u_xray_window, u_drr_window;  // shown black, white
uniform vec2 u_image_px, u_drr_px;         // columns, rows; what the DRR covers
uniform vec4 u_image_from_panel;           // factors, then offsets
uniform vec2 u_panel_px;
uniform float u_bin, u_share;              // DRR pixels are u_bin image pixels wide; share of the DRR, or the curtain's place
uniform bool u_has_xray;
uniform vec4 u_lens;                       // middle and radius in the panel (0: none), and how much it enlarges
out vec4 colour;

const vec3 OUTSIDE = vec3(0.10, 0.11, 0.13), LINE = vec3(1.0, 0.83, 0.0);

vec2 through(vec2 value, vec2 window) { return clamp((value - window.x) / (window.y - window.x), 0.0, 1.0); }
vec2 lines_at(vec2 pixel) { return textureLod(u_drr, (pixel + 0.5) / u_drr_px, 0.0).rg; }
float xray_at(vec2 pixel) {
    if (u_has_xray) return through(textureLod(u_xray, (pixel + 0.5) / u_image_px, 0.0).rr, u_xray_window).x;
    vec2 cell = fract((pixel + 0.5) / u_image_px * 10.0), width = abs(u_image_from_panel.xy) / u_image_px * 10.0;
    return any(lessThan(cell, width)) ? 0.25 : 0.06;
}
// Of what lies over the X-ray: the colour of both, each by its share.
vec3 bone_at(vec2 pixel) {
    vec2 lines = lines_at(pixel);
    float chosen = clamp(lines.y / max(lines.x, 1e-6), 0.0, 1.0);
    return through(lines, u_drr_window).x * mix(vec3(0.45, 0.75, 1.0), vec3(1.0, 0.74, 0.36), chosen);
}
// The object chosen, the others; as shown, between 0 and 1.
vec2 parts_at(vec2 pixel) {
    vec2 lines = lines_at(pixel);
    return through(vec2(lines.y, lines.x - lines.y), u_drr_window);
}
vec3 with_edges(vec2 p, float x) {
    vec2 e = vec2(u_bin, 0.0), across = parts_at(p + e.xy) - parts_at(p - e.xy), down = parts_at(p + e.yx) - parts_at(p - e.yx);
    vec2 edges = smoothstep(0.025, 0.09, sqrt(across * across + down * down));
    return mix(mix(vec3(x), vec3(0.25, 0.65, 1.0), edges.y), vec3(1.0, 0.55, 0.0), edges.x);
}

void main() {
    vec2 panel = vec2(gl_FragCoord.x, u_panel_px.y - gl_FragCoord.y);
    float from_lens = distance(panel, u_lens.xy);
    bool in_lens = from_lens < u_lens.z;
    if (u_lens.z > 0.0 && abs(from_lens - u_lens.z) < 1.0) { colour = vec4(LINE, 1.0); return; }
    if (in_lens) panel = u_lens.xy + (panel - u_lens.xy) / u_lens.w;
    vec2 pixel = panel * u_image_from_panel.xy + u_image_from_panel.zw;
    bool inside = all(greaterThan(pixel, vec2(-0.5))) && all(lessThan(pixel, u_image_px - 0.5));
    if (!inside) { colour = vec4(OUTSIDE, 1.0); return; }
    float x = xray_at(pixel);
    if (in_lens) { colour = vec4(vec3(x), 1.0); return; }
#if MODE == 0
    vec3 result = mix(vec3(x), bone_at(pixel), u_share);
#elif MODE == 1
    ivec2 cell = ivec2(floor(panel / 28.0));
    vec3 result = (cell.x + cell.y) % 2 == 0 ? vec3(x) : bone_at(pixel);
#elif MODE == 2
    float from_curtain = panel.x - u_share * u_panel_px.x;
    vec3 result = abs(from_curtain) < 1.0 ? LINE : from_curtain < 0.0 ? vec3(x) : bone_at(pixel);
#elif MODE == 3
    vec3 result = with_edges(pixel, x);
#else
    vec3 result = vec3(0.5 + 0.5 * (x - through(lines_at(pixel), u_drr_window).x));
#endif
    colour = vec4(result, 1.0);
}
