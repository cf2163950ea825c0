#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "raylign/error.h"

namespace raylign::detail::test {

/// The message of the Error that `action` throws; "" (and a failure) if it throws none or one of another kind. What is
/// printed meanwhile is a failure: the library and what it uses are silent.
inline std::string error_of(const std::function<void()>& action, ErrorKind kind = ErrorKind::input) {
    std::string message;
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    try {
        action();
    } catch (const Error& error) {
        message = error.what();
        EXPECT_EQ(error.kind(), kind) << message;
    }
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_NE(message, "") << "no Error was thrown";
    return message;
}

}  // namespace raylign::detail::test
