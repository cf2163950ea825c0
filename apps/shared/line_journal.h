#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace raylign::detail::apps {

/// Whose journal it is, for its first line and for messages.
struct JournalKind {
    std::string key;   ///< of the first line: {"raylign_study": configuration}
    std::string what;  ///< "study": "belongs to another study", ...
    /// What becomes of a file of another configuration: an Error, or it is renamed to NAME.old and a new one begun.
    enum class Other { refused, set_aside } other = Other::refused;
};

/// A file that a kill cannot hurt: a line of configuration, then a line per finished piece of work, each on the disk
/// before the next begins. A last line that was cut off is dropped on opening.
class LineJournal {
public:
    /// Opens or makes `file` and locks it until destroyed. `config`: JSON in one line. Throws Error where the file
    /// belongs to another configuration (naming what differs), is none, is in use by another run, or cannot be written.
    LineJournal(const std::filesystem::path& file, const std::string& config, JournalKind kind);
    ~LineJournal();
    LineJournal(const LineJournal&) = delete;
    LineJournal& operator=(const LineJournal&) = delete;

    /// Those found on opening, without the first.
    [[nodiscard]] const std::vector<std::string>& lines() const { return lines_; }
    /// "FILE, line N" of a line found.
    [[nodiscard]] std::string place_of(std::size_t line) const;
    [[nodiscard]] const std::filesystem::path& file() const { return file_; }

    /// Returns when the line is on the disk. Throws Error with the system's reason where it cannot be written (the file
    /// is then as before).
    void append(const std::string& line);

private:
    void open();
    void lock();
    void read(const std::string& config);
    void set_aside();

    std::filesystem::path file_;
    JournalKind kind_;
    int descriptor_ = -1;
    long long size_ = 0;  ///< bytes of whole lines
    std::vector<std::string> lines_;
};

}  // namespace raylign::detail::apps
