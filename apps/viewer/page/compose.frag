#version 300 es
// One panel: the X-ray with the DRR over it. In: both as line integrals. Out: colours of the panel's pixels.
precision highp float;
uniform sampler2D u_xray, u_drr;
uniform vec2 u_xray_window, u_drr_window;  // shown black, white
uniform vec2 u_image_px;                   // columns, rows
uniform vec4 u_image_from_panel;           // factors, then offsets
uniform vec2 u_panel_px;
uniform float u_bin, u_share;              // DRR pixels are u_bin image pixels wide; share of the DRR, or the curtain's place
uniform int u_mode;                        // 0 blend, 1 checkerboard, 2 curtain, 3 edges, 4 difference
uniform bool u_has_xray;
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
float drr_at(vec2 pixel) { return through(value_at(u_drr, (pixel + 0.5) / u_bin - 0.5), u_drr_window); }
float grid_at(vec2 pixel) {
    vec2 cell = fract((pixel + 0.5) / u_image_px * 10.0);
    vec2 width = abs(u_image_from_panel.xy) / u_image_px * 10.0;
    return any(lessThan(cell, width)) ? 0.25 : 0.06;
}
float edge_at(vec2 pixel) {
    vec2 e = vec2(u_bin, 0.0);
    vec2 slope = vec2(drr_at(pixel + e.xy) - drr_at(pixel - e.xy), drr_at(pixel + e.yx) - drr_at(pixel - e.yx));
    return smoothstep(0.025, 0.09, length(slope));
}

void main() {
    vec2 panel = vec2(gl_FragCoord.x, u_panel_px.y - gl_FragCoord.y);
    vec2 pixel = panel * u_image_from_panel.xy + u_image_from_panel.zw;
    bool inside = all(greaterThan(pixel, vec2(-0.5))) && all(lessThan(pixel, u_image_px - 0.5));
    if (!inside) { colour = vec4(0.10, 0.11, 0.13, 1.0); return; }
    float x = u_has_xray ? through(value_at(u_xray, pixel), u_xray_window) : grid_at(pixel), d = drr_at(pixel);
    vec3 bone = d * vec3(1.0, 0.74, 0.36);
    vec3 result = mix(vec3(x), bone, u_share);
    ivec2 cell = ivec2(floor(panel / 28.0));
    if (u_mode == 1) result = (cell.x + cell.y) % 2 == 0 ? vec3(x) : bone;
    if (u_mode == 2) result = panel.x < u_share * u_panel_px.x ? vec3(x) : bone;
    if (u_mode == 2 && abs(panel.x - u_share * u_panel_px.x) < 1.0) result = vec3(1.0, 0.83, 0.0);
    if (u_mode == 3) result = mix(vec3(x), vec3(1.0, 0.55, 0.0), edge_at(pixel));
    if (u_mode == 4) result = vec3(0.5 + 0.5 * (x - d));
    colour = vec4(result, 1.0);
}
