// libFuzzer's entry: raylign_fuzz --reader=NAME [libFuzzer's flags] CORPUS. One program for all readers, since linking
// one each takes longer than fuzzing them.

#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "raylign/error.h"
#include "raylign/io/decoding.h"
#include "readers.h"

namespace {

using raylign::detail::test::FuzzedReader;

const FuzzedReader* reader = nullptr;
std::filesystem::path path;

[[noreturn]] void usage(std::string_view name) {
    std::fprintf(stderr, "reader: is \"%.*s\", must be --reader=NAME with one of\n", static_cast<int>(name.size()),
                 name.data());
    for (const FuzzedReader& known : raylign::detail::test::fuzzed_readers()) {
        std::fprintf(stderr, "  %.*s\n", static_cast<int>(known.name.size()), known.name.data());
    }
    std::exit(2);
}

/// In memory where there is such a folder: the readers take files, not bytes.
std::filesystem::path folder() {
    const std::filesystem::path memory = "/dev/shm";
    const std::filesystem::path parent =
        std::filesystem::exists(memory) ? memory : std::filesystem::temp_directory_path();
    return parent / ("raylign_fuzz_" + std::to_string(getpid()));
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    constexpr std::string_view kFlag = "--reader=";
    std::string_view name;
    for (int i = 1; i < *argc; ++i) {
        const std::string_view argument = (*argv)[i];
        if (argument.starts_with(kFlag)) name = argument.substr(kFlag.size());
    }
    for (const FuzzedReader& known : raylign::detail::test::fuzzed_readers()) {
        if (known.name == name) reader = &known;
    }
    if (!reader) usage(name);
    raylign::set_decoding(raylign::Decoding::in_process);  // a crash in another process would be no finding
    std::filesystem::create_directory(folder());
    path = folder() / ("input" + std::string(reader->extension));
    std::atexit([] { std::filesystem::remove_all(path.parent_path()); });
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
        reader->read(path);
    } catch (const raylign::Error&) {  // refused in words: as it should be
    }
    return 0;
}
