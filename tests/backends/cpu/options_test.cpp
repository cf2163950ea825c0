#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>

#include "core/base/error.h"
#include "cpu_scenes.h"
#include "tests/support/errors.h"

namespace raylign::detail::test {
namespace {

std::string refusal_of(const CpuOptions& options) {
    return error_of([&] { (void)make_cpu_backend(options); });
}

/// Sets RAYLIGN_INSTRUCTION_SET for the length of a test.
class Environment {
public:
    explicit Environment(const std::string& value) { setenv("RAYLIGN_INSTRUCTION_SET", value.c_str(), 1); }
    ~Environment() { unsetenv("RAYLIGN_INSTRUCTION_SET"); }
};

TEST(CpuOptions, EveryAvailableInstructionSetRunsWhenAskedFor) {
    for (const InstructionSetStatus& set : cpu_instruction_sets()) {
        if (set.available) {
            EXPECT_EQ(make_cpu_backend({.threads = 1, .instruction_set = set.set})->info().instruction_set,
                      instruction_set_name(set.set));
        } else {
            (void)error_of([&] { (void)make_cpu_backend({.threads = 1, .instruction_set = set.set}); },
                           ErrorKind::unavailable);
        }
    }
}

TEST(CpuOptions, TheBestAvailableInstructionSetIsTheDefault) {
    unsetenv("RAYLIGN_INSTRUCTION_SET");
    EXPECT_EQ(make_cpu_backend({})->info().instruction_set, available_sets().front());
}

TEST(CpuOptions, TheEnvironmentChoosesUnlessTheOptionDoes) {
    const std::string last = available_sets().back(), first = available_sets().front();
    const Environment environment(last);
    EXPECT_EQ(make_cpu_backend({})->info().instruction_set, last);
    EXPECT_EQ(make_cpu_backend({.instruction_set = instruction_set_from_name(first)})->info().instruction_set, first);
}

TEST(CpuOptions, AnUnknownInstructionSetIsAnErrorThatListsTheValidOnes) {
    const Environment environment("mmx");
    for (const InstructionSetStatus& set : cpu_instruction_sets()) {
        EXPECT_THAT(refusal_of({}), testing::HasSubstr(std::string(instruction_set_name(set.set))));
    }
    EXPECT_THAT(refusal_of({}),
                testing::AllOf(testing::HasSubstr("mmx"), testing::HasSubstr("RAYLIGN_INSTRUCTION_SET")));
}

TEST(CpuOptions, ThreadsMustBeInRange) {
    EXPECT_THAT(refusal_of({.threads = -1}), testing::HasSubstr("[1, 1024]"));
    EXPECT_THAT(refusal_of({.threads = 0}), testing::HasSubstr("[1, 1024]"));
    EXPECT_THAT(refusal_of({.threads = 1025}), testing::HasSubstr("1025"));
    EXPECT_EQ(make_cpu_backend({.threads = 7})->info().threads, 7);
    EXPECT_GE(make_cpu_backend({})->info().threads, 1);
}

TEST(CpuOptions, AnInstructionSetOfAnotherProcessorIsUnavailable) {
    const auto known = cpu_instruction_sets();
    for (const InstructionSet set : {InstructionSet::sse2, InstructionSet::neon}) {
        if (std::ranges::find(known, set, &InstructionSetStatus::set) != known.end()) continue;
        (void)error_of([&] { (void)make_cpu_backend({.instruction_set = set}); }, ErrorKind::unavailable);
    }
}

TEST(CpuOptions, VolumeBytesCountTheLayoutsInUse) {
    NamedScene named{"memory", random_volume({32, 32, 32}, {1, 1, 1}, 1), {view_along(rotation(0, 0, 0), {20, 20}, 2)}};
    auto session = make_cpu_backend({})->prepare(named.scene(Projector::joseph));
    const std::size_t one = session->volume_bytes();
    EXPECT_GE(one, 32U * 32 * 32 * sizeof(float));
    (void)session->render({}, 0);
    EXPECT_EQ(session->volume_bytes(), one);  // the first view's axis is there from the start
    (void)session->render({rotation(90, 0, 0), {0, 0, 0}}, 0);
    EXPECT_GT(session->volume_bytes(), one);
}

}  // namespace
}  // namespace raylign::detail::test
