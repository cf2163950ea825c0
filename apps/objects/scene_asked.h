#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/objects/object_options.h"
#include "core/io/volumes/labelled_objects.h"

namespace raylign::detail::apps {

inline constexpr const char* kRestName = "rest";

/// "1,2,3,4,5,6" or "voxels:...": what --object means with one object.
[[nodiscard]] bool is_box(const std::string& text);

/// Files by name of the object, and one for all others.
struct NamedFiles {
    std::string for_all;
    std::map<std::string, std::string> of;

    [[nodiscard]] std::string file(const std::string& name) const {
        const auto found = of.find(name);
        return found == of.end() ? for_all : found->second;
    }
};
/// Of FILE and NAME=FILE, NAME one of `names`. Throws Error for an unknown name, and for two files of one object.
[[nodiscard]] NamedFiles named_files(const std::vector<std::string>& arguments, const std::string& option,
                                     const std::vector<std::string>& names);

/// What --object and --bone ask for.
struct Asked {
    std::vector<LabelledName> labelled;
    bool all_bones = false;
    std::vector<std::pair<std::string, std::string>> files;  ///< name, file
};
/// Throws Error for names that no file can have, and flags that contradict each other.
[[nodiscard]] Asked asked_objects(const ObjectOptions& options);

/// What --joint asks for, by positions among the objects' names.
struct AskedJoint {
    std::size_t proximal = 0, distal = 0;
    double apart_mm = 0, turned_deg = 0;  ///< 0 = no limit
};
/// Of "PROXIMAL,DISTAL" and "PROXIMAL,DISTAL=MM,DEG". Throws Error for another form, and unknown names.
[[nodiscard]] std::vector<AskedJoint> asked_joints(const std::vector<std::string>& arguments,
                                                   const std::vector<std::string>& names);

}  // namespace raylign::detail::apps
