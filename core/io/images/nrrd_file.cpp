#include "core/io/images/nrrd_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/io/files/length_unit.h"
#include "core/io/files/text.h"
#include "core/io/images/header_text.h"
#include "core/io/images/nrrd_header.h"

namespace raylign::detail {
namespace {

PixelType nrrd_type(const NrrdHeader& header) {
    struct Names {
        PixelType type;
        std::array<std::string_view, 6> names;
    };
    static constexpr std::array<Names, 10> kTypes = {
        {{PixelType::i8, {"signed char", "int8", "int8_t"}},
         {PixelType::u8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
         {PixelType::i16, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
         {PixelType::u16, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}},
         {PixelType::i32, {"int", "signed int", "int32", "int32_t"}},
         {PixelType::u32, {"uint", "unsigned int", "uint32", "uint32_t"}},
         {PixelType::i64, {"longlong", "long long", "long long int", "signed long long", "int64", "int64_t"}},
         {PixelType::u64, {"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"}},
         {PixelType::f32, {"float"}},
         {PixelType::f64, {"double"}}}};
    const std::string name = lower_case(header.needed("type"));
    for (const auto& [type, names] : kTypes) {
        if (std::ranges::find(names, name) != names.end()) return type;
    }
    throw bad_value("type", name, "an integer or float of 8 to 64 bits, such as int16", header.path.string());
}

/// A space by its name: signs that turn it to LPS, and what keeps a volume from lying in it.
struct Space {
    int dimensions = 0;  ///< 0 = the header has no space
    Eigen::Vector3d lps_sign = Eigen::Vector3d::Ones();
    std::string note, problem;
};

Space space_of(const NrrdHeader& header) {
    Space space;
    if (!header.field("spacedimension").empty()) {
        space.dimensions = whole_number(header.field("spacedimension"), 1, 8, "space dimension", header.path);
        space.note = "NRRD: its space has no name: the axes are taken as those of LPS";
        return space;
    }
    std::string name = lower_case(header.field("space"));
    if (name.empty()) return space;
    space.dimensions = 3;
    for (const std::string_view time : {"-time", "t"}) {
        if (name.ends_with(time) && (time != "t" || name.size() == 4)) {
            name.resize(name.size() - time.size());
            space.dimensions = 4;
        }
    }
    if (name == "left-posterior-superior" || name == "lps") return space;
    if (name == "right-anterior-superior" || name == "ras") {
        space.lps_sign << -1, -1, 1;
    } else if (name == "left-anterior-superior" || name == "las") {
        space.lps_sign << 1, -1, 1;
    } else if (name == "3d-right-handed") {
        space.note = "NRRD: space = 3D-right-handed does not say where the patient lies: its axes are taken as LPS";
    } else if (name == "scanner-xyz" || name == "3d-left-handed") {
        space.problem = "space = " + name + " does not say where the patient lies: write space: " +
                        "left-posterior-superior (or right-anterior-superior, left-anterior-superior) if it is that";
    } else {
        throw bad_value("space", name,
                        "left-posterior-superior, right-anterior-superior, left-anterior-superior, "
                        "3D-right-handed or scanner-xyz",
                        header.path.string());
    }
    return space;
}

/// mm per unit; 1 for none. An unknown unit keeps a volume from being placed.
double unit_mm(const std::string& unit, Raster& raster) {
    const std::string known = unit.empty() ? "mm" : unit;
    const std::optional<double> mm = mm_per_unit(known);
    if (!mm) raster.no_place = "its unit of length, \"" + unit + "\", is not known: must be mm, cm, m or um";
    const std::string note = "NRRD: spacing and origin are in " + unit + ", and became millimetres";
    if (mm && *mm != 1 && std::ranges::find(raster.notes, note) == raster.notes.end()) raster.notes.push_back(note);
    return mm.value_or(1);
}

/// By the directions of a space, of which `axes` are those that became axes of the raster.
void take_space(const NrrdHeader& header, const Space& space, const std::vector<NrrdAxis>& axes, Raster& raster) {
    std::vector<std::string> units = quoted_words(header.field("spaceunits"));
    units.resize(static_cast<std::size_t>(space.dimensions));
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(space.dimensions);
    for (int row = 0; row < std::min(3, space.dimensions); ++row) {
        std::string& unit = units[static_cast<std::size_t>(row)];
        scale[row] = space.lps_sign[row] * unit_mm(unit == "???" ? "" : unit, raster);
    }
    if (!header.field("spaceorigin").empty()) {
        const auto origin = nrrd_vector(header.field("spaceorigin"), space.dimensions, header);
        for (int row = 0; origin && row < std::min<int>(space.dimensions, static_cast<int>(axes.size())); ++row) {
            raster.origin_mm[static_cast<std::size_t>(row)] = scale[row] * (*origin)[row];
        }
    } else {
        raster.notes.emplace_back("NRRD: the header states no space origin: 0 0 0 assumed");
    }
    for (std::size_t i = 0; i < axes.size(); ++i) {
        if (!axes[i].direction) {
            if (i < 3) raster.no_place = "axis " + std::to_string(i) + " has no space direction";
            continue;
        }
        const Eigen::VectorXd along = scale.cwiseProduct(*axes[i].direction);
        const double length = along.norm();
        raster.spacing_mm[i] = length;
        for (int row = 0; length > 0 && row < std::min<int>(space.dimensions, static_cast<int>(axes.size())); ++row) {
            raster.direction(row, static_cast<int>(i)) = along[row] * (1 / length);  // as Teem's nrrdSpacingCalculate
        }
    }
}

/// By spacings and axis mins, as LPS.
void take_spacings(const std::vector<NrrdAxis>& axes, Raster& raster) {
    bool has_lows = true;
    for (std::size_t i = 0; i < axes.size(); ++i) {
        const double unit = axes[i].kind == "time" ? 1 : unit_mm(axes[i].unit, raster);
        if (axes[i].spacing) {
            raster.spacing_mm[i] = unit * *axes[i].spacing;
        } else if (i < 3) {
            raster.notes.push_back("NRRD: axis " + std::to_string(i) + " has no spacing: 1 mm assumed");
        }
        has_lows = has_lows && axes[i].low && axes[i].spacing;
    }
    for (std::size_t i = 0; has_lows && i < axes.size(); ++i) {
        const double unit = axes[i].kind == "time" ? 1 : unit_mm(axes[i].unit, raster);
        raster.origin_mm[i] = unit * (*axes[i].low + (axes[i].is_cell ? *axes[i].spacing / 2 : 0));
    }
}

/// Names of the segments of 3D Slicer's .seg.nrrd: SegmentN_Name and SegmentN_LabelValue.
LabelNames segment_names(const NrrdHeader& header) {
    LabelNames names;
    for (const auto& [key, value] : header.pairs) {
        if (!key.starts_with("Segment") || !key.ends_with("_LabelValue")) continue;
        const auto name = header.pairs.find(key.substr(0, key.rfind('_')) + "_Name");
        const std::optional<double> label = number_from(value);
        if (name == header.pairs.end() || !label || !(std::abs(*label) < 2147483648.0)) continue;
        names.emplace(static_cast<std::int32_t>(*label), trimmed(name->second));
    }
    return names;
}

/// The place after `lines` line ends.
std::uint64_t after_lines(const std::filesystem::path& file, std::uint64_t begin, int lines) {
    std::ifstream stream(file, std::ios::binary);
    stream.seekg(static_cast<std::streamoff>(begin));
    for (char c = 0; lines > 0 && stream.get(c); ++begin) lines -= c == '\n' ? 1 : 0;
    return begin;
}

PixelPart part_of(const NrrdHeader& header, const std::filesystem::path& file, double bytes, bool is_raw) {
    constexpr int kMost = std::numeric_limits<int>::max();
    const auto skip_of = [&](const char* field, int least) {
        const std::string_view text = header.field(field);
        return text.empty() ? 0 : whole_number(text, least, kMost, field, header.path);
    };
    const int lines = skip_of("lineskip", 0), skip = skip_of("byteskip", -1);
    PixelPart part{.file = file, .begin = file == header.path ? header.end : 0};
    std::error_code missing;
    if (!std::filesystem::is_regular_file(file, missing)) return part;
    part.begin = after_lines(file, part.begin, lines);
    if (skip >= 0) {
        part.skip = static_cast<std::uint64_t>(skip);
    } else if (is_raw) {
        const auto file_bytes = static_cast<double>(std::filesystem::file_size(file));
        if (file_bytes - static_cast<double>(part.begin) > bytes) {
            part.begin = static_cast<std::uint64_t>(file_bytes - bytes);
        }
    } else {
        throw Error(header.path.string() + " has byte skip = -1, which is for raw encoding only");
    }
    return part;
}

/// The files that "data file" names; `size`: of all axes.
std::vector<std::string> data_files(const NrrdHeader& header, const std::vector<int>& size) {
    constexpr int kMost = std::numeric_limits<int>::max();
    const std::string whole(header.field("datafile"));
    const std::vector<std::string_view> words = words_in(whole);
    const auto dimensions = static_cast<int>(size.size());
    const auto number = [&](std::size_t word, int otherwise, int least) {
        return word < words.size() ? whole_number(words[word], least, kMost, "data file", header.path) : otherwise;
    };
    const auto check_count = [&](const std::vector<std::string>& files, int axes) {
        const bool are_slabs =
            axes == dimensions && !files.empty() && static_cast<std::size_t>(size.back()) % files.size() == 0;
        if (!are_slabs) check_file_count(files.size(), size, axes, header.path);
    };
    if (words.front() == "LIST" && words.size() <= 2) {
        check_count(header.listed, number(1, dimensions - 1, 1));
        return header.listed;
    }
    std::error_code missing;
    const bool is_file = std::filesystem::exists(data_file(header.path, whole), missing);
    if (is_file || whole.find('%') == std::string::npos) return {whole};
    if (words.size() < 4 || words.size() > 5) {
        throw bad_value("data file", whole, "a file, LIST, or a pattern with its first and last number and step",
                        header.path.string());
    }
    const NumberRange range{.first = number(1, 0, -kMost), .last = number(2, 0, -kMost), .step = number(3, 1, -kMost)};
    std::vector<std::string> files = files_of_pattern(words.front(), range, header.path);
    check_count(files, number(4, dimensions - 1, 1));
    return files;
}

void take_data(const NrrdHeader& header, const std::vector<int>& size, HeaderedRaster& file) {
    static constexpr std::array<std::pair<std::string_view, PixelEncoding>, 7> kEncodings = {
        {{"raw", PixelEncoding::raw},
         {"gzip", PixelEncoding::deflate},
         {"gz", PixelEncoding::deflate},
         {"text", PixelEncoding::text},
         {"txt", PixelEncoding::text},
         {"ascii", PixelEncoding::text},
         {"hex", PixelEncoding::hex}}};
    const std::string name = lower_case(header.needed("encoding"));
    const auto found = std::ranges::find(kEncodings, std::string_view(name), [](const auto& e) { return e.first; });
    if (found == kEncodings.end()) {
        throw bad_value("encoding", name, "raw, gzip, text or hex (unu save -f nrrd -e gzip rewrites it)",
                        header.path.string());
    }
    file.stored.encoding = found->second;
    if (bytes_of(file.raster.type) > 1 && found->second != PixelEncoding::text) {
        const std::string endian = lower_case(header.needed("endian"));
        if (endian != "little" && endian != "big")
            throw bad_value("endian", endian, "little or big", header.path.string());
        file.stored.is_big_endian = endian == "big";
    }
    const bool is_raw = found->second == PixelEncoding::raw;
    if (header.field("datafile").empty()) {
        file.stored.parts = {part_of(header, header.path, stated_bytes(file.raster), is_raw)};
        return;
    }
    const std::vector<std::string> names = data_files(header, size);
    const double share = stated_bytes(file.raster) / static_cast<double>(names.size());
    for (const std::string& part : names) {
        file.stored.parts.push_back(part_of(header, data_file(header.path, part), share, is_raw));
    }
}

}  // namespace

HeaderedRaster read_nrrd(const std::filesystem::path& path) {
    const NrrdHeader header = read_nrrd_header(path);
    const Space space = space_of(header);
    std::vector<NrrdAxis> axes = nrrd_axes(header, space.dimensions);
    std::vector<int> all_sizes, size;
    for (const NrrdAxis& axis : axes) all_sizes.push_back(axis.size);
    HeaderedRaster file;
    Raster& raster = file.raster;
    raster.format = FileFormat::nrrd;
    raster.type = nrrd_type(header);
    if (axes.size() > 1 && axes.front().is_range()) {
        raster.components = axes.front().size;
        axes.erase(axes.begin());
    }
    std::erase_if(axes, [](const NrrdAxis& axis) { return axis.size == 1 && axis.is_range(); });
    if (axes.empty()) throw damaged(path, FileFormat::nrrd, "none of its axes lies in space");
    for (const NrrdAxis& axis : axes) size.push_back(axis.size);
    set_size(raster, size);
    raster.no_place = space.problem;
    if (!space.note.empty()) raster.notes.push_back(space.note);
    if (space.dimensions > 0 && !header.field("spacedirections").empty()) {
        take_space(header, space, axes, raster);
    } else {
        take_spacings(axes, raster);
        if (space.dimensions > 0)
            raster.no_place = "it has a space, and no space directions: these say how its axes lie";
    }
    if (!header.field("oldmin").empty() || !header.field("oldmax").empty()) {
        raster.notes.emplace_back("NRRD: old min and old max are not applied: the values are taken as stored");
    }
    raster.label_names = segment_names(header);
    take_data(header, all_sizes, file);
    return file;
}

}  // namespace raylign::detail
