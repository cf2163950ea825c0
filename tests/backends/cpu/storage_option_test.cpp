// The storage that a caller of the registry asks for is the one that runs, or an error.
#include <gmock/gmock.h>

#include "core/base/error.h"
#include "cpu_scenes.h"
#include "raylign/backends.h"
#include "tests/support/errors.h"

namespace raylign::detail::test {
namespace {

TEST(StorageOption, Int16ReachesTheCpuBackend) {
    NamedScene named{"storage", random_volume({64, 32, 32}, {1, 1, 1}, 1), {view_along(rotation(0, 0, 0), {9, 9}, 2)}};
    for (const char* backend : {"cpu", "auto"}) {
        const auto bytes = [&](Storage storage) {
            const BackendChoice choice = create_backend(backend, {.cpu = {.threads = 1, .storage = storage}});
            EXPECT_EQ(choice.backend->info().name, "cpu");
            return choice.backend->prepare(named.scene(Projector::joseph))->volume_bytes();
        };
        EXPECT_LT(bytes(Storage::int16), 0.7 * bytes(Storage::float32));  // rows are padded to cache lines
    }
}

TEST(StorageOption, NamesGoBothWaysAndUnknownOnesListTheValid) {
    for (const Storage storage : {Storage::float32, Storage::int16}) {
        EXPECT_EQ(storage_from_name(storage_name(storage)), storage);
    }
    EXPECT_THAT(error_of([] { (void)storage_from_name("float16"); }),
                testing::AllOf(testing::HasSubstr("float16"), testing::HasSubstr("float32, int16")));
}

}  // namespace
}  // namespace raylign::detail::test
