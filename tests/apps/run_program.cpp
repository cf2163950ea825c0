#include "tests/apps/run_program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <thread>

namespace raylign::detail::test {
namespace {

namespace fs = std::filesystem;

void redirect(int stream, const std::string& file) {
    const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (descriptor < 0 || dup2(descriptor, stream) < 0) _exit(126);
    close(descriptor);
}

void nothing(pid_t) {}

ProgramResult run(
    const std::vector<std::string>& arguments, const std::function<void(pid_t)>& meanwhile,
    rlim_t longest_file = RLIM_INFINITY, const std::function<void()>& change_output = [] {}) {
    const TestFolder capture;
    const std::string out = capture.path("out"), err = capture.path("err");
    std::vector<std::string> words{RAYLIGN_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("cannot fork");
    if (child == 0) {
        redirect(STDOUT_FILENO, out);
        redirect(STDERR_FILENO, err);
        change_output();
        const rlimit limit{longest_file, longest_file};
        signal(SIGXFSZ, SIG_IGN);  // the write fails instead of ending the program
        setrlimit(RLIMIT_FSIZE, &limit);
        execv(argv[0], argv.data());
        _exit(127);
    }
    meanwhile(child);
    int status = 0;
    waitpid(child, &status, 0);
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return {code, read_text(out), read_text(err)};
}

bool has_hidden_entry(const fs::path& folder) {
    std::error_code not_yet;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, not_yet)) {
        if (entry.path().filename().string().front() == '.') return true;
    }
    return false;
}

}  // namespace

ProgramResult run_raylign(const std::vector<std::string>& arguments) { return run(arguments, nothing); }

ProgramResult run_raylign_on_full_disk(const std::vector<std::string>& arguments, std::size_t bytes) {
    return run(arguments, nothing, bytes);
}

ProgramResult run_raylign_and(const std::vector<std::string>& arguments, const std::function<bool()>& is_ready,
                              const std::function<void(int)>& then) {
    return run(arguments, [&](pid_t child) {
        const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
        while (!is_ready() && std::chrono::steady_clock::now() < deadline) {
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        then(child);
    });
}

ProgramResult run_raylign_and_signal(const std::vector<std::string>& arguments, int signal,
                                     const fs::path& ready_file_in) {
    return run_raylign_and(
        arguments, [&] { return has_hidden_entry(ready_file_in); }, [&](int process) { kill(process, signal); });
}

ProgramResult run_raylign_unheard(const std::vector<std::string>& arguments, DeadOutput output) {
    return run(arguments, nothing, RLIM_INFINITY, [output] {
        if (output == DeadOutput::closed) {
            close(STDOUT_FILENO);
            return;
        }
        std::array<int, 2> ends{};
        if (pipe(ends.data()) != 0 || dup2(ends[1], STDOUT_FILENO) < 0) _exit(126);
        close(ends[0]);
        close(ends[1]);
    });
}

std::string read_text(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void write_text_file(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

std::vector<std::string> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        names.push_back(entry.path().filename().string());
    std::ranges::sort(names);
    return names;
}

}  // namespace raylign::detail::test
