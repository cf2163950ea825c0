#include "raylign/io/frame_files.h"

#include <fnmatch.h>

#include <algorithm>
#include <map>
#include <optional>

#include "core/base/error.h"
#include "core/base/fault_text.h"
#include "core/io/files/text.h"

namespace raylign {
using namespace detail;
namespace {

constexpr std::size_t kMostDigits = 9;  // of a number that fits an int

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// "cam1.%04d.tif" cut at its number.
struct Numbered {
    std::string before, after;
    std::size_t least_digits = 1;
};

/// At the first %d, %4d or %04d.
std::optional<Numbered> numbered(const std::string& name) {
    for (std::size_t at = name.find('%'); at != std::string::npos; at = name.find('%', at + 1)) {
        std::size_t end = at + 1;
        if (name.compare(end, 1, "0") == 0) ++end;
        const bool has_width = end < name.size() && is_digit(name[end]) && name[end] != '0';
        if (!has_width) end = at + 1;  // a 0 alone is no width
        const auto least_digits = has_width ? static_cast<std::size_t>(name[end++] - '0') : 1;
        if (name.compare(end, 1, "d") == 0) return Numbered{name.substr(0, at), name.substr(end + 1), least_digits};
    }
    return std::nullopt;
}

std::optional<int> number_of(const std::string& digits) {
    const bool fits = !digits.empty() && digits.size() <= kMostDigits && std::ranges::all_of(digits, is_digit);
    return fits ? std::optional(std::stoi(digits)) : std::nullopt;
}

/// The number in a name that fits the pattern; none where it does not fit.
std::optional<int> number_in(const std::string& name, const Numbered& parts) {
    const std::size_t around = parts.before.size() + parts.after.size();
    if (name.size() < around + parts.least_digits) return std::nullopt;
    if (!name.starts_with(parts.before) || !name.ends_with(parts.after)) return std::nullopt;
    return number_of(name.substr(parts.before.size(), name.size() - around));
}

/// The last run of digits in a name without its extension.
std::optional<int> last_number(const std::filesystem::path& file) {
    const std::string stem = file.stem().string();
    const auto last = std::find_if(stem.rbegin(), stem.rend(), is_digit);
    const auto first = std::find_if_not(last, stem.rend(), is_digit);
    return number_of(std::string(first.base(), last.base()));
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code problem;
    for (std::filesystem::directory_iterator entry(folder.empty() ? "." : folder, problem), end;
         !problem && entry != end; entry.increment(problem)) {
        std::error_code ignored;
        // What is no file (a FIFO, a link to nothing) stays in the list: reading it says so, and costs one frame.
        if (entry->path().filename().string().front() == '.' || entry->is_directory(ignored)) continue;
        files.push_back(folder / entry->path().filename());
    }
    if (problem) throw Error("folder " + folder.string() + " cannot be read: " + problem.message());
    return files;
}

/// Sorted by number; throws for numbers that stand twice, and where there is none.
std::vector<FrameFile> sorted(const std::map<int, std::vector<std::filesystem::path>>& by_number,
                              const std::filesystem::path& pattern) {
    std::vector<FrameFile> frames;
    for (const auto& [number, files] : by_number) {
        if (files.size() > 1) {
            throw Error("frames " + pattern.string() + ": " + files[0].filename().string() + " and " +
                        files[1].filename().string() + " both have the number " + std::to_string(number) +
                        " (say where it stands by %d, as in cam1.%04d.tif)");
        }
        frames.push_back({number, files.front(), 0});
    }
    if (frames.empty()) throw Error("frames " + pattern.string() + ": no file fits");
    return frames;
}

std::vector<FrameFile> frames_by_names(const std::filesystem::path& pattern, const Numbered& parts) {
    std::map<int, std::vector<std::filesystem::path>> by_number;
    for (const std::filesystem::path& file : files_in(pattern.parent_path())) {
        if (const auto number = number_in(file.filename().string(), parts)) by_number[*number].push_back(file);
    }
    return sorted(by_number, pattern);
}

std::vector<FrameFile> frames_by_glob(const std::filesystem::path& folder, const std::string& glob) {
    std::map<int, std::vector<std::filesystem::path>> by_number;
    for (const std::filesystem::path& file : files_in(folder)) {
        if (::fnmatch(glob.c_str(), file.filename().c_str(), 0) != 0) continue;
        const auto number = last_number(file);
        if (!number) {
            throw Error("frames " + (folder / glob).string() + ": " + file.filename().string() +
                        " has no number of at most " + std::to_string(kMostDigits) + " digits in its name");
        }
        by_number[*number].push_back(file);
    }
    return sorted(by_number, folder / glob);
}

}  // namespace

std::vector<FrameFile> list_frames(const std::filesystem::path& pattern) {
    std::error_code ignored;
    if (std::filesystem::is_directory(pattern, ignored)) return frames_by_glob(pattern, "*");
    if (std::filesystem::exists(pattern, ignored)) {
        const int count = xray_frame_count(pattern);
        if (count == 1) return {{1, pattern, 0}};
        std::vector<FrameFile> frames;
        for (int frame = 1; frame <= count; ++frame) frames.push_back({frame, pattern, frame});
        return frames;
    }
    const std::string name = pattern.filename().string();
    if (const auto parts = numbered(name)) return frames_by_names(pattern, *parts);
    if (name.find_first_of("*?") != std::string::npos) return frames_by_glob(pattern.parent_path(), name);
    throw bad_value("frames", pattern.string(), "a file, a folder, or a pattern such as cam1.%04d.tif or cam1.*.tif");
}

std::vector<FrameFile> list_frames(const std::vector<std::filesystem::path>& files) {
    std::vector<FrameFile> frames;
    bool is_any_there = false;
    for (const std::filesystem::path& file : files) {
        std::error_code ignored;
        is_any_there = is_any_there || std::filesystem::exists(file, ignored);
        frames.push_back({static_cast<int>(frames.size()) + 1, file, 0});
    }
    if (frames.empty()) throw Error("frames: must name at least one file");
    if (!is_any_there) throw Error("frame " + files.front().string() + ": no such file, nor any other of the list");
    return frames;
}

FrameReader::FrameReader() = default;
FrameReader::~FrameReader() = default;
FrameReader::FrameReader(FrameReader&&) noexcept = default;
FrameReader& FrameReader::operator=(FrameReader&&) noexcept = default;

RawXray FrameReader::read(const FrameFile& frame) {
    if (frame.frame == 0) return read_xray(frame.file);
    if (path_ != frame.file) {
        file_.reset();  // before the next one takes memory
        failure_.clear();
        path_ = frame.file;
        try {
            file_ = std::make_unique<XrayFile>(frame.file);
        } catch (const std::exception& failure) {
            failure_ = fault_text(failure);
        }
    }
    if (!file_) throw Error(failure_);  // what does not read for one of its frames does not for a thousand
    return file_->frame(frame.frame);
}

}  // namespace raylign
