#pragma once

#include <gtest/gtest.h>

#include <sstream>

#include "tests/apps/small_case.h"

namespace raylign::detail::test {

inline constexpr int kTimeColumns = 7;  // the last ones: all else is the same however a study was run

inline std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

/// study.csv without its times.
inline std::string results_of(const std::string& csv) {
    std::string text;
    for (std::string line : lines_of(csv)) {
        for (int i = 0; i < kTimeColumns; ++i) line.erase(line.rfind(','));
        text += line + "\n";
    }
    return text;
}

class StudyCase : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(run_raylign({"phantom", "spine", "--size", "32", "--spacing", "7", "-o", folder.path("spine.mha")})
                      .exit_code,
                  0);
    }
    [[nodiscard]] std::vector<std::string> arguments(const std::string& output,
                                                     const std::vector<std::string>& more = {}) const {
        std::vector<std::string> list{"study",
                                      "-v",
                                      folder.path("spine.mha"),
                                      "--attenuation",
                                      "--views",
                                      folder.path("geometry.json"),
                                      "--truth",
                                      folder.path("truth.json"),
                                      "--backend",
                                      "cpu",
                                      "--noise",
                                      "20000",
                                      "-o",
                                      folder.path(output)};
        list.insert(list.end(), more.begin(), more.end());
        return list;
    }
    [[nodiscard]] ProgramResult run(const std::string& output, const std::vector<std::string>& more = {}) const {
        return run_raylign(arguments(output, more));
    }
    [[nodiscard]] std::string csv(const std::string& output) const {
        return read_text(folder.path(output + "/study.csv"));
    }

    TestFolder folder;
    SmallCase scene{folder};
};

inline const std::vector<std::string> kSmall{"--bins", "0:10:20", "--per-bin", "3", "--view", "AP", "--view", "AP,LAT"};

}  // namespace raylign::detail::test
