#include "core/io/images/jpeg_file.h"

#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
// After <cstdio>: it uses FILE without declaring it.
#include <jerror.h>
#include <jpeglib.h>

#include <algorithm>
#include <cstdlib>

#include "core/io/files/temporary_file.h"
#include "core/io/images/image_checks.h"

namespace raylign::detail {
namespace {

/// What libjpeg knows of the file that is open. A struct of plain data: libjpeg's faults jump over what uses it.
struct JpegState {
    jpeg_decompress_struct jpeg;
    jpeg_error_mgr errors;
    std::jmp_buf fault_jump;
    char fault[JMSG_LENGTH_MAX];
    int orientation;  // of Exif; 0 = not stated
};

JpegState* state_of(j_common_ptr jpeg) { return static_cast<JpegState*>(jpeg->client_data); }

void keep_jpeg_fault_and_jump(j_common_ptr jpeg) {
    (*jpeg->err->format_message)(jpeg, state_of(jpeg)->fault);
    std::longjmp(state_of(jpeg)->fault_jump, 1);
}

/// libjpeg only warns where data are missing, and fills up with grey: that is a fault here. What lies between two
/// segments, Adobe's own markers and a newer JFIF are harmless.
void heed_jpeg_warning(j_common_ptr jpeg, int level) {
    if (level >= 0) return;
    const int code = jpeg->err->msg_code;
    if (code != JWRN_EXTRANEOUS_DATA && code != JWRN_ADOBE_XFORM && code != JWRN_JFIF_MAJOR)
        keep_jpeg_fault_and_jump(jpeg);
}

void print_nothing(j_common_ptr) {}

/// The tag Orientation in a segment "Exif": a TIFF header and its first directory. 0 where it is not there.
int exif_orientation(const unsigned char* data, std::size_t size) {
    constexpr std::size_t kHead = 6;  // "Exif", 0, 0
    if (size < kHead + 8 || std::memcmp(data, "Exif\0", kHead) != 0) return 0;
    data += kHead;
    size -= kHead;
    const bool is_big = data[0] == 'M';
    const auto number = [&](std::size_t at, std::size_t bytes) {
        std::size_t value = 0;
        for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | data[at + (is_big ? i : bytes - 1 - i)];
        return value;
    };
    const std::size_t directory = number(4, 4);
    if (directory > size || size - directory < 2) return 0;
    for (std::size_t i = 0; i < number(directory, 2); ++i) {
        const std::size_t entry = directory + 2 + 12 * i;
        if (entry + 12 > size) return 0;
        if (number(entry, 2) == 0x0112) return static_cast<int>(number(entry + 8, 2));
    }
    return 0;
}

/// The header, and how the pixels are to be handed out. No object with a destructor may live in here: see JpegState.
bool read_jpeg_header(JpegState& state, std::FILE* file) {
    if (setjmp(state.fault_jump) != 0) return false;
    jpeg_create_decompress(&state.jpeg);
    jpeg_stdio_src(&state.jpeg, file);
    jpeg_save_markers(&state.jpeg, JPEG_APP0 + 1, 0xFFFF);
    jpeg_read_header(&state.jpeg, TRUE);
    const bool has_colours = state.jpeg.jpeg_color_space == JCS_YCbCr || state.jpeg.jpeg_color_space == JCS_RGB;
    if (has_colours) state.jpeg.out_color_space = JCS_RGB;
    state.jpeg.dct_method = JDCT_ISLOW;
    for (auto* marker = state.jpeg.marker_list; marker != nullptr; marker = marker->next) {
        if (state.orientation == 0) state.orientation = exif_orientation(marker->data, marker->data_length);
    }
    jpeg_calc_output_dimensions(&state.jpeg);
    return true;
}

bool read_jpeg_rows(JpegState& state, unsigned char* out, std::size_t row_bytes) {
    if (setjmp(state.fault_jump) != 0) return false;
    jpeg_start_decompress(&state.jpeg);
    while (state.jpeg.output_scanline < state.jpeg.output_height) {
        JSAMPROW row = out + state.jpeg.output_scanline * row_bytes;
        jpeg_read_scanlines(&state.jpeg, &row, 1);
    }
    jpeg_finish_decompress(&state.jpeg);
    return true;
}

/// Opens and closes.
class JpegFile {
public:
    explicit JpegFile(const std::filesystem::path& path)
        : path_(path), file_(std::fopen(path.c_str(), "rb"), &close), state_(std::make_unique<JpegState>()) {
        if (!file_) throw Error(path.string() + " cannot be read: " + system_reason(errno));
        state_->jpeg.err = jpeg_std_error(&state_->errors);
        state_->jpeg.client_data = state_.get();
        state_->errors.error_exit = &keep_jpeg_fault_and_jump;
        state_->errors.emit_message = &heed_jpeg_warning;
        state_->errors.output_message = &print_nothing;
    }
    JpegFile(const JpegFile&) = delete;
    JpegFile& operator=(const JpegFile&) = delete;
    ~JpegFile() { jpeg_destroy_decompress(&state_->jpeg); }

    const JpegState& header() {
        if (!read_jpeg_header(*state_, file_.get())) throw fault();
        return *state_;
    }
    void read_into(std::vector<std::byte>& bytes, std::size_t row_bytes) {
        if (!read_jpeg_rows(*state_, reinterpret_cast<unsigned char*>(bytes.data()), row_bytes)) throw fault();
    }

private:
    static void close(std::FILE* file) { (void)std::fclose(file); }
    [[nodiscard]] Error fault() const {
        return Error(path_.string() + " is no whole JPEG of 8 bits: " + state_->fault);
    }

    std::filesystem::path path_;
    std::unique_ptr<std::FILE, void (*)(std::FILE*)> file_;
    std::unique_ptr<JpegState> state_;
};

/// The grey of RGB samples that differ by no more than the compression's rounding and loss; throws Error for colours.
void take_grey(Raster& raster, const std::filesystem::path& path) {
    constexpr int kMostDifference = 16;  // of 255: what quality 50 does to the chroma of a grey image and more
    const std::size_t count = raster.pixel_count();
    auto* bytes = reinterpret_cast<unsigned char*>(raster.bytes.data());
    for (std::size_t i = 0; i < count; ++i) {
        const int r = bytes[3 * i], g = bytes[3 * i + 1], b = bytes[3 * i + 2];
        if (std::max({r, g, b}) - std::min({r, g, b}) > kMostDifference) {
            const std::size_t width = static_cast<std::size_t>(raster.size[0]);
            throw bad_value("colour of pixel (" + std::to_string(i % width) + ", " + std::to_string(i / width) + ")",
                            std::to_string(r) + ", " + std::to_string(g) + ", " + std::to_string(b),
                            "grey (its red, green and blue within 16)", path.string());
        }
        // The luma that JPEG itself stores (ITU-R BT.601).
        bytes[i] = static_cast<unsigned char>((299 * r + 587 * g + 114 * b + 500) / 1000);
    }
    raster.bytes.resize(count);
    raster.components = 1;
    raster.notes.emplace_back("3 samples a pixel: taken as grey, as they agree within what the compression loses");
}

}  // namespace

Raster read_jpeg(const std::filesystem::path& path, const std::function<void(const Raster&)>& check) {
    JpegFile file(path);
    const JpegState& header = file.header();
    check_sides(header.jpeg.image_width, header.jpeg.image_height, path);
    const int samples = header.jpeg.out_color_components;
    if (samples != 1 && samples != 3) {
        throw bad_value("JPEG colours", std::to_string(samples) + " (CMYK?)", "grey, or RGB that is grey",
                        path.string());
    }
    Raster raster;
    raster.format = FileFormat::jpeg;
    raster.size = {static_cast<int>(header.jpeg.image_width), static_cast<int>(header.jpeg.image_height)};
    raster.spacing_mm = {1, 1};
    raster.origin_mm = {0, 0};
    raster.direction = Eigen::MatrixXd::Identity(2, 2);
    raster.type = PixelType::u8;
    raster.notes.emplace_back("JPEG: 8 bits and lossy. Where the detector's own file can be had, take that");
    if (const std::string note = orientation_note(header.orientation); !note.empty()) raster.notes.push_back(note);
    if (check) check(raster);
    // A block of 64 samples takes at least a bit; chroma may be halved twice.
    constexpr double kBestRatio = 8.0 * 64;
    check_claim(raster, 8, static_cast<double>(std::filesystem::file_size(path)), kBestRatio, path);
    raster.components = samples;
    const std::size_t row_bytes = static_cast<std::size_t>(raster.size[0]) * static_cast<std::size_t>(samples);
    raster.bytes.resize(row_bytes * static_cast<std::size_t>(raster.size[1]));
    file.read_into(raster.bytes, row_bytes);
    if (samples == 3) take_grey(raster, path);
    return raster;
}

}  // namespace raylign::detail
