// Structs that the host fills and shaders read. C++ includes this file, too (shared.h): one description for both. All members
// are four words wide, so that std140, std430 and C++ lay them out alike.

/// One view at one pose. Positions are taken near the volume, not at the far source, so that floats suffice.
struct FrameData {
    vec4 position_voxel;   // xyz: where the ray through the image's centre is at depth w [mm]
    vec4 direction_voxel;  // xyz: of that ray, per mm of depth; w: from that depth to the detector [mm]
    vec4 step_u_voxel;     // xyz: change of direction per pixel to the right
    vec4 step_v_voxel;     // xyz: per pixel down
    uvec4 view;            // x: index of the view; y: ceiling of its line integrals, the bits of a float
};

/// Derivative of a FrameData with respect to one pose parameter: position at the same depth, direction, steps.
struct ParameterData {
    vec4 position_voxel;
    vec4 direction_voxel;
    vec4 step_u_voxel;
    vec4 step_v_voxel;
};
struct DerivativeData {
    ParameterData parameters[6];
};

struct ViewData {
    uvec4 size_px;    // width, height, first pixel of its fixed image, blocks (of 16 x 8 pixels)
    vec4 centre_px;   // xy
};

struct SceneData {
    vec4 volume_size;  // xyz: voxels; w: step of trilinear [mm]
    vec4 spacing_mm;   // xyz
    vec4 texel;        // x: attenuation [1/mm] per texel unit, y: texel value of attenuation 0
    uvec4 counts;      // floats from image to image, blocks from sum to sum, channels, radius of the filter
};
