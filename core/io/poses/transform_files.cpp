#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/files/text_file.h"
#include "core/io/images/quiet_itk.h"
#include "core/io/poses/itk_transform.h"

namespace raylign::detail {
namespace {

constexpr std::size_t kMostTransforms = 1000;  // of a file
constexpr std::size_t kMostParameters = 64;    // of a transform that can be rigid; fields of vectors have millions

Error too_many_parameters(const std::string& type, const std::string& where) {
    return bad_value("transform type", type,
                     "a rigid one in 3-D, with at most " + std::to_string(kMostParameters) + " parameters", where);
}

std::vector<double> finite_numbers(std::string_view text, const std::string& type, const std::string& where) {
    std::vector<double> numbers;
    while (!(text = trimmed(text)).empty()) {
        const std::string_view word = text.substr(0, text.find_first_of(" \t"));
        const std::optional<double> number = number_from(word);
        if (!number || !std::isfinite(*number))
            throw bad_value("parameter", word.substr(0, 40), "a finite number", where);
        if (numbers.size() == kMostParameters) throw too_many_parameters(type, where);
        numbers.push_back(*number);
        text.remove_prefix(word.size());
    }
    return numbers;
}

/// An object of HDF5 that is open for as long as this lives.
class Handle {
public:
    Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
        if (id < 0) throw Error(what);
    }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() { close_(id_); }
    [[nodiscard]] hid_t id() const { return id_; }

private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

constexpr std::size_t kLongestType = 256;

std::uint64_t little_endian(std::string_view bytes) {
    std::uint64_t value = 0;
    for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[i]);
    return value;
}

/// A string of variable length whose reference (length, heap, number in the heap) stands at `place` of the file. HDF5's
/// own reader of damaged heaps goes beyond its memory. Source: HDF5 File Format Specification, III.E.
std::string heap_text(const std::filesystem::path& path, std::uint64_t place, const Error& fault) {
    constexpr std::uint64_t kLargestHeap = 1 << 24, kHead = 16;
    std::ifstream file(path, std::ios::binary);
    const std::uint64_t file_bytes = std::filesystem::file_size(path);
    const auto bytes_at = [&](std::uint64_t at, std::uint64_t count) {
        std::string bytes(static_cast<std::size_t>(count), '\0');
        if (at > file_bytes || count > file_bytes - at || !file.seekg(static_cast<std::streamoff>(at)) ||
            !file.read(bytes.data(), static_cast<std::streamsize>(count))) {
            throw fault;
        }
        return bytes;
    };
    const std::string reference = bytes_at(place, kHead);
    const std::uint64_t length = little_endian(reference.substr(0, 4)), heap = little_endian(reference.substr(4, 8));
    const std::uint64_t number = little_endian(reference.substr(12));
    const std::string head = bytes_at(heap, kHead);
    const std::uint64_t heap_bytes = little_endian(head.substr(8));
    if (!head.starts_with("GCOL") || heap_bytes > kLargestHeap || number == 0 || length > kLongestType) throw fault;
    for (std::uint64_t at = kHead; at + kHead <= heap_bytes;) {
        const std::string object = bytes_at(heap + at, kHead);
        const std::uint64_t object_number = little_endian(object.substr(0, 2)), bytes = little_endian(object.substr(8));
        if (object_number == 0 || bytes > heap_bytes) break;  // 0: what is left of the heap is free
        if (object_number == number && length <= bytes) return bytes_at(heap + at + kHead, length);
        at += kHead + (bytes + 7) / 8 * 8;
    }
    throw fault;
}

/// The only string of a data set, of fixed or variable length.
std::string hdf5_text(hid_t group, const char* name, const std::filesystem::path& path, const std::string& where) {
    const std::string what = where + ": " + name + " is missing or no text";
    const Handle data(H5Dopen2(group, name, H5P_DEFAULT), &H5Dclose, what);
    const Handle space(H5Dget_space(data.id()), &H5Sclose, what);
    const Handle type(H5Dget_type(data.id()), &H5Tclose, what);
    if (H5Tget_class(type.id()) != H5T_STRING || H5Sget_simple_extent_npoints(space.id()) != 1) throw Error(what);
    std::string text;
    if (H5Tis_variable_str(type.id()) > 0) {
        text = heap_text(path, H5Dget_offset(data.id()), Error(what));
    } else {
        const std::size_t size = H5Tget_size(type.id());
        if (size == 0 || size > kLongestType) throw Error(what);
        text.assign(size, '\0');
        if (H5Dread(data.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) < 0) throw Error(what);
    }
    return text.substr(0, text.find('\0'));
}

/// The numbers of the first of `names` that is there; none where none is.
std::vector<double> hdf5_numbers(hid_t group, std::initializer_list<const char*> names, const std::string& type,
                                 const std::string& where) {
    const auto name = std::ranges::find_if(names, [&](const char* n) { return H5Lexists(group, n, H5P_DEFAULT) > 0; });
    if (name == names.end()) return {};
    const std::string what = where + ": " + *name + " is damaged";
    const Handle data(H5Dopen2(group, *name, H5P_DEFAULT), &H5Dclose, what);
    const Handle space(H5Dget_space(data.id()), &H5Sclose, what);
    const Handle stored(H5Dget_type(data.id()), &H5Tclose, what);
    const hssize_t count = H5Sget_simple_extent_npoints(space.id());
    if (count < 0 || H5Tget_class(stored.id()) != H5T_FLOAT) throw Error(what);
    if (count > static_cast<hssize_t>(kMostParameters)) throw too_many_parameters(type, where);
    std::vector<double> numbers(static_cast<std::size_t>(count));
    if (count > 0 && H5Dread(data.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) < 0) {
        throw Error(what);
    }
    for (const double number : numbers) {
        if (!std::isfinite(number)) throw bad_value("parameter", number_text(number), "a finite number", where);
    }
    return numbers;
}

}  // namespace

std::vector<StoredTransform> read_text_transforms(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    if (!text.starts_with("#Insight Transform File V1")) {
        throw Error(path.string() + " is no ITK transform: must begin with \"#Insight Transform File V1.0\"");
    }
    std::vector<StoredTransform> transforms;
    int number = 0;
    for (const std::string_view whole : split(text, '\n')) {
        ++number;
        const std::string_view line = trimmed(whole);
        if (line.empty() || line.front() == '#') continue;
        const std::string where = path.string() + ", line " + std::to_string(number);
        const std::size_t colon = line.find(':');
        const std::string_view key = line.substr(0, colon);
        const std::string_view value = colon == std::string_view::npos ? "" : trimmed(line.substr(colon + 1));
        if (key == "Transform") {
            if (transforms.size() == kMostTransforms) throw Error(where + ": more than 1000 transforms");
            transforms.push_back({std::string(value), {}, {}});
        } else if ((key == "Parameters" || key == "FixedParameters") && !transforms.empty()) {
            StoredTransform& last = transforms.back();
            (key == "Parameters" ? last.parameters : last.fixed_parameters) = finite_numbers(value, last.type, where);
        } else {
            throw bad_value("line", line.substr(0, 80), "Transform, then Parameters and FixedParameters", where);
        }
    }
    return transforms;
}

std::vector<StoredTransform> read_hdf5_transforms(const std::filesystem::path& path) {
    const std::string where = path.string();
    const QuietItk quiet;  // HDF5 prints its faults
    const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), &H5Fclose,
                      where + " is no HDF5 file, or damaged");
    const std::string group_missing = where + " is no ITK transform: it has no group TransformGroup";
    const Handle all(H5Gopen2(file.id(), "TransformGroup", H5P_DEFAULT), &H5Gclose, group_missing);
    std::vector<StoredTransform> transforms;
    for (std::size_t i = 0; i < kMostTransforms; ++i) {
        const std::string name = std::to_string(i);
        if (H5Lexists(all.id(), name.c_str(), H5P_DEFAULT) <= 0) return transforms;
        const std::string place = where + ", transform " + name;
        const Handle group(H5Gopen2(all.id(), name.c_str(), H5P_DEFAULT), &H5Gclose, place + " is damaged");
        StoredTransform stored;
        stored.type = hdf5_text(group.id(), "TransformType", path, place);
        // ITK 4 misspelt both names.
        stored.parameters = hdf5_numbers(group.id(), {"TransformParameters", "TranformParameters"}, stored.type, place);
        stored.fixed_parameters =
            hdf5_numbers(group.id(), {"TransformFixedParameters", "TranformFixedParameters"}, stored.type, place);
        transforms.push_back(std::move(stored));
    }
    throw Error(where + " has more than 1000 transforms");
}

}  // namespace raylign::detail
