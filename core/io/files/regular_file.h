#pragma once

#include <filesystem>
#include <string>

#include "core/io/decode/packets.h"

namespace raylign::detail {

/// Opens a file for reading, never waiting for one: a FIFO or a device that took a file's place meanwhile is refused
/// like any that was there before. Throws Error, with the system's reason, where it is missing, may not be read, or is
/// no regular file: a folder, FIFO, socket or device.
[[nodiscard]] Descriptor open_regular_file(const std::filesystem::path& path);

/// All bytes of such a file.
[[nodiscard]] std::string regular_file_bytes(const std::filesystem::path& path);

}  // namespace raylign::detail
