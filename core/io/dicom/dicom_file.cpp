#include "core/io/dicom/dicom_file.h"

#include <zlib.h>

#include <array>
#include <fstream>
#include <sstream>
#include <string_view>

#include "core/base/error.h"
#include "core/io/dicom/tag_numbers.h"
#include "core/io/dicom/value_representation.h"
#include "core/io/files/file_format.h"

namespace raylign::detail {
namespace {

constexpr std::uint32_t kUndefinedLength = 0xffffffff, kItem = 0xfffee000, kItemEnd = 0xfffee00d,
                        kSequenceEnd = 0xfffee0dd;
constexpr std::uint32_t kLongestKept = 1 << 18;  // bytes: a table of 65536 numbers, angles of every frame of a long run
constexpr std::size_t kMostInflated = std::size_t{1} << 32;  // bytes
constexpr int kDeepest = 32;                                 // sequences within sequences
constexpr std::string_view kImplicitSyntax = "1.2.840.10008.1.2", kBigEndianSyntax = "1.2.840.10008.1.2.2",
                           kDeflatedSyntax = "1.2.840.10008.1.2.1.99";

struct Encoding {
    bool is_explicit = true, is_big_endian = false;
};

struct Element {
    std::uint32_t tag = 0, length = 0;
    std::string vr;
};

class Walker {
public:
    explicit Walker(const std::filesystem::path& path) : size_(std::filesystem::file_size(path)) {
        file_.name = path.string();
        file_.stream = std::make_shared<std::ifstream>(path, std::ios::binary);
        seek(has_dicom_mark(path) ? 132 : 0);
    }

    DicomFile walk() {
        while (position_ + 8 <= size_ && peek_group() == 2) (void)read_element(&file_.tags, {});
        file_.syntax = file_.tags.text(tag::kTransferSyntax);
        if (file_.syntax == kDeflatedSyntax) inflate_rest();
        // The elements before are explicit little endian whatever the syntax says of the rest.
        file_.is_big_endian = file_.syntax == kBigEndianSyntax;
        // Some files say that they are implicit and are not.
        const bool may_be_implicit = file_.syntax.empty() || file_.syntax == kImplicitSyntax;
        const bool is_explicit = !may_be_implicit || begins_explicit();
        const Encoding encoding{is_explicit, file_.is_big_endian};
        while (position_ < size_ && !file_.tags.has_pixels) {
            if (read_element(&file_.tags, encoding) == kItemEnd) fail("an end mark without its beginning");
        }
        return std::move(file_);
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(file_.name + " is a damaged or truncated DICOM file: " + what + " at byte " +
                    std::to_string(position_) + " of " + std::to_string(size_));
    }

    void seek(std::uint64_t position) {
        if (position > size_) fail("an element reaches beyond the end of the file");
        position_ = position;
        file_.stream->seekg(static_cast<std::streamoff>(position));
    }

    std::string bytes(std::uint64_t count) {
        if (count > size_ - position_) fail("an element reaches beyond the end of the file");
        std::string text(count, '\0');
        if (!file_.stream->read(text.data(), static_cast<std::streamsize>(count))) fail("unreadable bytes");
        position_ += count;
        return text;
    }

    std::uint32_t integer(std::uint32_t count, bool is_big_endian) {
        const std::string raw = bytes(count);
        std::uint32_t value = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            const auto byte = static_cast<unsigned char>(raw[is_big_endian ? i : count - 1 - i]);
            value = (value << 8) | byte;
        }
        return value;
    }

    std::uint32_t peek_group() {
        const std::uint64_t before = position_;
        const std::uint32_t group = integer(2, false);
        seek(before);
        return group;
    }

    bool begins_explicit() {
        if (size_ - position_ < 8) return true;
        const std::uint64_t before = position_;
        const std::string head = bytes(6);
        seek(before);
        return is_value_representation(std::string_view(head).substr(4));
    }

    void inflate_rest() {
        std::string data = inflated(bytes(size_ - position_), file_.name);
        size_ = data.size();
        file_.stream = std::make_shared<std::istringstream>(std::move(data));
        seek(0);
    }

    Element read_header(const Encoding& encoding) {
        Element element;
        element.tag = integer(2, encoding.is_big_endian) << 16;
        element.tag |= integer(2, encoding.is_big_endian);
        const bool is_delimiter = (element.tag >> 16) == 0xfffe;
        if (!encoding.is_explicit || is_delimiter) {
            element.length = integer(4, encoding.is_big_endian);
            if (!is_delimiter) element.vr = implicit_representation(element.tag);
            return element;
        }
        element.vr = bytes(2);
        if (!is_value_representation(element.vr)) {
            fail("an element whose value representation is none of DICOM's (such as CS, DS, US)");
        }
        const bool is_long = has_long_length(element.vr);
        if (is_long) (void)bytes(2);
        element.length = integer(is_long ? 4 : 2, encoding.is_big_endian);
        return element;
    }

    /// Reads an element and keeps it in `out` if it is short, or a sequence that raylign reads. Returns its tag.
    std::uint32_t read_element(DicomTags* out, const Encoding& encoding) {
        const Element element = read_header(encoding);
        if (element.tag == kItemEnd) return kItemEnd;
        if (element.tag == tag::kPixelData && depth_ == 0) {
            take_pixels(element, encoding);
            return element.tag;
        }
        const bool is_undefined = element.length == kUndefinedLength;
        const bool is_read = out != nullptr && implicit_representation(element.tag) == "SQ" &&
                             (element.vr == "SQ" || element.vr == "UN");
        if (is_undefined || is_read) {
            // An element of unknown kind and length holds implicit items [DICOM PS3.5, 6.2.2].
            const Encoding inner = element.vr == "UN" ? Encoding{false, false} : encoding;
            const std::uint64_t end = is_undefined ? size_ : end_of(element);
            read_items(is_read ? &out->items[element.tag] : nullptr, end, is_undefined, inner);
            return element.tag;
        }
        if (out == nullptr || element.length > kLongestKept) {
            seek(position_ + element.length);
            return element.tag;
        }
        const std::string raw = bytes(element.length);
        // Programs that do not know an element write it as UN, in little endian.
        const bool is_unknown = element.vr == "UN" && !implicit_representation(element.tag).empty();
        const std::string_view vr = is_unknown ? implicit_representation(element.tag) : std::string_view(element.vr);
        out->values[element.tag] =
            element.tag == tag::kLutData ? raw : value_as_text(vr, raw, encoding.is_big_endian && !is_unknown);
        return element.tag;
    }

    std::uint64_t end_of(const Element& element) const {
        if (element.length > size_ - position_) fail("an element reaches beyond the end of the file");
        return position_ + element.length;
    }

    /// The items of a sequence up to its end or, where its length is not told, its end mark.
    void read_items(std::vector<DicomTags>* items, std::uint64_t end, bool until_mark, const Encoding& encoding) {
        if (++depth_ > kDeepest) fail("sequences nested too deeply");
        while (position_ < end) {
            const Element item = read_header(encoding);
            if (item.tag == kSequenceEnd) break;
            if (item.tag != kItem) fail("a sequence without its end mark");
            DicomTags* const out = items == nullptr ? nullptr : &items->emplace_back();
            const bool is_undefined = item.length == kUndefinedLength;
            const std::uint64_t item_end = is_undefined ? size_ : end_of(item);
            if (!is_undefined && out == nullptr) {
                seek(item_end);
                continue;
            }
            bool has_mark = false;
            while (position_ < item_end && !has_mark) has_mark = read_element(out, encoding) == kItemEnd;
            if (is_undefined && !has_mark) fail("an item without its end mark");
            if (!is_undefined && position_ != item_end) fail("an item that is longer than it says");
        }
        if (until_mark && position_ >= size_ && !ends_with_mark(encoding)) fail("a sequence without its end mark");
        if (!until_mark && position_ != end) fail("a sequence that is longer than it says");
        --depth_;
    }

    /// Whether the last 8 bytes read were the end mark of a sequence.
    bool ends_with_mark(const Encoding& encoding) {
        if (position_ < 8) return false;
        seek(position_ - 8);
        return read_header(encoding).tag == kSequenceEnd;
    }

    void take_pixels(const Element& element, const Encoding& encoding) {
        file_.tags.has_pixels = true;
        file_.is_word = element.vr == "OW" || !encoding.is_explicit;
        file_.is_encapsulated = element.length == kUndefinedLength;
        if (!file_.is_encapsulated) {
            const std::uint64_t begin = position_;
            seek(position_ + element.length);
            file_.pixel_parts.push_back({begin, element.length});
            return;
        }
        take_offsets(encoding);
        for (;;) {
            const Element item = read_header(encoding);
            if (item.tag == kSequenceEnd) return;
            if (item.tag != kItem || item.length == kUndefinedLength) fail("compressed pixels without their end mark");
            file_.pixel_parts.push_back({position_, item.length});
            seek(position_ + item.length);
        }
    }

    /// The basic offset table: the first item, empty or four bytes a frame.
    void take_offsets(const Encoding& encoding) {
        const Element table = read_header(encoding);
        if (table.tag != kItem || table.length == kUndefinedLength) fail("compressed pixels without an offset table");
        const std::uint64_t end = end_of(table);
        while (position_ + 4 <= end) file_.offsets.push_back(integer(4, encoding.is_big_endian));
        seek(end);
    }

    DicomFile file_;
    std::uint64_t size_ = 0, position_ = 0;
    int depth_ = 0;
};

}  // namespace

std::string DicomFile::bytes(const ByteRange& range) const {
    std::string data(range.length, '\0');
    stream->clear();
    stream->seekg(static_cast<std::streamoff>(range.offset));
    if (!stream->read(data.data(), static_cast<std::streamsize>(range.length))) {
        throw Error(name + " cannot be read: bytes " + std::to_string(range.offset) + " and following");
    }
    return data;
}

DicomFile open_dicom(const std::filesystem::path& path) { return Walker(path).walk(); }

std::string inflated(const std::string& deflated, const std::string& name) {
    z_stream stream{};
    constexpr int kRaw = -15;  // no header: DICOM PS3.5, A.5
    if (::inflateInit2(&stream, kRaw) != Z_OK) throw Error(name + ": zlib cannot begin");
    const auto ends = [](z_stream* s) { ::inflateEnd(s); };
    const std::unique_ptr<z_stream, decltype(ends)> guard(&stream, ends);
    std::string from = deflated, to;
    stream.next_in = reinterpret_cast<Bytef*>(from.data());
    stream.avail_in = static_cast<uInt>(from.size());
    int state = Z_OK;
    std::array<char, 1 << 16> buffer;
    while (state == Z_OK) {
        stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
        stream.avail_out = buffer.size();
        state = ::inflate(&stream, Z_NO_FLUSH);
        to.append(buffer.data(), buffer.size() - stream.avail_out);
        if (to.size() > kMostInflated) throw Error(name + ": its deflated part is longer than 4 GB");
    }
    if (state != Z_STREAM_END) {
        throw Error(name + " is a damaged or truncated DICOM file: its deflated part ends too soon or is no deflate");
    }
    return to;
}

}  // namespace raylign::detail
