#include "core/io/decode/decoder.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <new>
#include <thread>

#include "core/io/decode/pack.h"
#include "core/io/decode/packets.h"
#include "io_files.h"
#include "raylign/io/decoding.h"
#include "raylign/io/image.h"

namespace raylign::detail {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Decoders as a damaged file makes them.
void crash(const std::filesystem::path&, const std::string&, DecoderReply&) { ::raise(SIGSEGV); }
void abort_it(const std::filesystem::path&, const std::string&, DecoderReply&) { std::abort(); }
void leave(const std::filesystem::path&, const std::string&, DecoderReply&) { std::_Exit(7); }
void kill_it(const std::filesystem::path&, const std::string&, DecoderReply&) { ::raise(SIGKILL); }
void hang(const std::filesystem::path&, const std::string&, DecoderReply&) {
    for (volatile bool on = true; on;) {
    }
}
void devour(const std::filesystem::path&, const std::string&, DecoderReply&) {
    std::vector<std::string> all;
    for (;;) all.emplace_back(std::size_t{1} << 24, 'x');
}
void throw_error(const std::filesystem::path& path, const std::string&, DecoderReply&) {
    throw Error("no device for " + path.string(), ErrorKind::unavailable);
}
void throw_bad_alloc(const std::filesystem::path&, const std::string&, DecoderReply&) { throw std::bad_alloc(); }
void throw_out_of_range(const std::filesystem::path&, const std::string&, DecoderReply&) {
    (void)std::vector<int>().at(3);
}
void throw_a_number(const std::filesystem::path&, const std::string&, DecoderReply&) { throw 3; }
void print_and_die(const std::filesystem::path&, const std::string&, DecoderReply&) {
    std::fputs("libfoo: \x1b[31mbad\x07\n", stderr);
    std::fflush(stderr);
    for (int i = 0; i < 100000; ++i) std::puts("chatter");
    std::abort();
}
void print_and_answer(const std::filesystem::path&, const std::string&, DecoderReply& reply) {
    std::fputs("libfoo: warning\n", stderr);
    reply.message("fine");
}
void talk_nonsense(const std::filesystem::path&, const std::string&, DecoderReply& reply) {
    reply.bulk(std::vector<std::byte>(1000));
}
void say_too_little(const std::filesystem::path&, const std::string&, DecoderReply& reply) {
    reply.message(Packer().add(std::size_t{1} << 40).bytes());
}
void die_half_way(const std::filesystem::path&, const std::string&, DecoderReply& reply) {
    reply.message("begun");
    reply.bulk(std::vector<std::byte>(2 * kMostPacketBytes));
    ::raise(SIGBUS);
}
void give_back(const std::filesystem::path& path, const std::string& arguments, DecoderReply& reply) {
    reply.message(arguments + path.string());
}
void repeat_it(const std::filesystem::path&, const std::string& arguments, DecoderReply& reply) {
    reply.message(arguments + arguments + arguments + arguments);
}
void name_server(const std::filesystem::path&, const std::string&, DecoderReply& reply) {
    reply.message(std::to_string(::getppid()));
}
void ask_first(const std::filesystem::path& path, const std::string&, DecoderReply& reply) {
    reply.message("header");
    reply.wait_for_consent();
    std::ofstream(path) << "went on";
    reply.bulk(std::vector<std::byte>(200000, std::byte{5}));
}
void read_another(const std::filesystem::path& path, const std::string&, DecoderReply& reply) {
    reply.message(decode({&give_back, path, {}, {}}, [](DecodedStream&) {}) ? "nested" : "here");
}

constexpr DecodeLimits kLimits{20, std::size_t{300} << 20};

std::string answer(Decoder decoder, const std::string& arguments = {}, const DecodeLimits& limits = kLimits) {
    std::string said;
    const bool is_read =
        decode({decoder, "some.file", arguments, limits}, [&](DecodedStream& stream) { said = stream.message(); });
    return is_read ? said : "not read";
}

std::string failure(Decoder decoder, const DecodeLimits& limits = kLimits) {
    return test::error_of([&] { (void)answer(decoder, {}, limits); });
}

std::size_t open_descriptors() {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}

class Decode : public test::IoTest {};

TEST_F(Decode, AnAnswerComesBackWithItsArguments) {
    EXPECT_EQ(answer(&give_back, "small "), "small some.file");
    EXPECT_EQ(answer(&print_and_answer), "fine");
    EXPECT_EQ(answer(&read_another), "here") << "no process within the process";
    const std::string large(20000, 'x');
    EXPECT_EQ(answer(&repeat_it, large), large + large + large + large) << "in several packets";
}

TEST_F(Decode, ADeadDecoderIsAnErrorWithTheFilesName) {
    EXPECT_THAT(failure(&crash), AllOf(HasSubstr("some.file"), HasSubstr("died (SIGSEGV)"), HasSubstr("report")));
    EXPECT_THAT(failure(&abort_it), AllOf(HasSubstr("some.file"), HasSubstr("SIGABRT")));
    EXPECT_THAT(failure(&kill_it), AllOf(HasSubstr("some.file"), HasSubstr("SIGKILL"), HasSubstr("memory")));
    EXPECT_THAT(failure(&leave), AllOf(HasSubstr("some.file"), HasSubstr("exit code 7")));
    EXPECT_EQ(answer(&give_back), "some.file") << "the next one is read";
}

TEST_F(Decode, AnEndlessLoopMeetsTheTimeLimit) {
    EXPECT_THAT(failure(&hang, {.time_s = 0.2}), AllOf(HasSubstr("some.file"), HasSubstr("within 0.2 s")));
}

TEST_F(Decode, AllMemoryIsTooMuch) {
    if (kHasShadowMemory) GTEST_SKIP() << "a sanitizer's shadow is larger than any limit";
    EXPECT_THAT(failure(&devour), AllOf(HasSubstr("some.file"), HasSubstr("not enough memory")));
}

TEST_F(Decode, ExceptionsKeepTheirWordsAndKind) {
    try {
        (void)answer(&throw_error);
        FAIL();
    } catch (const Error& error) {
        EXPECT_STREQ(error.what(), "no device for some.file");
        EXPECT_EQ(error.kind(), ErrorKind::unavailable);
    }
    EXPECT_EQ(failure(&throw_bad_alloc), "some.file: not enough memory");
    EXPECT_THAT(failure(&throw_out_of_range), AllOf(HasSubstr("some.file"), Not(HasSubstr("_M_"))));
    EXPECT_THAT(failure(&throw_a_number), HasSubstr("some.file"));
}

TEST_F(Decode, WhatItPrintsIsPartOfTheMessageWithoutControlCharacters) {
    const std::string message = failure(&print_and_die);
    EXPECT_THAT(message, AllOf(HasSubstr("libfoo: \\x1b[31mbad\\x07"), HasSubstr("bytes left out")));
    EXPECT_LT(message.size(), 1000u);
}

TEST_F(Decode, NonsenseIsAnError) {
    EXPECT_THAT(failure(&talk_nonsense), AllOf(HasSubstr("some.file"), HasSubstr("no sensible answer")));
    const auto list = [] {
        (void)decode({&say_too_little, "some.file", {}, kLimits}, [](DecodedStream& stream) {
            const std::string said = stream.message();
            std::vector<double> numbers;
            Unpacker(said).take(numbers);
        });
    };
    EXPECT_THAT(test::error_of(list), HasSubstr("cut off"));
    const auto half = [] {
        (void)decode({&die_half_way, "some.file", {}, kLimits}, [](DecodedStream& stream) {
            (void)stream.message();
            std::vector<std::byte> bytes(200000);
            stream.bulk(bytes);
        });
    };
    EXPECT_THAT(test::error_of(half), HasSubstr("SIGBUS"));
}

TEST_F(Decode, NothingIsReadWithoutConsent) {
    const auto refuse = [&] {
        (void)decode({&ask_first, at("trace"), {}, kLimits},
                     [](DecodedStream& stream) { throw Error("refused the " + stream.message()); });
    };
    EXPECT_EQ(test::error_of(refuse), "refused the header");
    std::vector<std::byte> bytes(200000);
    EXPECT_TRUE(decode({&ask_first, at("trace2"), {}, kLimits}, [&](DecodedStream& stream) {
        (void)stream.message();
        EXPECT_FALSE(std::filesystem::exists(at("trace2")));
        stream.consent();
        stream.bulk(bytes);
    }));
    EXPECT_EQ(bytes, std::vector<std::byte>(200000, std::byte{5}));
    EXPECT_FALSE(std::filesystem::exists(at("trace")));
}

TEST_F(Decode, AKilledServerIsReplaced) {
    const std::string first = answer(&name_server);
    ASSERT_EQ(::kill(std::stoi(first), SIGKILL), 0);
    const std::string second = answer(&name_server);
    EXPECT_NE(second, first);
    EXPECT_EQ(answer(&name_server), second);
}

TEST_F(Decode, TheServerIgnoresTheTerminalsSignals) {
    const std::string server = answer(&name_server);
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) ASSERT_EQ(::kill(std::stoi(server), number), 0);
    EXPECT_EQ(answer(&name_server), server);
}

TEST_F(Decode, ThreadsDoNotMixTheirAnswers) {
    std::vector<std::jthread> threads;
    std::vector<int> right(4);
    for (std::size_t t = 0; t < right.size(); ++t) {
        threads.emplace_back([t, &right] {
            const std::string mine = std::to_string(t) + " ";
            for (int i = 0; i < 50; ++i) right[t] += answer(&give_back, mine) == mine + "some.file";
        });
    }
    threads.clear();
    EXPECT_THAT(right, testing::Each(50));
}

TEST_F(Decode, AThousandRequestsLeaveNothing) {
    const std::string server = answer(&name_server);
    const std::size_t before = open_descriptors();
    for (int i = 0; i < 500; ++i) {
        ASSERT_EQ(answer(&give_back), "some.file");
        ASSERT_THAT(failure(&leave), HasSubstr("exit code 7"));
    }
    EXPECT_EQ(open_descriptors(), before);
    EXPECT_EQ(answer(&name_server), server);
    std::string children = "not yet";
    for (int wait = 0; wait < 200 && !children.empty(); ++wait) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));  // the last decoder may still be ending
        children = test::content_of("/proc/" + server + "/task/" + server + "/children");
    }
    EXPECT_EQ(children, "");
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "no child of this process, dead or alive";
}

TEST_F(Decode, InProcessMeansNoProcess) {
    set_decoding(Decoding::in_process);
    EXPECT_EQ(answer(&give_back), "not read");
    write_image(at("image.tif"), Image(4, 3, 2.F));
    EXPECT_EQ(read_xray(at("image.tif")).image.pixels, Image(4, 3, 2.F).pixels);
    EXPECT_EQ(xray_size_px(at("image.tif")), Eigen::Vector2i(4, 3));
    set_decoding(Decoding::own_process);
    EXPECT_EQ(answer(&give_back), "some.file");
}

TEST_F(Decode, RelativeNamesFollowTheWorkingFolder) {
    write_image(at("image.tif"), Image(4, 3, 2.F));
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder_);
    EXPECT_EQ(read_xray("image.tif").image.pixels, Image(4, 3, 2.F).pixels);
    std::filesystem::current_path(before);
}

TEST_F(Decode, LimitsGrowWithTheFile) {
    const DecodeLimits small = limits_for(write("a.tif", "x")),
                       large = limits_for(write("b.tif", std::string(3 << 20, 'x')));
    EXPECT_LT(small.memory_bytes, large.memory_bytes);
    EXPECT_LT(small.time_s, large.time_s);
    EXPECT_GE(limits_for(write("c.mhd", "x")).memory_bytes, large.memory_bytes) << "its pixels are elsewhere";
}

}  // namespace
}  // namespace raylign::detail
