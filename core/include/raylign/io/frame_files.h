#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "raylign/io/image.h"

namespace raylign {

/// One X-ray of a sequence.
struct FrameFile {
    int number = 0;  ///< by which the frames of several views belong together
    std::filesystem::path file;
    int frame = 0;  ///< of the file, from 1; 0 = there is but one
};

/// The frames that `pattern` stands for, by number:
///   run.dcm                a file (multi-frame DICOM, multi-page TIFF, a stack): its frames, from 1
///   folder/cam1.%04d.tif   files with a number there; %d for any count of digits
///   folder/cam1.*.tif      * and ? as in a shell; the number is the last one in the name
///   folder                 all of its files that are not hidden, as by *
/// Only the last part of the path may hold %d, * or ?. Throws Error where nothing fits, where two files have one
/// number, or a name has none.
[[nodiscard]] std::vector<FrameFile> list_frames(const std::filesystem::path& pattern);

/// A list of files, numbered from 1 as they stand. Throws Error where none of them is there; one that is not is an
/// error when it is read.
[[nodiscard]] std::vector<FrameFile> list_frames(const std::vector<std::filesystem::path>& files);

/// Reads frames of a sequence. A file with several stays open, its pixels in memory as stored; one that cannot be read
/// is not tried again for the next of its frames. One reader, one thread.
class FrameReader {
public:
    FrameReader();
    ~FrameReader();
    FrameReader(FrameReader&&) noexcept;
    FrameReader& operator=(FrameReader&&) noexcept;

    [[nodiscard]] RawXray read(const FrameFile& frame);

private:
    std::filesystem::path path_;  ///< of the file with several frames that was read last, or failed
    std::unique_ptr<XrayFile> file_;
    std::string failure_;
};

}  // namespace raylign
