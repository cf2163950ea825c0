#include "apps/shared/parse.h"

#include <algorithm>
#include <charconv>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/io/files/text.h"

namespace raylign::detail::apps {
namespace {

/// The numbers between commas; empty where the text is anything else.
std::vector<double> numbers_in(std::string_view text) {
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = text.data() + text.size();
    while (true) {
        double number = 0;
        const auto [next, status] = std::from_chars(at, end, number);
        if (status != std::errc{}) return {};
        numbers.push_back(number);
        if (next == end) return numbers;
        if (*next != ',') return {};
        at = next + 1;
    }
}

}  // namespace

std::vector<double> parse_numbers(std::string_view text, std::size_t count, std::string_view option) {
    std::vector<double> numbers = numbers_in(text);
    if (numbers.size() != count) {
        throw bad_value(option, text, std::to_string(count) + " numbers with commas between them");
    }
    return numbers;
}

Eigen::Vector3d parse_triple(std::string_view text, std::string_view option) {
    const std::vector<double> numbers = numbers_in(text);
    if (numbers.size() == 1) return Eigen::Vector3d::Constant(numbers[0]);
    if (numbers.size() != 3) throw bad_value(option, text, "three numbers X,Y,Z, or one for all three");
    return {numbers[0], numbers[1], numbers[2]};
}

std::uint64_t parse_seed(std::string_view text) {
    std::uint64_t seed = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), seed);
    if (status != std::errc{} || end != text.data() + text.size()) {
        throw bad_value("--seed", text, "a whole number in [0, 2^64)");
    }
    return seed;
}

std::vector<std::string> parse_list(const std::string& text, const std::string& option) {
    std::vector<std::string> words;
    for (std::string_view part : split(text, ',')) {
        part.remove_prefix(std::min(part.find_first_not_of(' '), part.size()));
        const std::string word(part.substr(0, part.find_last_not_of(' ') + 1));
        if (word.empty()) throw bad_value(option, text, "names with commas between them");
        if (std::ranges::find(words, word) != words.end()) throw bad_value(option, text, "names given once each");
        words.push_back(word);
    }
    return words;
}

std::pair<std::string, std::string> split_named(const std::string& argument, std::string_view option,
                                                std::string_view form) {
    auto both = name_and_value(argument);
    if (!both) throw bad_value(option, argument, form);
    return *std::move(both);
}

std::optional<bool> parse_truth(std::string_view text, std::string_view option) {
    if (text.empty()) return std::nullopt;
    if (text == "true" || text == "false") return text == "true";
    throw bad_value(option, text, "true or false");
}

void check_photons(double photons) {
    if (photons == 0 || (photons >= 1 && photons <= 1e9)) return;
    throw bad_value("--noise", number_text(photons), "in [1, 1e9], or 0 for none");
}

}  // namespace raylign::detail::apps
