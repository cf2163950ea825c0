#include "core/io/geometry/opencv_file.h"

#include <cmath>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/geometry/number_text_reader.h"

namespace raylign::detail {
namespace {

constexpr double kMostRows = 64;  // of a matrix that is of use here

}  // namespace

OpencvFile::OpencvFile(const std::filesystem::path& path) : name_(path.string()) {
    constexpr std::uintmax_t kLargest = 1 << 20;
    std::string text;
    int written = 0;  // lines keep their numbers, for the parser's messages
    for (const TextLine& line : text_lines(path, KeepIndent::yes, kLargest)) {
        for (; written < line.number - 1; ++written) text += "\n";
        // OpenCV writes "%YAML:1.0", which is no YAML directive.
        text += (line.text.starts_with("%YAML") ? "" : line.text) + "\n";
        ++written;
    }
    try {
        root_ = YAML::Load(text);
    } catch (const YAML::Exception& failure) {
        throw Error(name_ + " is not valid YAML: " + failure.what());
    }
    if (!root_.IsMap()) throw Error(name_ + " is no OpenCV file: must be a map of names");
}

std::vector<std::string> OpencvFile::names() const {
    std::vector<std::string> all;
    for (const auto& entry : root_) {
        if (entry.first.IsScalar()) all.push_back(entry.first.Scalar());
    }
    return all;
}

std::string OpencvFile::first_of(std::span<const std::string_view> names) const {
    for (const std::string_view name : names) {
        if (has(std::string(name))) return std::string(name);
    }
    return {};
}

std::string OpencvFile::need(std::span<const std::string_view> names) const {
    const std::string name = first_of(names);
    if (name.empty()) throw Error(joined(names, " or ") + " is missing in " + name_ + " (OpenCV YAML)");
    return name;
}

std::string OpencvFile::text(const std::string& name) const {
    const YAML::Node node = root_[name];
    return node && node.IsScalar() ? node.Scalar() : std::string();
}

Eigen::MatrixXd OpencvFile::matrix_of_rows(const YAML::Node& rows, const std::string& name) const {
    const Error uneven(name + " in " + name_ + ": must be rows of equally many numbers, at most 64 x 64");
    const std::size_t cols = rows[0].size();
    if (cols < 1 || rows.size() > kMostRows || cols > kMostRows) throw uneven;
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(cols));
    for (std::size_t r = 0; r < rows.size(); ++r) {
        if (!rows[r].IsSequence() || rows[r].size() != cols) throw uneven;
        for (std::size_t c = 0; c < cols; ++c) {
            matrix(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = number_of(rows[r][c], name);
        }
    }
    return matrix;
}

Eigen::MatrixXd OpencvFile::matrix(const std::string& name) const {
    const YAML::Node node = root_[name];
    const bool is_list = node.IsSequence();
    if (is_list && node.size() > 0 && node[0].IsSequence()) return matrix_of_rows(node, name);
    const YAML::Node data = is_list ? node : node.IsMap() ? node["data"] : YAML::Node();
    if (!data || !data.IsSequence()) throw Error(name + " in " + name_ + ": must be an opencv-matrix");
    const double rows = is_list ? static_cast<double>(data.size()) : number_of(node["rows"], name + ".rows");
    const double cols = is_list ? 1 : number_of(node["cols"], name + ".cols");
    if (!(rows >= 1 && cols >= 1 && rows <= kMostRows && cols <= kMostRows) ||
        rows * cols != static_cast<double>(data.size())) {
        throw Error(name + " in " + name_ + ": must have rows x cols numbers in data");
    }
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
    for (std::size_t i = 0; i < data.size(); ++i) {
        const auto at = static_cast<Eigen::Index>(i);
        matrix(at / matrix.cols(), at % matrix.cols()) = number_of(data[i], name);
    }
    return matrix;
}

Eigen::MatrixXd OpencvFile::matrix(const std::string& name, Eigen::Index rows, Eigen::Index cols) const {
    const Eigen::MatrixXd m = matrix(name);
    if (m.rows() == rows && m.cols() == cols) return m;
    // Vectors lie down or stand; ROS writes matrices as plain lists.
    if (m.size() != rows * cols || (m.rows() != 1 && m.cols() != 1)) {
        throw bad_value("size of " + name, std::to_string(m.rows()) + " x " + std::to_string(m.cols()),
                        std::to_string(rows) + " x " + std::to_string(cols), name_);
    }
    Eigen::MatrixXd reshaped(rows, cols);
    for (Eigen::Index i = 0; i < m.size(); ++i) reshaped(i / cols, i % cols) = m(i / m.cols(), i % m.cols());
    return reshaped;
}

double OpencvFile::number_of(const YAML::Node& node, const std::string& what) const {
    const std::optional<double> number = node && node.IsScalar() ? number_from(node.Scalar()) : std::optional<double>();
    if (!number || !std::isfinite(*number)) throw Error(what + " in " + name_ + ": must be a finite number");
    return *number;
}

}  // namespace raylign::detail
