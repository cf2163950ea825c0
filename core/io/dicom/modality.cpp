#include "core/io/dicom/modality.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/base/error.h"
#include "core/io/dicom/tag_numbers.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// What a SOP class or a modality is good for.
enum class ImageUse { ct, xray, other };

struct ImageKind {
    std::string_view id, name;
    ImageUse use;
};

/// By the end of the SOP class UID, after 1.2.840.10008.5.1.4.1.1.
constexpr std::array<ImageKind, 58> kClasses = {{
    {"1", "computed radiography", ImageUse::xray},
    {"1.1", "digital X-ray", ImageUse::xray},
    {"1.1.1", "digital X-ray", ImageUse::xray},
    {"1.2", "mammography", ImageUse::xray},
    {"1.2.1", "mammography", ImageUse::xray},
    {"1.3", "intra-oral X-ray", ImageUse::xray},
    {"1.3.1", "intra-oral X-ray", ImageUse::xray},
    {"2", "CT", ImageUse::ct},
    {"2.1", "enhanced CT", ImageUse::ct},
    {"2.2", "converted enhanced CT", ImageUse::ct},
    {"3.1", "ultrasound", ImageUse::other},
    {"4", "MR", ImageUse::other},
    {"4.1", "enhanced MR", ImageUse::other},
    {"4.2", "MR spectroscopy", ImageUse::other},
    {"4.3", "enhanced MR", ImageUse::other},
    {"4.4", "converted enhanced MR", ImageUse::other},
    {"6.1", "ultrasound", ImageUse::other},
    {"6.2", "enhanced ultrasound volume", ImageUse::other},
    {"7", "secondary capture", ImageUse::xray},
    {"7.1", "secondary capture", ImageUse::xray},
    {"7.2", "secondary capture", ImageUse::xray},
    {"7.3", "secondary capture", ImageUse::xray},
    {"7.4", "secondary capture", ImageUse::xray},
    {"11.1", "presentation state", ImageUse::other},
    {"12.1", "X-ray angiography", ImageUse::xray},
    {"12.1.1", "enhanced X-ray angiography", ImageUse::xray},
    {"12.2", "X-ray fluoroscopy", ImageUse::xray},
    {"12.2.1", "enhanced X-ray fluoroscopy", ImageUse::xray},
    {"13.1.1", "X-ray 3D angiography", ImageUse::ct},
    {"13.1.2", "X-ray 3D craniofacial", ImageUse::ct},
    {"13.1.3", "breast tomosynthesis", ImageUse::other},
    {"20", "nuclear medicine", ImageUse::other},
    {"30", "parametric map", ImageUse::other},
    {"66", "raw data", ImageUse::other},
    {"66.1", "spatial registration", ImageUse::other},
    {"66.3", "deformable spatial registration", ImageUse::other},
    {"66.4", "segmentation", ImageUse::other},
    {"66.5", "surface segmentation", ImageUse::other},
    {"77.1.1", "endoscopy", ImageUse::other},
    {"77.1.1.1", "endoscopy video", ImageUse::other},
    {"77.1.2", "microscopy", ImageUse::other},
    {"77.1.3", "microscopy", ImageUse::other},
    {"77.1.4", "photography", ImageUse::other},
    {"77.1.5.1", "ophthalmic photography", ImageUse::other},
    {"77.1.5.4", "ophthalmic tomography", ImageUse::other},
    {"77.1.6", "whole slide microscopy", ImageUse::other},
    {"88.11", "basic text report", ImageUse::other},
    {"104.1", "encapsulated PDF", ImageUse::other},
    {"128", "PET", ImageUse::other},
    {"128.1", "converted enhanced PET", ImageUse::other},
    {"130", "enhanced PET", ImageUse::other},
    {"481.1", "RT image", ImageUse::xray},
    {"481.2", "RT dose", ImageUse::other},
    {"481.3", "RT structure set", ImageUse::other},
    {"481.5", "RT plan", ImageUse::other},
    {"481.8", "RT ion plan", ImageUse::other},
    {"501.1", "luggage CT", ImageUse::ct},
    {"501.3", "threat detection report", ImageUse::other},
}};

constexpr std::array<ImageKind, 25> kModalities = {{
    {"CT", "CT", ImageUse::ct},
    {"CR", "computed radiography", ImageUse::xray},
    {"DX", "digital X-ray", ImageUse::xray},
    {"IO", "intra-oral X-ray", ImageUse::xray},
    {"MG", "mammography", ImageUse::xray},
    {"PX", "panoramic X-ray", ImageUse::xray},
    {"RF", "X-ray fluoroscopy", ImageUse::xray},
    {"RG", "radiography", ImageUse::xray},
    {"RTIMAGE", "RT image", ImageUse::xray},
    {"XA", "X-ray angiography", ImageUse::xray},
    {"ES", "endoscopy", ImageUse::other},
    {"GM", "microscopy", ImageUse::other},
    {"MR", "MR", ImageUse::other},
    {"NM", "nuclear medicine", ImageUse::other},
    {"OCT", "optical tomography", ImageUse::other},
    {"OP", "ophthalmic photography", ImageUse::other},
    {"OPT", "ophthalmic tomography", ImageUse::other},
    {"PT", "PET", ImageUse::other},
    {"RTDOSE", "RT dose", ImageUse::other},
    {"SEG", "segmentation", ImageUse::other},
    {"SM", "whole slide microscopy", ImageUse::other},
    {"SR", "report", ImageUse::other},
    {"US", "ultrasound", ImageUse::other},
    {"IVUS", "intravascular ultrasound", ImageUse::other},
    {"XC", "photography", ImageUse::other},
}};

constexpr std::string_view kStorage = "1.2.840.10008.5.1.4.1.1.";

template <std::size_t N>
const ImageKind* kind_of(const std::array<ImageKind, N>& kinds, std::string_view id) {
    const auto found = std::ranges::find(kinds, id, &ImageKind::id);
    return found == kinds.end() ? nullptr : &*found;
}

const ImageKind* class_of(const DicomTags& tags) {
    const std::string uid = sop_class_of(tags);
    if (!uid.starts_with(kStorage)) return nullptr;
    return kind_of(kClasses, std::string_view(uid).substr(kStorage.size()));
}

/// What the file says that it is, where that is known. A secondary capture says by its modality what it shows.
const ImageKind* contradicting(const DicomTags& tags, ImageUse wanted) {
    const ImageKind* const by_class = class_of(tags);
    if (by_class != nullptr && by_class->use != wanted) return by_class;
    const ImageKind* const by_modality = kind_of(kModalities, tags.text(tag::kModality));
    // A volume reconstructed by a C-arm has the C-arm's modality.
    const bool is_told_by_class = by_class != nullptr && by_class->id.starts_with("13.");
    return by_modality != nullptr && by_modality->use != wanted && !is_told_by_class ? by_modality : nullptr;
}

std::string found_text(const ImageKind& kind, const DicomTags& tags) {
    return std::string(kind.name) + " (SOPClassUID " + sop_class_of(tags) + ", Modality (0008,0060) " +
           tags.text(tag::kModality) + ")";
}

}  // namespace

std::string sop_class_of(const DicomTags& tags) {
    return tags.text(tag::kClass).empty() ? tags.text(tag::kFileClass) : tags.text(tag::kClass);
}

std::string why_no_ct(const DicomTags& tags, const std::string& where) {
    const ImageKind* const found = contradicting(tags, ImageUse::ct);
    if (found == nullptr) return {};
    return bad_value("kind of image", found_text(*found, tags),
                     "CT, since its values become attenuation (if they are HU all the same, convert the file to NIfTI "
                     "or MHA)",
                     where)
        .what();
}

void check_is_xray(const DicomTags& tags, const std::string& where) {
    if (const ImageKind* const found = contradicting(tags, ImageUse::xray)) {
        throw bad_value("kind of image", found_text(*found, tags),
                        "an X-ray: XA, RF, DX, CR, RT image or a secondary capture of one (if it is one all the same, "
                        "convert the file to TIFF or PNG)",
                        where);
    }
}

bool is_localizer(const DicomTags& tags) {
    const std::string type = tags.text(tag::kImageType) + '\\' + tags.text(tag::kFrameType);
    return std::ranges::any_of(split(type, '\\'), [](std::string_view part) {
        return trimmed(part) == "LOCALIZER" || trimmed(part) == "SCOUT";
    });
}

bool must_have_pixels(const DicomTags& tags) {
    const std::string uid = sop_class_of(tags);
    const ImageKind* const kind = class_of(tags);
    return uid.empty() || (kind != nullptr && kind->use == ImageUse::ct);
}

}  // namespace raylign::detail
