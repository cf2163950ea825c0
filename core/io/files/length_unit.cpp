#include "core/io/files/length_unit.h"

#include <array>
#include <string>
#include <utility>

#include "core/io/files/text.h"

namespace raylign::detail {

std::optional<double> mm_per_unit(std::string_view unit) {
    static constexpr std::array<std::pair<std::string_view, double>, 9> kUnits = {{{"mm", 1},
                                                                                   {"cm", 10},
                                                                                   {"dm", 100},
                                                                                   {"m", 1000},
                                                                                   {"um", 1e-3},
                                                                                   {"\xc2\xb5m", 1e-3},  // micro sign
                                                                                   {"\xce\xbcm", 1e-3},  // Greek mu
                                                                                   {"nm", 1e-6},
                                                                                   {"in", 25.4}}};
    static constexpr std::array<std::pair<std::string_view, double>, 9> kWords = {{{"millimet", 1},
                                                                                   {"centimet", 10},
                                                                                   {"decimet", 100},
                                                                                   {"met", 1000},
                                                                                   {"micromet", 1e-3},
                                                                                   {"micron", 1e-3},
                                                                                   {"nanomet", 1e-6},
                                                                                   {"inch", 25.4},
                                                                                   {"inches", 25.4}}};
    const std::string word = lower_case(trimmed(unit));
    for (const auto& [name, mm] : kUnits) {
        if (word == name) return mm;
    }
    for (const auto& [name, mm] : kWords) {  // metre and meter, singular and plural
        const std::string stem(name);
        for (const char* end : {"", "s", "er", "ers", "re", "res"}) {
            if (word == stem + end) return mm;
        }
    }
    return std::nullopt;
}

}  // namespace raylign::detail
