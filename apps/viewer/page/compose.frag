#version 300 es
// One panel: the X-ray with the DRR over it. In: both as line integrals, of the DRR also the object chosen alone. Out: colours of
// the panel's pixels: the object chosen amber, the others blue.
precision highp float;
uniform sampler2D u_xray, u_drr, u_chosen;
uniform vec2 u_xray_window, u_drr_window;  // shown black, white
uniform vec2 u_image_px;                   // columns, rows
uniform vec4 u_image_from_panel;           // factors, then offsets
uniform vec2 u_panel_px;
uniform float u_bin, u_share;              // DRR pixels are u_bin image pixels wide; share of the DRR, or the curtain's place
uniform int u_mode;                        // 0 blend, 1 checkerboard, 2 curtain, 3 edges, 4 difference
uniform bool u_has_xray;
uniform vec4 u_lens;                       // middle and radius in the panel (0: none), and how much it enlarges
out vec4 colour;

float value_at(sampler2D image, vec2 p) {
    ivec2 last = textureSize(image, 0) - 1;
    vec2 base = floor(p), f = p - base;
    ivec2 low = clamp(ivec2(base), ivec2(0), last), high = clamp(ivec2(base) + 1, ivec2(0), last);
    float upper = mix(texelFetch(image, low, 0).r, texelFetch(image, ivec2(high.x, low.y), 0).r, f.x);
    float lower = mix(texelFetch(image, ivec2(low.x, high.y), 0).r, texelFetch(image, high, 0).r, f.x);
    return mix(upper, lower, f.y);
}
float through(float value, vec2 window) { return clamp((value - window.x) / (window.y - window.x), 0.0, 1.0); }
float line_at(sampler2D image, vec2 pixel) { return value_at(image, (pixel + 0.5) / u_bin - 0.5); }
float chosen_at(vec2 pixel) { return through(line_at(u_chosen, pixel), u_drr_window); }
float others_at(vec2 pixel) { return through(line_at(u_drr, pixel) - line_at(u_chosen, pixel), u_drr_window); }
float grid_at(vec2 pixel) {
    vec2 cell = fract((pixel + 0.5) / u_image_px * 10.0);
    vec2 width = abs(u_image_from_panel.xy) / u_image_px * 10.0;
    return any(lessThan(cell, width)) ? 0.25 : 0.06;
}
float edge(vec2 slope) { return smoothstep(0.025, 0.09, length(slope)); }
float chosen_edge(vec2 p) {
    vec2 e = vec2(u_bin, 0.0);
    return edge(vec2(chosen_at(p + e.xy) - chosen_at(p - e.xy), chosen_at(p + e.yx) - chosen_at(p - e.yx)));
}
float others_edge(vec2 p) {
    vec2 e = vec2(u_bin, 0.0);
    return edge(vec2(others_at(p + e.xy) - others_at(p - e.xy), others_at(p + e.yx) - others_at(p - e.yx)));
}

void main() {
    vec2 panel = vec2(gl_FragCoord.x, u_panel_px.y - gl_FragCoord.y);
    bool in_lens = distance(panel, u_lens.xy) < u_lens.z;
    float share = in_lens ? 0.0 : u_share;
    bool on_rim = u_lens.z > 0.0 && abs(distance(panel, u_lens.xy) - u_lens.z) < 1.0;
    if (in_lens) panel = u_lens.xy + (panel - u_lens.xy) / u_lens.w;
    vec2 pixel = panel * u_image_from_panel.xy + u_image_from_panel.zw;
    bool inside = all(greaterThan(pixel, vec2(-0.5))) && all(lessThan(pixel, u_image_px - 0.5));
    if (!inside) { colour = vec4(0.10, 0.11, 0.13, 1.0); return; }
    float x = u_has_xray ? through(value_at(u_xray, pixel), u_xray_window) : grid_at(pixel);
    float line = line_at(u_drr, pixel), d = through(line, u_drr_window);
    float chosen = clamp(line_at(u_chosen, pixel) / max(line, 1e-6), 0.0, 1.0);
    vec3 bone = d * mix(vec3(0.45, 0.75, 1.0), vec3(1.0, 0.74, 0.36), chosen);
    vec3 result = mix(vec3(x), bone, share);
    if (on_rim) { colour = vec4(1.0, 0.83, 0.0, 1.0); return; }
    if (in_lens) { colour = vec4(vec3(x), 1.0); return; }
    ivec2 cell = ivec2(floor(panel / 28.0));
    if (u_mode == 1) result = (cell.x + cell.y) % 2 == 0 ? vec3(x) : bone;
    if (u_mode == 2) result = panel.x < u_share * u_panel_px.x ? vec3(x) : bone;
    if (u_mode == 2 && abs(panel.x - u_share * u_panel_px.x) < 1.0) result = vec3(1.0, 0.83, 0.0);
    if (u_mode == 3) result = mix(mix(vec3(x), vec3(0.25, 0.65, 1.0), others_edge(pixel)), vec3(1.0, 0.55, 0.0), chosen_edge(pixel));
    if (u_mode == 4) result = vec3(0.5 + 0.5 * (x - d));
    colour = vec4(result, 1.0);
}
