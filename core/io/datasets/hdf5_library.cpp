#include "core/io/datasets/hdf5_library.h"

#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "core/base/error.h"
#include "core/io/files/text.h"

namespace raylign::detail {

/// An id of the HDF5 library, closed at the end.
class Hdf5Id {
public:
    Hdf5Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
    ~Hdf5Id() {
        if (id_ >= 0) close_(id_);
    }
    Hdf5Id(const Hdf5Id&) = delete;
    Hdf5Id& operator=(const Hdf5Id&) = delete;
    Hdf5Id(Hdf5Id&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}

    [[nodiscard]] hid_t get() const { return id_; }
    [[nodiscard]] bool ok() const { return id_ >= 0; }

private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

namespace {

/// The library prints what went wrong unless it is told not to; the errors here say it.
class QuietHdf5 {
public:
    QuietHdf5() {
        H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
        H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    }
    ~QuietHdf5() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
    QuietHdf5(const QuietHdf5&) = delete;
    QuietHdf5& operator=(const QuietHdf5&) = delete;

private:
    H5E_auto2_t print_ = nullptr;
    void* data_ = nullptr;
};

/// Whether every step of the path is there: asking for the last one alone is an error where a group is missing.
bool has_path(hid_t file, const std::string& name) {
    std::string so_far;
    for (const std::string_view part : split(name, '/')) {
        so_far += (so_far.empty() ? "" : "/") + std::string(part);
        if (part.empty() || H5Lexists(file, so_far.c_str(), H5P_DEFAULT) <= 0) return false;
        if (H5Oexists_by_name(file, so_far.c_str(), H5P_DEFAULT) <= 0) return false;  // a link to nowhere
    }
    return true;
}

/// How numbers of a type are read: in memory's byte order.
struct MemoryType {
    hid_t id;
    PixelType type;
};

MemoryType integer_memory(std::size_t bytes, bool is_signed, const std::string& place) {
    switch (bytes) {
        case 1:
            return is_signed ? MemoryType{H5T_NATIVE_INT8, PixelType::i8} : MemoryType{H5T_NATIVE_UINT8, PixelType::u8};
        case 2:
            return is_signed ? MemoryType{H5T_NATIVE_INT16, PixelType::i16}
                             : MemoryType{H5T_NATIVE_UINT16, PixelType::u16};
        case 4:
            return is_signed ? MemoryType{H5T_NATIVE_INT32, PixelType::i32}
                             : MemoryType{H5T_NATIVE_UINT32, PixelType::u32};
        case 8:
            return is_signed ? MemoryType{H5T_NATIVE_INT64, PixelType::i64}
                             : MemoryType{H5T_NATIVE_UINT64, PixelType::u64};
        default:
            break;
    }
    throw bad_value("bytes of an integer", std::to_string(bytes), "1, 2, 4 or 8", place);
}

MemoryType memory_type(hid_t type, const std::string& place) {
    const std::size_t bytes = H5Tget_size(type);
    switch (H5Tget_class(type)) {
        case H5T_INTEGER:
            return integer_memory(bytes, H5Tget_sign(type) == H5T_SGN_2, place);
        case H5T_FLOAT:
            if (bytes > 4) return {H5T_NATIVE_DOUBLE, PixelType::f64};
            return {H5T_NATIVE_FLOAT, PixelType::f32};
        case H5T_ENUM: {  // truth values, as h5py writes them
            const Hdf5Id base(H5Tget_super(type), H5Tclose);
            return integer_memory(H5Tget_size(base.get()), H5Tget_sign(base.get()) == H5T_SGN_2, place);
        }
        default:
            break;
    }
    throw Error(place + " does not hold numbers");
}

/// The bytes of a dataset whose data the file really holds: compression packs at most about 1000 to 1.
std::size_t believable_bytes(hid_t dataset, const std::vector<std::size_t>& shape, std::size_t element_bytes,
                             const std::string& place) {
    constexpr std::size_t kMostPacked = 1100;
    constexpr std::size_t kSmall = 1 << 16;  // may stand in a header, without storage of its own
    std::size_t bytes = element_bytes;
    for (const std::size_t n : shape) {
        if (n > std::numeric_limits<std::size_t>::max() / 2 / bytes) {
            throw bad_value("size", shape_words(shape), "what a file can hold", place);
        }
        bytes *= n;
    }
    const hsize_t stored = H5Dget_storage_size(dataset);
    if (bytes > kSmall && bytes / kMostPacked > stored) {
        throw bad_value("size", shape_words(shape) + ", " + std::to_string(bytes) + " bytes",
                        "what the file holds, " + std::to_string(stored) + " bytes: it was cut off or is damaged",
                        place);
    }
    return bytes;
}

}  // namespace

std::string shape_words(const std::vector<std::size_t>& shape) {
    if (shape.empty()) return "one value";
    std::string words;
    for (const std::size_t n : shape) words += (words.empty() ? "" : " x ") + std::to_string(n);
    return words;
}

struct Hdf5Library::Handles {
    Hdf5Id file;
};

Hdf5Library::Hdf5Library(const std::filesystem::path& path) : path_(path) {
    const QuietHdf5 quiet;
    if (H5Fis_hdf5(path.c_str()) <= 0) throw Error(path.string() + " is no HDF5 file");
    Hdf5Id file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (!file.ok()) throw Error(path.string() + " is a HDF5 file that cannot be opened: it is cut off or damaged");
    handles_ = std::make_unique<Handles>(Handles{std::move(file)});
}

Hdf5Library::~Hdf5Library() = default;

std::string Hdf5Library::place(const std::string& name) const { return name + " of " + path_.string(); }

bool Hdf5Library::has(const std::string& name) const {
    const QuietHdf5 quiet;
    return has_path(handles_->file.get(), name);
}

std::vector<std::string> Hdf5Library::names(const std::string& group) const {
    const QuietHdf5 quiet;
    const bool is_root = group == "/";
    if (!is_root && !has_path(handles_->file.get(), group)) throw Error(place(group) + " is missing");
    const Hdf5Id id(H5Gopen2(handles_->file.get(), group.c_str(), H5P_DEFAULT), H5Gclose);
    if (!id.ok()) throw Error(place(group) + " is no group, or is damaged");
    std::vector<std::string> names;
    const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* into) -> herr_t {
        try {
            static_cast<std::vector<std::string>*>(into)->emplace_back(name);
            return 0;
        } catch (const std::exception&) {  // may not pass through the library
            return -1;
        }
    };
    if (H5Literate(id.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names) < 0) {
        throw Error(place(group) + " is damaged: its names cannot be listed");
    }
    std::ranges::sort(names);
    return names;
}

Hdf5Array Hdf5Library::array(const std::string& name) const {
    const std::string place = this->place(name);
    const QuietHdf5 quiet;
    if (!has_path(handles_->file.get(), name)) throw Error(place + " is missing");
    const Hdf5Id dataset(H5Dopen2(handles_->file.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
    if (!dataset.ok()) throw Error(place + " is no dataset, or is damaged");
    const Hdf5Id type(H5Dget_type(dataset.get()), H5Tclose);
    const Hdf5Id space(H5Dget_space(dataset.get()), H5Sclose);
    const int dimensions = space.ok() ? H5Sget_simple_extent_ndims(space.get()) : -1;
    if (!type.ok() || dimensions < 0) throw Error(place + " is damaged: its type or size cannot be read");
    std::vector<hsize_t> extents(static_cast<std::size_t>(dimensions));
    if (dimensions > 0) H5Sget_simple_extent_dims(space.get(), extents.data(), nullptr);
    Hdf5Array array;
    array.shape.assign(extents.begin(), extents.end());
    if (std::ranges::count(array.shape, std::size_t{0}) > 0 || H5Sget_simple_extent_type(space.get()) == H5S_NULL) {
        throw bad_value("size", shape_words(array.shape), "at least one number", place);
    }
    const MemoryType memory = memory_type(type.get(), place);
    array.type = memory.type;
    array.bytes.resize(believable_bytes(dataset.get(), array.shape, bytes_of(memory.type), place));
    // A truth value is read as what it is stored as.
    const bool is_enum = H5Tget_class(type.get()) == H5T_ENUM;
    const Hdf5Id native(is_enum ? H5Tget_native_type(type.get(), H5T_DIR_ASCEND) : -1, H5Tclose);
    const hid_t wanted = is_enum ? native.get() : memory.id;
    if (H5Dread(dataset.get(), wanted, H5S_ALL, H5S_ALL, H5P_DEFAULT, array.bytes.data()) < 0) {
        throw Error(place + " cannot be read: it is cut off, damaged, or compressed in a way that is not known here");
    }
    return array;
}

std::string Hdf5Library::text(const std::string& name) const {
    const QuietHdf5 quiet;
    const hid_t file = handles_->file.get();
    if (!has_path(file, name)) throw Error(place(name) + " is missing");
    const Hdf5Id dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
    const Hdf5Id type(dataset.ok() ? H5Dget_type(dataset.get()) : -1, H5Tclose);
    const Hdf5Id space(dataset.ok() ? H5Dget_space(dataset.get()) : -1, H5Sclose);
    if (!type.ok() || !space.ok() || H5Tget_class(type.get()) != H5T_STRING ||
        H5Sget_simple_extent_npoints(space.get()) != 1) {
        throw Error(place(name) + " is no text");
    }
    if (H5Tis_variable_str(type.get()) > 0) {
        char* letters = nullptr;
        const Hdf5Id memory(H5Tcopy(type.get()), H5Tclose);
        if (H5Dread(dataset.get(), memory.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &letters) < 0) {
            throw Error(place(name) + " cannot be read");
        }
        const std::string text = letters == nullptr ? "" : letters;
        H5Dvlen_reclaim(memory.get(), space.get(), H5P_DEFAULT, &letters);
        return text;
    }
    constexpr std::size_t kLongest = 4096;  // of a name
    const std::size_t length = H5Tget_size(type.get());
    if (length > kLongest) throw bad_value("letters", std::to_string(length), "at most 4096", place(name));
    std::string text(length, '\0');
    if (H5Dread(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) < 0) {
        throw Error(place(name) + " cannot be read");
    }
    return std::string(trimmed(text.c_str()));
}

}  // namespace raylign::detail
