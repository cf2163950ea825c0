#include "core/io/images/png_file.h"

#include <png.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>

#include "core/io/files/temporary_file.h"
#include "core/io/files/text.h"
#include "core/io/images/image_checks.h"

namespace raylign::detail {
namespace {

/// What libpng knows of the file that is open. A struct of plain data: libpng's faults jump over what uses it.
struct PngState {
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::FILE* file = nullptr;
    char fault[160] = "";
    png_uint_32 width = 0, height = 0;
    int depth = 0, colour_type = 0, stored_samples = 0, samples = 0, significant_bits = 0;
    double gamma = 0;  // 0 = not stated
};

void keep_fault_and_jump(png_structp png, png_const_charp text) {
    auto* state = static_cast<PngState*>(png_get_error_ptr(png));
    std::snprintf(state->fault, sizeof state->fault, "%s", text);
    png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

/// The header, and how its pixels are to be handed out. No object with a destructor may live in here: see PngState.
bool read_png_header(PngState& state) {
    if (setjmp(png_jmpbuf(state.png)) != 0) return false;
    png_structp png = state.png;
    png_init_io(png, state.file);
    png_read_info(png, state.info);
    png_get_IHDR(png, state.info, &state.width, &state.height, &state.depth, &state.colour_type, nullptr, nullptr,
                 nullptr);
    state.stored_samples = png_get_channels(png, state.info);
    png_color_8p significant = nullptr;
    if (png_get_sBIT(png, state.info, &significant) != 0) {
        const bool is_coloured = (state.colour_type & PNG_COLOR_MASK_COLOR) != 0;
        state.significant_bits = is_coloured ? significant->green : significant->gray;
    }
    png_get_gAMA(png, state.info, &state.gamma);
    png_set_expand(png);  // palettes to colours, fewer than 8 bits to 8, a transparent colour to alpha
    if (state.depth == 16 && std::endian::native == std::endian::little) png_set_swap(png);
    png_set_interlace_handling(png);
    png_read_update_info(png, state.info);
    state.samples = png_get_channels(png, state.info);
    return true;
}

/// The pixels, and the rest of the file: a cut one is a fault.
bool read_png_rows(PngState& state, png_bytepp rows) {
    if (setjmp(png_jmpbuf(state.png)) != 0) return false;
    png_read_image(state.png, rows);
    png_read_end(state.png, nullptr);
    return true;
}

/// Opens and closes.
class PngFile {
public:
    explicit PngFile(const std::filesystem::path& path) : path_(path), file_(std::fopen(path.c_str(), "rb"), &close) {
        if (!file_) throw Error(path.string() + " cannot be read: " + system_reason(errno));
        state_.file = file_.get();
        state_.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &state_, &keep_fault_and_jump, &ignore_warning);
        if (state_.png != nullptr) state_.info = png_create_info_struct(state_.png);
        if (state_.info == nullptr) {
            png_destroy_read_struct(&state_.png, nullptr, nullptr);
            throw Error(path.string() + ": libpng cannot be started");
        }
    }
    PngFile(const PngFile&) = delete;
    PngFile& operator=(const PngFile&) = delete;
    ~PngFile() { png_destroy_read_struct(&state_.png, &state_.info, nullptr); }

    const PngState& header() {
        if (!read_png_header(state_)) throw fault();
        return state_;
    }
    void read_into(std::vector<png_bytep>& rows) {
        if (!read_png_rows(state_, rows.data())) throw fault();
    }

private:
    static void close(std::FILE* file) { (void)std::fclose(file); }
    [[nodiscard]] Error fault() const {
        return Error(path_.string() + " is no whole PNG: " + state_.fault + " (damaged, cut off or another format)");
    }

    std::filesystem::path path_;
    std::unique_ptr<std::FILE, void (*)(std::FILE*)> file_;
    PngState state_;
};

Raster png_raster(const PngState& header) {
    Raster raster;
    raster.format = FileFormat::png;
    raster.size = {static_cast<int>(header.width), static_cast<int>(header.height)};
    raster.spacing_mm = {1, 1};
    raster.origin_mm = {0, 0};
    raster.direction = Eigen::MatrixXd::Identity(2, 2);
    raster.type = header.depth == 16 ? PixelType::u16 : PixelType::u8;
    if (header.significant_bits > 0 && header.significant_bits < header.depth) {
        raster.notes.push_back("the PNG says that " + std::to_string(header.significant_bits) + " of its " +
                               std::to_string(header.depth) + " bits are significant: pixels are taken as stored");
    }
    if (header.gamma != 0 && std::abs(header.gamma - 1) > 1e-3) {
        raster.notes.push_back("the PNG states a gamma of " + number_text(header.gamma) +
                               " for display: it is not applied, pixels are taken as stored");
    }
    return raster;
}

}  // namespace

Raster read_png(const std::filesystem::path& path, const std::function<void(const Raster&)>& check) {
    PngFile file(path);
    const PngState& header = file.header();
    check_sides(header.width, header.height, path);
    Raster raster = png_raster(header);
    if (check) check(raster);
    constexpr double kDeflateRatio = 1032;  // two bits for 258 bytes
    check_claim(raster, header.depth * header.stored_samples, static_cast<double>(std::filesystem::file_size(path)),
                kDeflateRatio, path);
    raster.components = header.samples;
    const std::size_t row_bytes = std::size_t{header.width} * bytes_of(raster.type) * header.samples;
    raster.bytes.resize(row_bytes * header.height);
    std::vector<png_bytep> rows(header.height);
    for (std::size_t y = 0; y < rows.size(); ++y) {
        rows[y] = reinterpret_cast<png_bytep>(raster.bytes.data() + y * row_bytes);
    }
    file.read_into(rows);
    reduce_to_grey(raster);
    if (check && raster.components != 1) check(raster);
    return raster;
}

}  // namespace raylign::detail
