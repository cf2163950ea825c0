#include "core/io/images/meta_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/io/files/length_unit.h"
#include "core/io/files/text.h"
#include "core/io/images/header_text.h"

namespace raylign::detail {
namespace {

constexpr int kLargestInt = std::numeric_limits<int>::max();

struct MetaHeader {
    std::filesystem::path path;
    std::map<std::string, std::string, std::less<>> values;
    std::vector<std::string> listed;  ///< the lines after ElementDataFile = LIST
    std::uint64_t end = 0;            ///< where the voxels begin in this file

    /// The first of `keys` that the header has; "" where it has none.
    [[nodiscard]] std::string_view text(std::initializer_list<std::string_view> keys) const {
        for (const std::string_view key : keys) {
            const auto found = values.find(key);
            if (found != values.end()) return found->second;
        }
        return {};
    }
    [[nodiscard]] std::string_view needed(std::string_view key) const {
        const std::string_view value = text({key});
        if (value.empty()) throw damaged(path, FileFormat::meta, "its header has no " + std::string(key));
        return value;
    }
    /// As MetaIO reads it.
    [[nodiscard]] bool is_true(std::initializer_list<std::string_view> keys) const {
        const std::string_view value = text(keys);
        return !value.empty() && (value[0] == 'T' || value[0] == 't' || value[0] == '1');
    }
};

std::pair<std::string, std::string> key_and_value(std::string_view line) {
    const std::size_t at = line.find_first_of("=:");
    if (at == std::string_view::npos) return {};
    return {std::string(trimmed(line.substr(0, at))), std::string(trimmed(line.substr(at + 1)))};
}

MetaHeader parse_header(const std::filesystem::path& path) {
    MetaHeader header{.path = path};
    const HeaderLines head =
        read_header_lines(path, [](std::string_view line) { return key_and_value(line).first == "ElementDataFile"; });
    header.end = head.end;
    for (const std::string& line : head.lines) {
        const auto [key, value] = key_and_value(line);
        if (key.empty()) {
            if (trimmed(line).empty()) continue;
            throw damaged(path, FileFormat::meta, "a line of its header is not \"Key = value\"");
        }
        const auto [place, is_new] = header.values.emplace(key, value);
        if (!is_new && place->second != value) throw Error(path.string() + " states " + key + " twice");
    }
    if (!header.needed("ElementDataFile").starts_with("LIST")) return header;
    const HeaderLines all = read_header_lines(path, [](std::string_view) { return false; });
    for (std::size_t i = head.lines.size(); i < all.lines.size(); ++i) {
        if (const std::string_view name = trimmed(all.lines[i]); !name.empty()) header.listed.emplace_back(name);
    }
    return header;
}

PixelType meta_type(const MetaHeader& header) {
    // MetaIO stores MET_LONG in 4 bytes.
    static constexpr std::array<std::pair<std::string_view, PixelType>, 12> kTypes = {
        {{"MET_CHAR", PixelType::i8},
         {"MET_UCHAR", PixelType::u8},
         {"MET_SHORT", PixelType::i16},
         {"MET_USHORT", PixelType::u16},
         {"MET_INT", PixelType::i32},
         {"MET_UINT", PixelType::u32},
         {"MET_LONG", PixelType::i32},
         {"MET_ULONG", PixelType::u32},
         {"MET_LONG_LONG", PixelType::i64},
         {"MET_ULONG_LONG", PixelType::u64},
         {"MET_FLOAT", PixelType::f32},
         {"MET_DOUBLE", PixelType::f64}}};
    const std::string_view name = header.needed("ElementType");
    for (const auto& [known, type] : kTypes) {
        if (name == known) return type;
    }
    throw bad_value("ElementType", name,
                    "MET_ and CHAR, SHORT, INT, LONG, LONG_LONG, with U before it, FLOAT or DOUBLE",
                    header.path.string());
}

/// AnatomicalOrientation repeats what TransformMatrix says, in letters that ITK takes as "from" and others as "to".
std::string orientation_letters(const Eigen::MatrixXd& direction, std::string_view low, std::string_view high) {
    std::string letters;
    for (int axis = 0; axis < 3; ++axis) {
        int row = 0;
        direction.col(axis).head<3>().cwiseAbs().maxCoeff(&row);
        letters += (direction(row, axis) > 0 ? low : high)[static_cast<std::size_t>(row)];
    }
    return letters;
}

void check_orientation(const MetaHeader& header, Raster& raster) {
    const std::string letters(header.text({"AnatomicalOrientation"}));
    if (raster.size.size() < 3 || letters.empty() || letters.find('?') != std::string::npos) return;
    const std::string from = orientation_letters(raster.direction, "RAI", "LPS"),
                      to = orientation_letters(raster.direction, "LPS", "RAI");
    if (letters == from || letters == to) return;
    if (header.text({"TransformMatrix", "Rotation", "Orientation"}).empty()) {
        raster.no_place = "AnatomicalOrientation = " + letters + " without TransformMatrix: write TransformMatrix, " +
                          "whose rows are the axes in LPS";
        return;
    }
    raster.notes.push_back("MetaImage: AnatomicalOrientation = " + letters + " does not go with TransformMatrix (" +
                           from + "), which counts");
}

/// MetaIO knows a centre of rotation, ITK and 3D Slicer do not heed it.
void check_centre(const MetaHeader& header, Raster& raster) {
    const std::string_view text = header.text({"CenterOfRotation"});
    if (text.empty()) return;
    const std::vector<double> centre = numbers_in(text, raster.size.size(), "CenterOfRotation", header.path);
    const bool is_zero = std::ranges::all_of(centre, [](double c) { return c == 0; });
    if (is_zero || raster.direction.isIdentity()) return;  // nothing is turned about it
    raster.no_place = "CenterOfRotation = " + std::string(text) +
                      ": programs differ in what it means for turned axes; " +
                      "set it to 0 0 0 if Offset is the place of voxel (0, 0, 0)";
}

void take_unit(const MetaHeader& header, Raster& raster) {
    const std::string unit(header.text({"DistanceUnits"}));
    if (unit.empty() || unit == "?") return;
    const std::optional<double> mm = mm_per_unit(unit);
    if (!mm) {
        raster.no_place = "DistanceUnits = " + unit + ": must be mm, cm, m or um";
        return;
    }
    if (*mm == 1) return;
    for (double& spacing : raster.spacing_mm) spacing *= *mm;
    for (double& origin : raster.origin_mm) origin *= *mm;
    raster.notes.push_back("MetaImage: spacing and origin are in " + unit + ", and became millimetres");
}

void take_place(const MetaHeader& header, Raster& raster) {
    const std::size_t dimensions = raster.size.size();
    const auto numbers = [&](std::initializer_list<std::string_view> keys, std::size_t count) {
        return numbers_in(header.text(keys), count, std::string(*keys.begin()), header.path);
    };
    if (!header.text({"ElementSpacing", "ElementSize"}).empty()) {
        raster.spacing_mm = numbers({"ElementSpacing", "ElementSize"}, dimensions);
    } else {
        raster.notes.emplace_back("MetaImage: the header states no ElementSpacing: voxels of 1 mm assumed");
    }
    if (!header.text({"Offset", "Position", "Origin"}).empty()) {
        raster.origin_mm = numbers({"Offset", "Position", "Origin"}, dimensions);
    }
    if (!header.text({"TransformMatrix", "Rotation", "Orientation"}).empty()) {
        const std::vector<double> matrix =
            numbers({"TransformMatrix", "Rotation", "Orientation"}, dimensions * dimensions);
        for (std::size_t i = 0; i < matrix.size(); ++i) {  // a row is an axis
            raster.direction(static_cast<int>(i % dimensions), static_cast<int>(i / dimensions)) = matrix[i];
        }
    }
    take_unit(header, raster);
    check_centre(header, raster);
    check_orientation(header, raster);
}

void take_scaling(const MetaHeader& header, HeaderedRaster& file) {
    const auto number = [&](const char* key, double otherwise) {
        return header.text({key}).empty() ? otherwise : numbers_in(header.text({key}), 1, key, header.path).front();
    };
    file.stored.slope = number("ElementToIntensityFunctionSlope", 1);
    file.stored.intercept = number("ElementToIntensityFunctionOffset", 0);
    if (file.stored.slope == 0) {
        throw bad_value("ElementToIntensityFunctionSlope", "0", "another number", header.path.string());
    }
    if (file.stored.slope == 1 && file.stored.intercept == 0) return;
    file.raster.notes.push_back("MetaImage: values = stored * " + number_text(file.stored.slope) + " + " +
                                number_text(file.stored.intercept) + " (ElementToIntensityFunction)");
}

/// Where the voxels begin in a file of `bytes`: HeaderSize bytes are skipped, of which -1 means that voxels end the
/// file.
std::uint64_t begin_of(const MetaHeader& header, const std::filesystem::path& file, double bytes, bool is_raw) {
    const std::uint64_t head = file == header.path ? header.end : 0;
    const std::string_view text = header.text({"HeaderSize"});
    const int skip = text.empty() ? 0 : whole_number(text, -1, kLargestInt, "HeaderSize", header.path);
    std::error_code missing;
    const auto file_bytes = static_cast<double>(std::filesystem::file_size(file, missing));
    if (skip == 0 || missing) return head;
    if (!is_raw) throw Error(header.path.string() + " has HeaderSize, which is for uncompressed voxels only");
    if (skip == -1) return file_bytes > bytes ? static_cast<std::uint64_t>(file_bytes - bytes) : head;
    if (head == 0) return static_cast<std::uint64_t>(skip);
    // In one file with the header it may count from the file's beginning or from the header's end: the size tells.
    for (const double begin : {static_cast<double>(skip), static_cast<double>(head) + skip}) {
        if (begin >= static_cast<double>(head) && begin + bytes == file_bytes) return static_cast<std::uint64_t>(begin);
    }
    throw Error(
        header.path.string() + " has HeaderSize = " + std::to_string(skip) +
        " and its voxels in the same file: where they begin cannot be told; write HeaderSize = -1 if they end it");
}

/// The files that ElementDataFile names, and how many axes each holds.
std::vector<std::string> data_files(const MetaHeader& header, const std::vector<int>& size) {
    const std::string whole(header.needed("ElementDataFile"));
    const std::vector<std::string_view> words = words_in(whole);
    const auto dimensions = static_cast<int>(size.size());
    const auto number = [&](std::size_t word, int otherwise) {
        return word < words.size()
                   ? whole_number(words[word], -kLargestInt, kLargestInt, "ElementDataFile", header.path)
                   : otherwise;
    };
    if (words.front() == "LIST" && words.size() <= 2) {
        const int axes =
            words.size() == 2 ? whole_number(words[1], 1, dimensions, "LIST", header.path) : dimensions - 1;
        check_file_count(header.listed.size(), size, axes, header.path);
        return header.listed;
    }
    std::error_code missing;
    const bool is_file = std::filesystem::exists(data_file(header.path, whole), missing);
    if (is_file || whole.find('%') == std::string::npos) return {whole};
    NumberRange range{.first = number(1, 1)};
    range.last = words.size() > 2 ? number(2, 1) : range.first + size.back() - 1;
    range.step = number(3, 1);
    std::vector<std::string> files = files_of_pattern(words.front(), range, header.path);
    check_file_count(files.size(), size, dimensions - 1, header.path);
    return files;
}

void take_data(const MetaHeader& header, HeaderedRaster& file) {
    const bool is_text = !header.text({"BinaryData"}).empty() && !header.is_true({"BinaryData"});
    file.stored.encoding = is_text                              ? PixelEncoding::text
                           : header.is_true({"CompressedData"}) ? PixelEncoding::deflate
                                                                : PixelEncoding::raw;
    file.stored.is_big_endian = header.is_true({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"});
    const bool is_raw = file.stored.encoding == PixelEncoding::raw;
    const std::string word = lower_case(header.needed("ElementDataFile"));
    if (word == "local") {
        file.stored.parts = {{header.path, begin_of(header, header.path, stated_bytes(file.raster), is_raw)}};
        return;
    }
    const std::vector<std::string> names = data_files(header, file.raster.size);
    const double share = stated_bytes(file.raster) / static_cast<double>(names.size());
    for (const std::string& name : names) {
        const std::filesystem::path part = data_file(header.path, name);
        file.stored.parts.push_back({part, begin_of(header, part, share, is_raw)});
    }
}

}  // namespace

HeaderedRaster read_meta(const std::filesystem::path& path) {
    const MetaHeader header = parse_header(path);
    const int dimensions = whole_number(header.needed("NDims"), 1, 10, "NDims", path);
    std::vector<int> size;
    const std::vector<double> stated =
        numbers_in(header.needed("DimSize"), static_cast<std::size_t>(dimensions), "DimSize", path);
    for (const double n : stated) size.push_back(whole_number(number_text(n), 1, kLargestInt, "DimSize", path));
    HeaderedRaster file;
    file.raster.format = FileFormat::meta;
    file.raster.type = meta_type(header);
    const std::string_view channels = header.text({"ElementNumberOfChannels"});
    if (!channels.empty()) {
        file.raster.components = whole_number(channels, 1, 1 << 16, "ElementNumberOfChannels", path);
    }
    set_size(file.raster, size);
    take_place(header, file.raster);
    take_scaling(header, file);
    take_data(header, file);
    return file;
}

}  // namespace raylign::detail
