// The storage that a caller of the registry asks for is the one that runs, or an error.
#include <gmock/gmock.h>

#include "core/base/error.h"
#include "cpu_scenes.h"
#include "raylign/backends.h"

namespace raylign::detail::test {
namespace {

std::string message_of(std::string_view backend, const BackendOptions& options) {
    try {
        (void)create_backend(backend, options);
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

TEST(StorageOption, Int16ReachesTheCpuEngine) {
    NamedScene named{"storage", random_volume({64, 32, 32}, {1, 1, 1}, 1), {view_along(rotation(0, 0, 0), {9, 9}, 2)}};
    for (const char* backend : {"cpu", "auto"}) {
        const auto bytes = [&](const std::string& storage) {
            const BackendChoice choice = create_backend(backend, {.threads = 1, .storage = storage});
            EXPECT_EQ(choice.backend->info().name, "cpu");
            return choice.backend->prepare(named.scene(Projector::joseph))->volume_bytes();
        };
        EXPECT_LT(bytes("int16"), 0.7 * bytes("float32"));  // rows are padded to cache lines
    }
}

TEST(StorageOption, AnUnknownWordIsAnErrorThatListsTheValidOnes) {
    for (const char* backend : {"cpu", "auto"}) {
        EXPECT_THAT(message_of(backend, {.storage = "float16"}),
                    testing::AllOf(testing::HasSubstr("float16"), testing::HasSubstr("float32 or int16")));
    }
}

TEST(StorageOption, ABackendThatLacksItRefuses) {
    EXPECT_THAT(message_of("reference", {.storage = "int16"}),
                testing::AllOf(testing::HasSubstr("storage = int16"), testing::HasSubstr("reference"),
                               testing::HasSubstr("must be float32")));
}

}  // namespace
}  // namespace raylign::detail::test
