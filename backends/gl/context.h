#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "backends/gl/api.h"
#include "backends/gl/displays.h"
#include "backends/gl/handles.h"

namespace raylign::detail::gl {

struct Limits {
    int texture_3d = 0;      ///< voxels along one axis of a 3-D texture
    int texture_2d = 0;      ///< along one side of a 2-D texture
    int texture_layers = 0;  ///< of a 2-D array
    std::size_t storage_block_bytes = 0;
    int work_groups_z = 0;         ///< of one dispatch
    std::size_t memory_bytes = 0;  ///< of the device; 0 where the driver does not tell
};

struct Device {
    std::string renderer, vendor, version;
    std::string node;
    bool software = false;
    /// Of the fractions of a voxel that its texture unit filters with; 0 = of floats. Software stands for a GPU where
    /// the environment's RAYLIGN_GL_FILTER_BITS says so, in tests.
    int filter_bits = 0;
    Limits limits;

    [[nodiscard]] bool emulates_filter() const { return software && filter_bits > 0; }
};

/// An OpenGL 4.5 core context without a window or surface. Threads take turns: see Current.
class Context {
public:
    /// Throws Error, kind unavailable, saying why where it cannot be made.
    Context(const Api& api, const Display& display);
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    [[nodiscard]] const Gl& gl() const { return api_.gl; }
    [[nodiscard]] const Device& device() const { return device_; }
    [[nodiscard]] const Display& display() const { return display_; }
    /// The device was reset: everything in this context is gone.
    [[nodiscard]] bool is_lost() const { return lost_; }

    /// Throws Error, kind unavailable, for an error that OpenGL has noted or a device that was reset while `doing`.
    void check(std::string_view doing);
    /// The same for memory: true if it sufficed, throws for other errors.
    [[nodiscard]] bool memory_sufficed(std::string_view doing);
    /// Waits until the device has done all that was submitted so far. Throws as check does.
    void wait(std::string_view doing) { wait(fence(), doing); }
    /// Of what was submitted so far, for a later wait.
    [[nodiscard]] Fence fence() { return {api_.gl, api_.gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0)}; }
    void wait(const Fence& fence, std::string_view doing);

    /// Programs by name, made once (see programs.h).
    std::map<std::string, Program>& programs() { return programs_; }
    /// Rate of casting rays, at first a guess on the slow side: how long a submission will take.
    [[nodiscard]] double samples_per_ms() const { return samples_per_ms_; }
    /// A rate that was measured. Small images reach less than the device can: the best one is forgotten slowly only.
    void observe_samples_per_ms(double measured);
    /// Of program_cache.h; empty = none.
    [[nodiscard]] const std::filesystem::path& program_folder() const { return program_folder_; }
    void keep_programs_in(std::filesystem::path folder) { program_folder_ = std::move(folder); }

private:
    friend class Current;
    void create(EGLConfig config);
    void describe();
    void throw_if_lost(std::string_view doing);

    Api api_;
    Display display_;
    EGLDisplay egl_display_ = EGL_NO_DISPLAY;
    EGLContext egl_context_ = EGL_NO_CONTEXT;
    std::recursive_mutex turn_;
    Device device_;
    bool lost_ = false;
    std::vector<std::string> messages_;  ///< of the driver, in Debug builds
    std::map<std::string, Program> programs_;
    std::filesystem::path program_folder_;
    double samples_per_ms_ = 2e4;
};

/// Makes a context current in this thread while it lives, and what was current before it afterwards. One thread at a
/// time: others wait.
class Current {
public:
    explicit Current(Context& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

private:
    Context& context_;
    std::unique_lock<std::recursive_mutex> turn_;
    EGLenum api_ = EGL_NONE;
    EGLDisplay display_ = EGL_NO_DISPLAY;
    EGLContext previous_ = EGL_NO_CONTEXT;
    EGLSurface draw_ = EGL_NO_SURFACE, read_ = EGL_NO_SURFACE;
    bool switched_ = false;
};

}  // namespace raylign::detail::gl
