#include "backends/gl/context.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>

#include "backends/gl/program_cache.h"
#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

#ifdef NDEBUG
constexpr bool kDebugOutput = false;
#else
constexpr bool kDebugOutput = true;
#endif
constexpr std::size_t kMostMessages = 20;   ///< a driver may repeat itself without end
constexpr GLenum kVideoMemoryNvx = 0x9047;  ///< GPU_MEMORY_INFO_DEDICATED_VIDMEM_NVX, in KiB
constexpr GLuint64 kWaitSlice_ns = 1'000'000'000;

constexpr int kHardwareFilterBits = 8;  ///< NVIDIA's and AMD's manuals say so
constexpr double kForget = 0.75;

int emulated_filter_bits() {
    const char* const text = std::getenv("RAYLIGN_GL_FILTER_BITS");
    if (text == nullptr || *text == '\0') return 0;
    int bits = 0;
    const char* const end = text + std::strlen(text);
    const auto [rest, status] = std::from_chars(text, end, bits);
    if (status != std::errc{} || rest != end || bits < 1 || bits > 16) {
        throw bad_value("RAYLIGN_GL_FILTER_BITS", text, "1 to 16", "the environment");
    }
    return bits;
}

Error unusable(const std::string& message) { return Error(message, ErrorKind::unavailable); }

std::string hex(unsigned value) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text = "0x0000";
    for (int i = 0; i < 4; ++i) text[5 - i] = kDigits[value >> (4 * i) & 15];
    return text;
}

std::string error_name(GLenum error) {
    switch (error) {
        case GL_INVALID_ENUM:
            return "invalid enum";
        case GL_INVALID_VALUE:
            return "invalid value";
        case GL_INVALID_OPERATION:
            return "invalid operation";
        case GL_INVALID_FRAMEBUFFER_OPERATION:
            return "invalid framebuffer operation";
        case GL_OUT_OF_MEMORY:
            return "out of memory";
        default:
            return "error " + hex(error);
    }
}

std::string text_of(const GLubyte* text) { return text == nullptr ? "" : reinterpret_cast<const char*>(text); }

/// Names of renderers that run on the processor, for displays that do not say so.
bool is_software(const std::string& renderer) {
    constexpr std::array<std::string_view, 4> kNames = {"llvmpipe", "softpipe", "swrast", "SwiftShader"};
    return std::ranges::any_of(kNames, [&](std::string_view name) { return renderer.find(name) != std::string::npos; });
}

void APIENTRY keep_message(GLenum, GLenum type, GLuint, GLenum severity, GLsizei length, const GLchar* text,
                           const void* list) {
    if (type != GL_DEBUG_TYPE_ERROR && severity != GL_DEBUG_SEVERITY_HIGH) return;
    auto& messages = *static_cast<std::vector<std::string>*>(const_cast<void*>(list));
    if (messages.size() < kMostMessages) messages.emplace_back(text, length < 0 ? std::strlen(text) : length);
}

EGLConfig choose_config(const Api& api, EGLDisplay display, const std::string& name) {
    const char* extensions = api.egl.QueryString(display, EGL_EXTENSIONS);
    if (!has_extension(extensions, "EGL_KHR_surfaceless_context")) {
        throw unusable(name + ": cannot work without a window (EGL_KHR_surfaceless_context is missing)");
    }
    if (has_extension(extensions, "EGL_KHR_no_config_context")) return EGL_NO_CONFIG_KHR;
    constexpr std::array<EGLint, 3> kWanted = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLint count = 0;
    if (!api.egl.ChooseConfig(display, kWanted.data(), &config, 1, &count) || count < 1) {
        throw unusable(name + ": has no configuration for OpenGL");
    }
    return config;
}

}  // namespace

Context::Context(const Api& api, const Display& display) : api_(api), display_(display) {
    const std::string name = display_name(display);
    egl_display_ = open_display(api_, display_);
    if (egl_display_ == EGL_NO_DISPLAY) {
        throw unusable(name + ": cannot be initialised (EGL " + hex(api_.egl.GetError()) + "; is a driver installed?)");
    }
    const EGLenum api_before = api_.egl.QueryAPI();
    if (!api_.egl.BindAPI(EGL_OPENGL_API)) throw unusable(name + ": has no OpenGL, only OpenGL ES");
    create(choose_config(api_, egl_display_, name));
    const auto error = static_cast<unsigned>(api_.egl.GetError());
    api_.egl.BindAPI(api_before);
    if (egl_context_ == EGL_NO_CONTEXT) {
        throw unusable(name + ": cannot make an OpenGL 4.5 core context (EGL " + hex(error) +
                       "): the device or its driver is too old");
    }
    try {
        const Current current(*this);
        describe();
    } catch (...) {
        api_.egl.DestroyContext(egl_display_, egl_context_);
        throw;
    }
}

/// A context that tells of resets and checks accesses, where the driver has such.
void Context::create(EGLConfig config) {
    const std::vector<EGLint> version = {EGL_CONTEXT_MAJOR_VERSION,       4,
                                         EGL_CONTEXT_MINOR_VERSION,       5,
                                         EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                         EGL_CONTEXT_OPENGL_DEBUG,        kDebugOutput ? EGL_TRUE : EGL_FALSE};
    const std::vector<EGLint> robust = {EGL_CONTEXT_OPENGL_ROBUST_ACCESS, EGL_TRUE,
                                        EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET};
    for (const bool with_notification : {true, false}) {
        std::vector<EGLint> attributes = version;
        if (with_notification) attributes.insert(attributes.end(), robust.begin(), robust.end());
        attributes.push_back(EGL_NONE);
        egl_context_ = api_.egl.CreateContext(egl_display_, config, EGL_NO_CONTEXT, attributes.data());
        if (egl_context_ != EGL_NO_CONTEXT) return;
    }
}

void Context::describe() {
    const Gl& gl = api_.gl;
    device_.renderer = text_of(gl.GetString(GL_RENDERER));
    device_.vendor = text_of(gl.GetString(GL_VENDOR));
    device_.version = text_of(gl.GetString(GL_VERSION));
    device_.node = display_.node;
    device_.software = display_.software || is_software(device_.renderer);
    if (!device_.software) program_folder_ = default_program_folder();  // Mesa keeps its own
    device_.filter_bits = device_.software ? emulated_filter_bits() : kHardwareFilterBits;
    GLint major = 0, minor = 0;
    gl.GetIntegerv(GL_MAJOR_VERSION, &major);
    gl.GetIntegerv(GL_MINOR_VERSION, &minor);
    if (major * 10 + minor < 45) {
        throw unusable(device_.renderer + ": has OpenGL " + std::to_string(major) + "." + std::to_string(minor) +
                       ", 4.5 is needed");
    }
    gl.GetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &device_.limits.texture_3d);
    gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &device_.limits.texture_2d);
    gl.GetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &device_.limits.texture_layers);
    gl.GetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 2, &device_.limits.work_groups_z);
    GLint64 block = 0;
    gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block);
    device_.limits.storage_block_bytes = static_cast<std::size_t>(block);
    GLint extensions = 0;
    gl.GetIntegerv(GL_NUM_EXTENSIONS, &extensions);
    for (GLint i = 0; i < extensions; ++i) {
        if (text_of(gl.GetStringi(GL_EXTENSIONS, i)) != "GL_NVX_gpu_memory_info") continue;
        GLint kib = 0;
        gl.GetIntegerv(kVideoMemoryNvx, &kib);
        if (kib > 0) {  // Mesa 25: too many for an int
            device_.limits.memory_bytes = static_cast<std::size_t>(kib) * 1024;
        }
    }
    if (kDebugOutput) {
        gl.Enable(GL_DEBUG_OUTPUT);
        gl.Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
        gl.DebugMessageCallback(keep_message, &messages_);
    }
    check("making the context");
}

Context::~Context() {
    try {
        const Current current(*this);
        programs_.clear();
    } catch (const Error&) {  // the device is gone, and with it the programs
    }
    api_.egl.DestroyContext(egl_display_, egl_context_);
}

void Context::observe_samples_per_ms(double measured) {
    samples_per_ms_ = std::max(measured, kForget * samples_per_ms_);
}

void Context::throw_if_lost(std::string_view doing) {
    if (!lost_) lost_ = api_.gl.GetGraphicsResetStatus() != GL_NO_ERROR;
    if (!lost_) return;
    throw unusable(device_.renderer + " was reset while " + std::string(doing) +
                   ": what was on the device is lost, prepare the scene again");
}

void Context::check(std::string_view doing) {
    if (!memory_sufficed(doing)) throw unusable(device_.renderer + ": out of memory while " + std::string(doing));
}

bool Context::memory_sufficed(std::string_view doing) {
    throw_if_lost(doing);
    const GLenum error = api_.gl.GetError();
    if (error == GL_NO_ERROR) return true;
    // A lost context repeats its error for ever: take what is there, but not without end.
    for (std::size_t i = 0; i < kMostMessages && api_.gl.GetError() != GL_NO_ERROR; ++i) continue;
    std::string said;
    for (const std::string& message : messages_) said += "\n  " + message;
    messages_.clear();
    if (error == GL_OUT_OF_MEMORY) return false;
    if (error == GL_CONTEXT_LOST) {
        lost_ = true;
        throw_if_lost(doing);
    }
    throw unusable(device_.renderer + ": " + error_name(error) + " while " + std::string(doing) + said);
}

void Context::wait(const Fence& fence, std::string_view doing) {
    GLenum state = GL_TIMEOUT_EXPIRED;
    while (fence.sync() != nullptr && state == GL_TIMEOUT_EXPIRED && !lost_) {
        state = api_.gl.ClientWaitSync(fence.sync(), GL_SYNC_FLUSH_COMMANDS_BIT, kWaitSlice_ns);
        if (state == GL_TIMEOUT_EXPIRED) lost_ = api_.gl.GetGraphicsResetStatus() != GL_NO_ERROR;
    }
    check(doing);
}

Current::Current(Context& context) : context_(context), turn_(context.turn_) {
    const Api::Egl& egl = context_.api_.egl;
    api_ = egl.QueryAPI();
    egl.BindAPI(EGL_OPENGL_API);
    previous_ = egl.GetCurrentContext();
    if (previous_ == context_.egl_context_) return;
    display_ = egl.GetCurrentDisplay();
    draw_ = egl.GetCurrentSurface(EGL_DRAW);
    read_ = egl.GetCurrentSurface(EGL_READ);
    switched_ = true;
    if (egl.MakeCurrent(context_.egl_display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_.egl_context_)) return;
    const EGLint error = egl.GetError();
    egl.BindAPI(api_);
    if (error == EGL_CONTEXT_LOST) context_.lost_ = true;
    throw Error("the OpenGL context cannot be used in this thread (EGL " + hex(static_cast<unsigned>(error)) + ")",
                ErrorKind::unavailable);
}

Current::~Current() {
    const Api::Egl& egl = context_.api_.egl;
    if (switched_) {
        const EGLDisplay display = previous_ == EGL_NO_CONTEXT ? context_.egl_display_ : display_;
        egl.MakeCurrent(display, draw_, read_, previous_);
    }
    egl.BindAPI(api_);
}

}  // namespace raylign::detail::gl
