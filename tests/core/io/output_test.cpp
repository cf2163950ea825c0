#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>

#include "core/io/files/output.h"
#include "core/io/images/png.h"
#include "io_files.h"
#include "raylign/io/image.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::content_of;
using test::error_of;
using testing::HasSubstr;

class Output : public test::IoTest {
protected:
    [[nodiscard]] std::size_t entries(const std::filesystem::path& folder) const {
        return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
    }
};

/// No file may grow beyond `bytes` while it lives: what a full disk does, without one.
class FullDisk {
public:
    explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FullDisk() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

private:
    rlimit before_{};
    void (*handler_)(int);
};

TEST_F(Output, CommitPutsFilesInPlaceAndLeavesNothingElse) {
    {
        OutputFolder folder(at("a/b"));
        write_text(folder.stage("report.json"), "{}");
        write_text(folder.stage("pose.tfm"), "pose");
        EXPECT_FALSE(std::filesystem::exists(at("a/b/report.json")));
        folder.commit();
    }
    EXPECT_EQ(content_of(at("a/b/report.json")), "{}");
    EXPECT_EQ(content_of(at("a/b/pose.tfm")), "pose");
    EXPECT_EQ(entries(at("a/b")), 2U);
}

TEST_F(Output, WithoutCommitOldFilesStayAndNewOnesVanish) {
    (void)write("report.json", "old");
    {
        OutputFolder folder(folder_);
        write_text(folder.stage("report.json"), "new");
        write_text(folder.stage("extra"), "new");
    }
    EXPECT_EQ(content_of(at("report.json")), "old");
    EXPECT_EQ(entries(folder_), 1U);
}

TEST_F(Output, WhatAKilledRunLeftGoesAndARunAtWorkStays) {
    std::filesystem::create_directory(at(".raylign-staging-abcdef"));
    (void)write(".raylign-staging-abcdef/pose.json", "half");
    (void)write(".raylign-staging-file", "no folder");
    std::filesystem::create_directory(at("elsewhere"));
    (void)write("elsewhere/kept", "kept");
    std::filesystem::create_directory_symlink("elsewhere", at(".raylign-staging-link"));
    {
        OutputFolder first(folder_);
        EXPECT_FALSE(std::filesystem::exists(at(".raylign-staging-abcdef")));
        write_text(first.stage("a"), "first");
        OutputFolder second(folder_);
        write_text(second.stage("b"), "second");
        first.commit();
        second.commit();
    }
    EXPECT_EQ(content_of(at("a")) + content_of(at("b")), "firstsecond");
    EXPECT_EQ(content_of(at("elsewhere/kept")), "kept");
    EXPECT_EQ(entries(folder_), 5U) << "a, b, elsewhere, and what is no staging folder";
}

/// The id of a process that is no more.
pid_t dead_process() {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(0);
    EXPECT_EQ(::waitpid(child, nullptr, 0), child);
    return child;
}

TEST_F(Output, TemporaryFilesOfKilledRunsGoAndOthersStay) {
    const std::string dead = ".raylign-" + std::to_string(dead_process()) + "-";
    const std::vector<std::string> kept = {".raylign-" + std::to_string(::getppid()) + "-a.mha",
                                           dead.substr(0, 10),
                                           ".raylign-x-a.mha",
                                           ".raylign-12",
                                           "raylign-1-a",
                                           dead + "locked"};
    for (const std::string& name : kept) (void)write(name, "kept");
    const Descriptor locked(::open(at(dead + "locked").c_str(), O_RDWR));  // as by a run on another machine
    ASSERT_EQ(::flock(locked.number(), LOCK_SH), 0);
    (void)write(dead + "a.mha", "half");
    std::filesystem::create_directory(at(dead + "folder"));
    write_text(at("a.txt"), "whole");
    EXPECT_FALSE(std::filesystem::exists(at(dead + "a.mha")));
    (void)write(dead + "b.txt", "half");
    { OutputFolder folder(folder_); }
    EXPECT_FALSE(std::filesystem::exists(at(dead + "b.txt")));
    for (const std::string& name : kept) EXPECT_EQ(content_of(at(name)), "kept") << name;
    EXPECT_EQ(entries(folder_), kept.size() + 2) << "those, a.txt, and what is no file";
}

TEST_F(Output, AnotherUsersStagingFolderStays) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can give a folder away";
    std::filesystem::create_directory(at(".raylign-staging-theirs"));
    ASSERT_EQ(::chown(at(".raylign-staging-theirs").c_str(), 65534, 65534), 0);
    { OutputFolder folder(folder_); }
    EXPECT_TRUE(std::filesystem::exists(at(".raylign-staging-theirs")));
}

TEST_F(Output, CommitReplacesOldFiles) {
    (void)write("report.json", "old");
    OutputFolder folder(folder_);
    write_text(folder.stage("report.json"), "new");
    folder.commit();
    EXPECT_EQ(content_of(at("report.json")), "new");
}

TEST_F(Output, FoldersMadeForAFailedRunAreRemoved) {
    { OutputFolder folder(at("a/b/")); }
    EXPECT_FALSE(std::filesystem::exists(at("a")));
}

TEST_F(Output, FailedCommitLosesNothing) {
    (void)write("a", "old");
    OutputFolder folder(folder_);
    write_text(folder.stage("a"), "new");
    (void)folder.stage("b");  // announced, never written
    EXPECT_THAT(error_of([&] { folder.commit(); }), HasSubstr("b"));
    EXPECT_EQ(content_of(at("a")), "old");
}

TEST_F(Output, CommitOntoAFolderIsRefused) {
    std::filesystem::create_directory(at("b"));
    OutputFolder folder(folder_);
    write_text(folder.stage("a"), "new");
    write_text(folder.stage("b"), "new");
    EXPECT_THAT(error_of([&] { folder.commit(); }), HasSubstr("a folder has this name"));
    EXPECT_FALSE(std::filesystem::exists(at("a")));
}

TEST_F(Output, FileInTheWayOfTheFolderIsNamed) {
    (void)write("file", "x");
    EXPECT_THAT(error_of([&] { OutputFolder folder(at("file")); }), HasSubstr("not a folder"));
    EXPECT_THAT(error_of([&] { OutputFolder folder(at("file") / "sub"); }), HasSubstr("file is not a folder"));
}

TEST_F(Output, FolderThatCannotBeMadeSaysWhy) {
    EXPECT_THAT(error_of([] { OutputFolder folder("/proc/raylign"); }),
                HasSubstr("cannot make the folder /proc/raylign: "));
}

TEST_F(Output, LinksToNothingAndLongNamesSayWhy) {
    std::filesystem::create_symlink("none", at("dangling"));
    std::filesystem::create_symlink("loop", at("loop"));
    const auto error = [&](const std::string& name) {
        const std::string message = error_of([&] { OutputFolder folder(at(name)); });
        EXPECT_THAT(message, HasSubstr("cannot make the folder " + at(name).string() + ": "));
        return message;
    };
    EXPECT_THAT(error("dangling"), HasSubstr("symbolic link to none, which does not exist"));
    EXPECT_THAT(error("dangling/sub"), HasSubstr("symbolic link to none, which does not exist"));
    EXPECT_THAT(error("loop"), HasSubstr("Too many levels of symbolic links"));
    EXPECT_THAT(error("loop/sub"), HasSubstr("Too many levels of symbolic links"));
    EXPECT_THAT(error(std::string(300, 'x')), HasSubstr("File name too long"));
}

TEST_F(Output, ReadOnlyFolderSaysWhy) {
    std::filesystem::permissions(folder_, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
    const bool is_root = ::geteuid() == 0;  // root may write everywhere: be nobody for a moment
    if (is_root) {
        ASSERT_EQ(::seteuid(65534), 0);
    }
    const std::string message = error_of([&] { OutputFolder folder(folder_); });
    if (is_root) {
        ASSERT_EQ(::seteuid(0), 0);
    }
    std::filesystem::permissions(folder_, std::filesystem::perms::owner_all);
    EXPECT_THAT(message, HasSubstr("Permission denied"));
}

TEST_F(Output, NamesWithFoldersAreRefused) {
    OutputFolder folder(folder_);
    for (const char* name : {"a/b", "../a", "", "..", "/etc/a"}) {
        EXPECT_THAT(error_of([&] { (void)folder.stage(name); }), HasSubstr("plain file name"));
    }
}

TEST_F(Output, FullDiskKeepsTheOldTextAndSaysWhy) {
    (void)write("a.txt", "old");
    {
        const FullDisk full(1000);
        EXPECT_THAT(error_of([&] { write_text(at("a.txt"), std::string(5000, 'x')); }), HasSubstr("File too large"));
    }
    EXPECT_EQ(content_of(at("a.txt")), "old");
    EXPECT_EQ(entries(folder_), 1U);
}

TEST_F(Output, FullDiskKeepsTheOldImages) {
    Volume volume;
    volume.grid.size = {20, 20, 20};
    volume.attenuation_per_mm.assign(8000, 0.5F);
    for (std::size_t i = 0; i < 8000; ++i) volume.attenuation_per_mm[i] = static_cast<float>((i * 7919) % 8009);
    Image image(80, 80);
    for (std::size_t i = 0; i < 6400; ++i) image.pixels[i] = static_cast<float>(i);
    RgbImage colours{80, 80, std::vector<std::array<std::uint8_t, 3>>(6400)};
    for (std::size_t i = 0; i < 6400; ++i) colours.pixels[i][i % 3] = static_cast<std::uint8_t>(i * 7919 >> 3);
    const std::vector<std::string> names = {"a.tif", "a.png",  "b.mha", "b.nrrd",
                                            "v.mha", "v.nrrd", "v.nii", "v.nii.gz"};
    for (const std::string& name : names) (void)write(name, "old");
    for (const std::string& name : names) {
        const FullDisk full(1000);
        const std::string message = error_of([&] {
            if (name[0] == 'v') {
                write_volume(at(name), volume);
            } else if (name == "a.png") {
                write_png(at(name), colours);
            } else {
                write_image(at(name), image);
            }
        });
        EXPECT_THAT(message, HasSubstr(name));
        EXPECT_EQ(content_of(at(name)), "old");
    }
    EXPECT_EQ(entries(folder_), names.size());
}

TEST_F(Output, TextIsWrittenWhole) {
    const std::string text = std::string(3 << 20, 'x') + "end";
    write_text(at("a.txt"), text);
    EXPECT_EQ(content_of(at("a.txt")), text);
}

TEST_F(Output, Sha256OfKnownTexts) {
    EXPECT_EQ(sha256_of_file(write("abc", "abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha256_of_file(write("none", "")), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(sha256_of_file(write("a", std::string(1000000, 'a') + std::string(1000000, 'a'))).size(), 64U);
}

TEST_F(Output, Sha256OfAMillionLettersReadsBeyondOneBlock) {
    EXPECT_EQ(sha256_of_file(write("a", std::string(1000000, 'a'))),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");  // FIPS 180-2 example
}

TEST_F(Output, Sha256OfAMissingFileIsNamed) {
    EXPECT_THAT(error_of([&] { (void)sha256_of_file(at("none")); }), HasSubstr("none"));
    EXPECT_THAT(error_of([&] { (void)sha256_of_file(folder_); }), HasSubstr(folder_.string()));
}

}  // namespace
}  // namespace raylign::detail
