#include "backends/registry.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace raylign {
namespace {

TEST(Registry, AnUnknownNameIsRefusedListingTheValidOnes) {
    try {
        (void)create_backend("gpu");
        FAIL() << "must throw";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::input);
        const std::string message = error.what();
        EXPECT_NE(message.find("backend = gpu"), std::string::npos) << message;
        for (const std::string& name : backend_names()) EXPECT_NE(message.find(name), std::string::npos) << message;
    }
}

TEST(Registry, ReferenceIsLastAndNeverAutomatic) {
    EXPECT_EQ(backend_names().back(), "reference");
    if (backend_names().size() > 1) {
        EXPECT_NE(create_backend("auto").backend->info().name, "reference");
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
}  // namespace raylign
