#include <hdf5.h>

#include <algorithm>
#include <cmath>

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
        if (!number || !std::isfinite(*number)) throw bad_value("parameter", word.substr(0, 40), "a finite number", where);
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

/// The only string of a data set, of fixed or variable length.
std::string hdf5_text(hid_t group, const char* name, const std::string& where) {
    const std::string what = where + ": " + name + " is missing or no text";
    const Handle data(H5Dopen2(group, name, H5P_DEFAULT), &H5Dclose, what);
    const Handle space(H5Dget_space(data.id()), &H5Sclose, what);
    const Handle type(H5Dget_type(data.id()), &H5Tclose, what);
    if (H5Tget_class(type.id()) != H5T_STRING || H5Sget_simple_extent_npoints(space.id()) != 1) throw Error(what);
    constexpr std::size_t kLongest = 256;
    if (H5Tis_variable_str(type.id()) > 0) {
        const Handle memory(H5Tcopy(H5T_C_S1), &H5Tclose, what);
        char* text = nullptr;
        if (H5Tset_size(memory.id(), H5T_VARIABLE) < 0 ||
            H5Dread(data.id(), memory.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &text) < 0 || text == nullptr) {
            throw Error(what);
        }
        const std::string copy = std::string(text).substr(0, kLongest);
        H5Dvlen_reclaim(memory.id(), space.id(), H5P_DEFAULT, &text);
        return copy;
    }
    const std::size_t size = H5Tget_size(type.id());
    if (size == 0 || size > kLongest) throw Error(what);
    std::string text(size, '\0');
    if (H5Dread(data.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) < 0) throw Error(what);
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
        stored.type = hdf5_text(group.id(), "TransformType", place);
        // ITK 4 misspelt both names.
        stored.parameters = hdf5_numbers(group.id(), {"TransformParameters", "TranformParameters"}, stored.type, place);
        stored.fixed_parameters =
            hdf5_numbers(group.id(), {"TransformFixedParameters", "TranformFixedParameters"}, stored.type, place);
        transforms.push_back(std::move(stored));
    }
    throw Error(where + " has more than 1000 transforms");
}

}  // namespace raylign::detail
