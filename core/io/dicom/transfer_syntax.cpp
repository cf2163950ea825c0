#include "core/io/dicom/transfer_syntax.h"

#include <algorithm>
#include <array>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

struct KnownSyntax {
    std::string_view uid;
    PixelCodec codec;
};

constexpr std::array<KnownSyntax, 14> kRead = {{
    {"", PixelCodec::none},
    {"1.2.840.10008.1.2", PixelCodec::none},
    {"1.2.840.10008.1.2.1", PixelCodec::none},
    {"1.2.840.10008.1.2.1.99", PixelCodec::none},
    {"1.2.840.10008.1.2.2", PixelCodec::none},
    {"1.2.840.10008.1.2.4.50", PixelCodec::jpeg},
    {"1.2.840.10008.1.2.4.51", PixelCodec::jpeg},
    {"1.2.840.10008.1.2.4.57", PixelCodec::jpeg},
    {"1.2.840.10008.1.2.4.70", PixelCodec::jpeg},
    {"1.2.840.10008.1.2.4.80", PixelCodec::jpeg_ls},
    {"1.2.840.10008.1.2.4.81", PixelCodec::jpeg_ls},
    {"1.2.840.10008.1.2.4.90", PixelCodec::jpeg_2000},
    {"1.2.840.10008.1.2.4.91", PixelCodec::jpeg_2000},
    {"1.2.840.10008.1.2.5", PixelCodec::rle},
}};

const KnownSyntax* syntax_of(std::string_view uid) {
    const auto* const found = std::ranges::find(kRead, uid, &KnownSyntax::uid);
    return found == kRead.end() ? nullptr : found;
}

}  // namespace

PixelCodec pixel_codec(std::string_view syntax) {
    const KnownSyntax* const found = syntax_of(syntax);
    return found == nullptr ? PixelCodec::none : found->codec;
}

void check_transfer_syntax(const DicomFile& file) {
    if (syntax_of(file.syntax) == nullptr) {
        throw bad_value("TransferSyntaxUID (0002,0010)", file.syntax,
                        "uncompressed, deflated, RLE, JPEG, JPEG-LS or JPEG 2000 (convert the file, for instance by "
                        "gdcmconv --raw)",
                        file.name);
    }
    const bool is_compressed = pixel_codec(file.syntax) != PixelCodec::none;
    if (is_compressed == file.is_encapsulated) return;
    throw Error(file.name + " is damaged: its transfer syntax " + file.syntax + " has " +
                (is_compressed ? "compressed" : "uncompressed") + " pixels, and these are " +
                (is_compressed ? "not" : "compressed"));
}

}  // namespace raylign::detail
