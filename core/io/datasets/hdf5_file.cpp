#include "core/io/datasets/hdf5_file.h"

#include <algorithm>
#include <cstdint>

#include "core/base/error.h"
#include "core/io/datasets/hdf5_library.h"
#include "core/io/decode/decoder.h"
#include "core/io/decode/pack.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

enum class Hdf5Question : std::uint8_t { is_readable, has, names, array, text };

/// What the library says to one question; the other members stay empty.
struct Hdf5Answer {
    bool is_there = false;
    std::vector<std::string> names;
    std::string text;
    Hdf5Array array;
};

Hdf5Answer answer_here(const std::filesystem::path& path, Hdf5Question question, const std::string& name) {
    const Hdf5Library file(path);
    Hdf5Answer answer;
    if (question == Hdf5Question::has) answer.is_there = file.has(name);
    if (question == Hdf5Question::names) answer.names = file.names(name);
    if (question == Hdf5Question::array) answer.array = file.array(name);
    if (question == Hdf5Question::text) answer.text = file.text(name);
    return answer;
}

void answer_hdf5(const std::filesystem::path& path, const std::string& arguments, DecoderReply& reply) {
    Unpacker from(arguments);
    const auto question = from.number<Hdf5Question>();
    const Hdf5Answer answer = answer_here(path, question, from.text());
    Packer packer;
    packer.add(answer.is_there).add(answer.names).add(answer.text).add(answer.array.shape).add(answer.array.type);
    reply.message(packer.add(answer.array.bytes.size()).bytes());
    reply.bulk(answer.array.bytes);
}

/// The bytes that the shape stands for; the other process is not trusted.
void check_bytes(const Hdf5Array& array, std::size_t bytes, const std::filesystem::path& path) {
    bool is_right = array.type >= PixelType::u8 && array.type <= PixelType::f64;
    std::size_t expected = is_right ? bytes_of(array.type) : 0;
    for (const std::size_t n : array.shape) {
        is_right = is_right && n > 0 && expected <= bytes / n;
        expected *= n;
    }
    if (is_right && expected == bytes) return;
    throw Error("the reader of " + path.string() + " gives no sensible answer: damaged file?");
}

/// Asked in a process of its own, which a damaged file may end.
Hdf5Answer asked(const std::filesystem::path& path, Hdf5Question question, const std::string& name) {
    Hdf5Answer answer;
    const std::string arguments = Packer().add(question).add(name).bytes();
    const bool is_read = decode({&answer_hdf5, path, arguments, limits_for(path)}, [&](DecodedStream& stream) {
        const std::string said = stream.message();
        Unpacker from(said);
        answer = {};
        answer.is_there = from.number<bool>();
        from.take(answer.names);
        from.take(answer.text);
        from.take(answer.array.shape);
        from.take(answer.array.type);
        const auto bytes = from.number<std::size_t>();
        if (bytes > 0 || question == Hdf5Question::array) check_bytes(answer.array, bytes, path);
        answer.array.bytes.resize(bytes);
        stream.bulk(answer.array.bytes);
    });
    return is_read ? answer : answer_here(path, question, name);
}

double element_of(const Hdf5Array& array, std::size_t index) {
    Raster raster;
    raster.type = array.type;
    const std::size_t bytes = bytes_of(array.type);
    raster.bytes.assign(array.bytes.begin() + static_cast<std::ptrdiff_t>(index * bytes),
                        array.bytes.begin() + static_cast<std::ptrdiff_t>((index + 1) * bytes));
    return with_pixels(raster, [](const auto* pixel) { return static_cast<double>(*pixel); });
}

}  // namespace

Hdf5File::Hdf5File(const std::filesystem::path& path) : path_(path) {
    check_readable_file(path);
    (void)asked(path, Hdf5Question::is_readable, "");
}

std::string Hdf5File::place(const std::string& name) const { return name + " of " + path_.string(); }

bool Hdf5File::has(const std::string& name) const { return asked(path_, Hdf5Question::has, name).is_there; }

std::vector<std::string> Hdf5File::names(const std::string& group) const {
    return asked(path_, Hdf5Question::names, group).names;
}

std::string Hdf5File::text(const std::string& name) const { return asked(path_, Hdf5Question::text, name).text; }

Hdf5Array Hdf5File::array(const std::string& name, std::size_t dimensions) const {
    Hdf5Array array = asked(path_, Hdf5Question::array, name).array;
    if (array.shape.size() == dimensions) return array;
    throw bad_value("size", shape_words(array.shape), std::to_string(dimensions) + " axes", place(name));
}

Eigen::MatrixXd Hdf5File::any_matrix(const std::string& name, int rows, int columns) const {
    const Hdf5Array array = asked(path_, Hdf5Question::array, name).array;
    std::vector<std::size_t> shape, wanted;
    for (const std::size_t n : array.shape) {
        if (n != 1) shape.push_back(n);
    }
    for (const int n : {rows, columns}) {
        if (n != 1) wanted.push_back(static_cast<std::size_t>(n));
    }
    if (shape != wanted) throw bad_value("size", shape_words(array.shape), shape_words(wanted), place(name));
    Eigen::MatrixXd matrix(rows, columns);
    for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c) {
            matrix(r, c) = element_of(
                array, static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c));
        }
    }
    return matrix;
}

Eigen::MatrixXd Hdf5File::matrix(const std::string& name, int rows, int columns) const {
    Eigen::MatrixXd matrix = any_matrix(name, rows, columns);
    if (!matrix.allFinite()) throw Error(place(name) + ": must be finite numbers");
    return matrix;
}

double Hdf5File::number(const std::string& name) const { return matrix(name, 1, 1)(0, 0); }

}  // namespace raylign::detail
