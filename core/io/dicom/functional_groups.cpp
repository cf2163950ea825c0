#include "core/io/dicom/functional_groups.h"

#include "core/base/error.h"
#include "core/io/dicom/tag_numbers.h"

namespace raylign::detail {
namespace {

/// The values of a group's macros, each a sequence of one item, and of the sequences within.
void overlay(const DicomTags& from, DicomTags& to) {
    for (const auto& [tag, value] : from.values) to.values[tag] = value;
    for (const auto& [tag, items] : from.items) {
        if (!items.empty()) overlay(items.front(), to);
    }
}

}  // namespace

bool has_functional_groups(const DicomTags& tags) { return tags.items.contains(tag::kPerFrameGroups); }

DicomTags tags_of_frame(const DicomTags& tags, int frame, const std::string& where) {
    DicomTags result;
    result.values = tags.values;
    result.has_pixels = tags.has_pixels;
    for (const auto& [tag, items] : tags.items) {
        if (tag != tag::kSharedGroups && tag != tag::kPerFrameGroups) result.items[tag] = items;
    }
    if (const DicomTags* const shared = tags.item(tag::kSharedGroups)) overlay(*shared, result);
    const auto groups = tags.items.find(tag::kPerFrameGroups);
    if (groups == tags.items.end()) return result;
    if (static_cast<std::size_t>(frame) >= groups->second.size()) {
        throw bad_value("items of Per-frame Functional Groups (5200,9230)", std::to_string(groups->second.size()),
                        "as many as frames", where);
    }
    overlay(groups->second[static_cast<std::size_t>(frame)], result);
    return result;
}

}  // namespace raylign::detail
