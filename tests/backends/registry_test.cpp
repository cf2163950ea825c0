#include <gtest/gtest.h>

#include "core/base/error.h"
#include "raylign/backends.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

TEST(Registry, AnUnknownNameIsRefusedListingTheValidOnes) {
    const std::string message = test::error_of([] { (void)create_backend("gpu"); });
    EXPECT_NE(message.find("backend = gpu"), std::string::npos) << message;
    for (const std::string& name : backend_names()) EXPECT_NE(message.find(name), std::string::npos) << message;
}

TEST(Registry, ReferenceIsLastAndNeverAutomatic) {
    EXPECT_EQ(backend_names().back(), "reference");
    try {
        EXPECT_NE(create_backend("auto").backend->info().name, "reference");
    } catch (const Error& error) {  // a build without cpu, on a machine without a GPU
        EXPECT_EQ(error.kind(), ErrorKind::unavailable);
    }
}

TEST(Registry, AutoPassesOverSoftwareOpenGlWithAReason) {
    for (const BackendStatus& status : backend_statuses()) {
        if (status.name != "gl" || !status.available || status.devices.empty()) continue;
        for (const DeviceStatus& device : status.devices) {
            if (device.problem.empty() && !device.software) GTEST_SKIP() << "has a GPU: " << device.name;
        }
        try {
            const BackendChoice choice = create_backend("auto");
            EXPECT_EQ(choice.backend->info().name, "cpu");
            ASSERT_EQ(choice.passed_over.front().name, "gl");
            EXPECT_NE(choice.passed_over.front().reason.find("asked for by name"), std::string::npos);
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find("asked for by name"), std::string::npos) << error.what();
        }
    }
}

TEST(Registry, EachBackendIsTheOneAskedFor) {
    for (const BackendStatus& status : backend_statuses()) {
        if (!status.available) continue;
        EXPECT_EQ(create_backend(status.name).backend->info().name, status.name);
        EXPECT_EQ(status.info.name, status.name);
    }
}

TEST(Registry, ABackendThatCannotRunSaysWhy) {
    for (const BackendStatus& status : backend_statuses())
        EXPECT_NE(status.available, !status.reason.empty()) << status.name;
}

}  // namespace
}  // namespace raylign::detail
