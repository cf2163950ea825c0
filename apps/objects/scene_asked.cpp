#include "apps/objects/scene_asked.h"

#include <algorithm>
#include <filesystem>

#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/io/files/text.h"
#include "core/io/views/view_files.h"

namespace raylign::detail::apps {
namespace {

constexpr const char* kAllBones = "all-bones";

void check_name(const std::string& name, const std::string& option) {
    if (is_view_name(name) && lower_case(name) != kRestName) return;
    throw bad_value("name of " + option, name,
                    "letters, digits, '_', '-' or '.' (it becomes part of file names), and not \"rest\"");
}

void check_asked(const Asked& asked, const ObjectOptions& options) {
    const bool by_label = asked.all_bones || !asked.labelled.empty();
    if (asked.all_bones && !asked.labelled.empty()) throw Error("--object all-bones contradicts other objects");
    if (by_label && !asked.files.empty()) throw Error("--bone NAME=FILE contradicts objects by label: give one kind");
    if (by_label && options.volume.file.empty()) throw Error("objects by label: their CT is missing: give -v FILE");
    if (by_label && options.volume.labels.empty() && !options.scene.segment_bones) {
        throw Error("objects by label: give the map, --labels FILE, or split the CT by --segment-bones");
    }
    if (options.scene.segment_bones && !options.volume.labels.empty()) {
        throw Error("--segment-bones contradicts --labels: it is for CTs without a map");
    }
    if (options.scene.segment_bones && !by_label) {
        throw Error("--segment-bones is for objects of -v: name them by --object, or all by --object all-bones");
    }
    if (!by_label && !options.volume.file.empty()) throw Error("--bone NAME=FILE contradicts -v: leave -v out");
    if (!by_label && !options.scene.rest.empty() && options.scene.rest != "none") {
        throw Error("--rest is for objects by label: files of bones have no rest");
    }
    if (!options.volume.label.empty()) throw Error("--label contradicts --object and --bone: they name the labels");
    const std::string& rest = options.scene.rest;
    if (!rest.empty() && rest != "body" && rest != "still" && rest != "none") {
        throw bad_value("--rest", rest, "body, still or none");
    }
    for (std::size_t a = 0; a < asked.files.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
            if (lower_case(asked.files[a].first) == lower_case(asked.files[b].first)) {
                throw Error("--bone names " + asked.files[a].first + " twice");
            }
        }
    }
}

std::size_t position_of(const std::string& name, const std::vector<std::string>& names) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) throw bad_value("object of --joint", name, "one of " + joined(names));
    return static_cast<std::size_t>(found - names.begin());
}

}  // namespace

bool is_box(const std::string& text) { return text.starts_with("voxels:") || text.find(',') != std::string::npos; }

NamedFiles named_files(const std::vector<std::string>& arguments, const std::string& option,
                       const std::vector<std::string>& names) {
    NamedFiles files;
    for (const std::string& argument : arguments) {
        const std::size_t equals = argument.find('=');
        const bool is_known =
            equals != std::string::npos && std::ranges::find(names, argument.substr(0, equals)) != names.end();
        std::error_code ignored;
        if (!is_known && (equals == std::string::npos || std::filesystem::exists(argument, ignored))) {
            if (!files.for_all.empty()) throw Error(option + " is given twice for all objects: name them as NAME=FILE");
            files.for_all = argument;
            continue;
        }
        const auto [name, file] = split_named(argument, option);
        if (!is_known) throw bad_value("object of " + option, name, "one of " + joined(names));
        if (!files.of.emplace(name, file).second) throw Error(option + " names " + name + " twice");
    }
    return files;
}

Asked asked_objects(const ObjectOptions& options) {
    Asked asked;
    for (const std::string& object : options.scene.objects) {
        if (is_box(object)) continue;
        if (object == kAllBones) {
            asked.all_bones = true;
            continue;
        }
        check_name(object, "--object");
        asked.labelled.push_back({number_from(object) ? "label_" + object : object, {object}});
    }
    for (const std::string& argument : options.scene.bones) {
        const auto [name, value] = split_named(argument, "--bone", "NAME=FILE or NAME=LABELS");
        check_name(name, "--bone");
        std::error_code ignored;
        if (options.volume.file.empty() || std::filesystem::exists(value, ignored)) {
            asked.files.emplace_back(name, value);
        } else {
            asked.labelled.push_back({name, parse_list(value, "--bone")});
        }
    }
    check_asked(asked, options);
    return asked;
}

std::vector<AskedJoint> asked_joints(const std::vector<std::string>& arguments, const std::vector<std::string>& names) {
    std::vector<AskedJoint> joints;
    for (const std::string& argument : arguments) {
        const std::size_t equals = argument.find('=');
        const std::vector<std::string> ends = parse_list(argument.substr(0, equals), "--joint");
        if (ends.size() != 2) throw bad_value("--joint", argument, "PROXIMAL,DISTAL or PROXIMAL,DISTAL=MM,DEG");
        AskedJoint& joint = joints.emplace_back(AskedJoint{position_of(ends[0], names), position_of(ends[1], names)});
        if (equals == std::string::npos) continue;
        const std::vector<double> limits = parse_numbers(argument.substr(equals + 1), 2, "--joint");
        const bool is_in = limits[0] > 0 && limits[0] <= 100 && limits[1] > 0 && limits[1] <= 90;
        if (!is_in) throw bad_value("limits of --joint", argument, "MM in (0, 100] and DEG in (0, 90]");
        joint.apart_mm = limits[0];
        joint.turned_deg = limits[1];
    }
    return joints;
}

}  // namespace raylign::detail::apps
