#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace raylign::detail {

/// The fields of an NRRD header in words, and where its file goes on. Names of fields are lower case, without blanks.
struct NrrdHeader {
    std::filesystem::path path;
    std::map<std::string, std::string, std::less<>> fields, pairs;  ///< "name: text", "key:=text"
    std::vector<std::string> listed;                                ///< lines after "data file: LIST"
    std::uint64_t end = 0;                                          ///< of the header in this file

    /// "" where there is none.
    [[nodiscard]] std::string_view field(std::string_view name) const;
    [[nodiscard]] std::string_view needed(std::string_view name) const;
};

[[nodiscard]] NrrdHeader read_nrrd_header(const std::filesystem::path& path);

/// An axis of the file as the header has it.
struct NrrdAxis {
    int size = 0;
    std::string kind;                          ///< lower case; "" = not said
    bool is_cell = true;                       ///< its samples are cells' centres
    std::optional<double> spacing, low;        ///< "spacings", "axis mins"
    std::string unit;                          ///< of these two
    std::optional<Eigen::VectorXd> direction;  ///< "space directions"

    /// Vectors, colours and lists have no place in space.
    [[nodiscard]] bool is_range() const;
};

/// All axes, as many as "dimension" says. `space_dimensions`: numbers of a direction, 0 = the header has no space.
[[nodiscard]] std::vector<NrrdAxis> nrrd_axes(const NrrdHeader& header, int space_dimensions);

/// The words of a list, where a text in quotes is one word.
[[nodiscard]] std::vector<std::string> quoted_words(std::string_view text);

/// "(1,0,0)" as numbers; empty for "none".
[[nodiscard]] std::optional<Eigen::VectorXd> nrrd_vector(std::string_view text, int numbers, const NrrdHeader& header);

}  // namespace raylign::detail
