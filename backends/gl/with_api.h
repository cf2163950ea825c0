#pragma once

#include <memory>

#include "backends/gl/devices.h"
#include "backends/gl/gl_backend.h"

// How the OpenGL backends are built, bottom up:
//   api              the functions of EGL and OpenGL in a table, looked up at run time: the program starts without them
//   displays         EGL devices (hardware first), else the surfaceless and the default display
//   context          a headless 4.5 core context; `Current` makes it current for a while; errors become Error
//   devices          the list that `raylign info` shows, and the choice by index or name
//   handles          OpenGL objects: move-only, labelled
//   program_cache    linked programs from run to run, in the user's cache folder
//   programs         shaders/ (put into the program by CMake), #include, errors with file and line
//   shared           structs that shaders and host share, from one file
//   frame_data       fills them from RayFrames, in double
//   volume_textures  the volume as layers across x, y, z (joseph) or as a 3-D texture (trilinear), made when asked for
//   scene_buffers    what does not change: sizes, taps, views
//   chunks           cuts batches so that no submission takes long
//   stage_clock      seconds per stage
//   pipeline         gl: cast, filter, weighted sums, totals, in compute shaders
//   descents         gl, where asked for: searches that the device runs by itself, over the same passes
//   paper_*          gl-2006: the same by slices, blending and reductions in fragment shaders
//   gl_session, gl_backend   the interface of core/backend.h
// Geometry comes from core as RayFrames in double; floats begin at positions near the volume. Sums leave in double.
// Both pipelines are a DeviceScene (device_scene), and one PipelineSession (gl_session) works with either.

namespace raylign::detail::gl {

/// As those of namespace raylign, with the functions of `api`: tests put faults there.
[[nodiscard]] std::unique_ptr<Backend> make_gl_backend(const Api& api, const GlOptions& options,
                                                       Software software = Software::allowed);
[[nodiscard]] std::unique_ptr<Backend> make_gl_2006_backend(const Api& api, const Gl2006Options& options,
                                                            Software software = Software::allowed);

}  // namespace raylign::detail::gl
