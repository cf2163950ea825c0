#include "core/io/files/regular_file.h"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "core/io/files/file_format.h"
#include "core/io/files/output.h"
#include "io_files.h"
#include "raylign/io/geometry.h"
#include "raylign/io/image.h"
#include "raylign/io/landmarks.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::HasSubstr;

class RegularFile : public test::IoTest {
protected:
    [[nodiscard]] std::filesystem::path fifo(const std::string& name) const {
        EXPECT_EQ(::mkfifo(at(name).c_str(), 0600), 0);
        return at(name);
    }
};

TEST_F(RegularFile, IsReadWhole) {
    const std::string text = std::string(3 << 20, 'x') + std::string("a\0b", 3);
    EXPECT_EQ(regular_file_bytes(write("text", text)), text);
    EXPECT_EQ(regular_file_bytes(write("none", "")), "");
    std::filesystem::create_symlink("text", at("link"));
    EXPECT_EQ(regular_file_bytes(at("link")).size(), text.size());
}

TEST_F(RegularFile, TakesRoomByItsSizeAndDoesNotBelieveIt) {
    for (const int bytes : {1, 4095, 4096, 4097, (1 << 20) - 1, 1 << 20, (1 << 20) + 1}) {
        const std::string text = std::string(static_cast<std::size_t>(bytes - 1), 'x') + "y";
        EXPECT_EQ(regular_file_bytes(write("text", text)), text) << bytes;
    }
    EXPECT_LT(regular_file_bytes(write("small", "{}")).capacity(), 20000U) << "a megabyte slows a small file down";
    ASSERT_EQ(std::filesystem::file_size("/proc/self/maps"), 0U);
    EXPECT_THAT(regular_file_bytes("/proc/self/maps"), HasSubstr("[stack]"));
}

TEST_F(RegularFile, AnythingElseIsRefusedAtOnceAndNamed) {
    const auto message = [](const std::filesystem::path& path) { return error_of([&] { check_readable_file(path); }); };
    EXPECT_THAT(message(fifo("fifo.nii")), AllOf(HasSubstr("fifo.nii"), HasSubstr("FIFO")));
    EXPECT_THAT(message("/dev/zero"), AllOf(HasSubstr("/dev/zero"), HasSubstr("device")));
    EXPECT_THAT(message(folder_), HasSubstr("folder"));
    EXPECT_THAT(message(at("nothing")), HasSubstr("nothing does not exist"));
    EXPECT_THAT(message(write("empty", "")), HasSubstr("0 bytes"));
    const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder_);  // such names are short
    std::strcpy(address.sun_path, "socket");
    ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_THAT(message("socket"), HasSubstr("socket is a socket"));
    std::filesystem::current_path(before);
    ::close(socket);
}

TEST_F(RegularFile, NoReaderWaitsForAFifo) {
    const auto refused = [&](const std::string& name, const auto& read) {
        const std::filesystem::path path = fifo(name);
        EXPECT_THAT(error_of([&] { read(path); }), AllOf(HasSubstr(name), HasSubstr("FIFO")));
    };
    refused("a.nii", [](const auto& path) { (void)read_volume(path); });
    refused("b.mha", [](const auto& path) { (void)read_volume(path); });
    refused("c.png", [](const auto& path) { (void)read_xray(path); });
    refused("d.tif", [](const auto& path) { (void)xray_size_px(path); });
    refused("e.dcm", [](const auto& path) { (void)xray_frame_count(path); });
    refused("views.json", [](const auto& path) { (void)read_views(path, ReadImages::required); });
    refused("pose.json", [](const auto& path) { (void)read_pose(path); });
    refused("pose.tfm", [](const auto& path) { (void)read_pose(path); });
    refused("targets.csv", [](const auto& path) { (void)read_targets(path); });
    refused("maya.txt", [](const auto& path) { (void)read_geometry(path, {}); });
    refused("hash", [](const auto& path) { (void)sha256_of_file(path); });
}

}  // namespace
}  // namespace raylign::detail
