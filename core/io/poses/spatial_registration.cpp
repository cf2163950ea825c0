#include "core/io/poses/spatial_registration.h"

#include "core/base/error.h"
#include "core/io/dicom/dicom_file.h"
#include "core/io/dicom/dicom_values.h"
#include "core/io/dicom/dicom_writer.h"
#include "core/io/dicom/modality.h"
#include "core/io/dicom/tag_numbers.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

constexpr std::uint32_t kRegistrations = 0x00700308, kMatrixRegistrations = 0x00700309, kMatrices = 0x0070030a,
                        kMatrixType = 0x0070030c, kTransformation = 0x300600c6;
constexpr const char* kRegistrationClass = "1.2.840.10008.5.1.4.1.1.66.1";

/// One item of the object: registered_from_frame.
struct FrameRegistration {
    std::string frame;
    RigidTransform registered_from_frame;
};

FrameRegistration registration_of(const DicomTags& item, const std::string& where) {
    const DicomTags* const registration = item.item(kMatrixRegistrations);
    const auto matrices = registration == nullptr                   ? std::vector<DicomTags>()
                          : registration->items.contains(kMatrices) ? registration->items.at(kMatrices)
                                                                    : std::vector<DicomTags>();
    if (matrices.size() != 1) {
        throw bad_value("matrices of an item of Registration Sequence (0070,0308)", std::to_string(matrices.size()),
                        "1", where);
    }
    const std::string type = matrices[0].text(kMatrixType);
    if (type != "RIGID") {
        throw bad_value("FrameOfReferenceTransformationMatrixType (0070,030C)", type, "RIGID", where);
    }
    const std::vector<double> numbers = matrices[0].numbers(kTransformation, 16);
    if (numbers.empty()) {
        throw bad_value("FrameOfReferenceTransformationMatrix (3006,00C6)", matrices[0].text(kTransformation),
                        "16 finite numbers", where);
    }
    Eigen::Matrix4d matrix;
    for (int i = 0; i < 16; ++i) matrix(i / 4, i % 4) = numbers[static_cast<std::size_t>(i)];
    return {item.text(tag::kFrameOfReference), rigid_from_matrix(matrix, where)};
}

/// The one item that is not the object's own frame.
FrameRegistration moved_frame(const DicomTags& tags, const std::string& where) {
    const std::string registered = tags.text(tag::kFrameOfReference);
    std::vector<FrameRegistration> moved;
    const auto found = tags.items.find(kRegistrations);
    if (found != tags.items.end()) {
        for (const DicomTags& item : found->second) {
            FrameRegistration registration = registration_of(item, where);
            if (registration.frame != registered) moved.push_back(std::move(registration));
        }
    }
    if (moved.size() == 1) return moved.front();
    throw bad_value("registered frames of reference", std::to_string(moved.size()),
                    "1 beside the object's own, " + registered, where);
}

std::string matrix_text(const RigidTransform& transform) {
    const Eigen::Matrix4d matrix = to_matrix(transform);
    std::string text;
    for (int i = 0; i < 16; ++i) text += (i > 0 ? "\\" : "") + decimal_string(matrix(i / 4, i % 4));
    return text;
}

DicomWriter registration_item(const std::string& frame, const RigidTransform& registered_from_frame) {
    DicomWriter matrix, registration, item;
    matrix.text(kMatrixType, "CS", "RIGID").text(kTransformation, "DS", matrix_text(registered_from_frame));
    registration.sequence(kMatrices, {matrix}).sequence(0x0070030d, {});
    return item.text(tag::kFrameOfReference, "UI", frame).sequence(kMatrixRegistrations, {registration});
}

}  // namespace

RigidTransform read_spatial_registration(const std::filesystem::path& path, const std::filesystem::path& ct) {
    const DicomTags tags = open_dicom(path).tags;
    if (sop_class_of(tags) != kRegistrationClass) {
        throw bad_value("SOPClassUID (0008,0016)", sop_class_of(tags),
                        std::string("a Spatial Registration's, ") + kRegistrationClass + ", for a pose", path.string());
    }
    const FrameRegistration moved = moved_frame(tags, path.string());
    const std::string ct_frame = ct.empty() ? "" : open_dicom(ct).tags.text(tag::kFrameOfReference);
    const std::string registered = tags.text(tag::kFrameOfReference);
    if (ct_frame.empty() || ct_frame == moved.frame) return moved.registered_from_frame;
    if (ct_frame == registered) return inverse(moved.registered_from_frame);
    throw Error("frames of reference " + moved.frame + " and " + registered + " in " + path.string() +
                ": one must be the CT's, " + ct_frame + " (" + ct.string() + ")");
}

std::string dicom_frame_of_reference(const std::filesystem::path& path) {
    const std::optional<DicomTags> tags = read_dicom_tags(path);
    return tags ? tags->text(tag::kFrameOfReference) : std::string();
}

std::string spatial_registration(const RigidTransform& world_from_ct, const std::filesystem::path& ct) {
    const DicomTags tags = open_dicom(ct).tags;
    const std::string ct_frame = tags.text(tag::kFrameOfReference);
    if (ct_frame.empty()) throw Error("FrameOfReferenceUID (0020,0052) is missing in " + ct.string());
    const std::string name = ct_frame + " " + matrix_text(world_from_ct);
    const std::string instance = uid_of("registration " + name), world = uid_of("world " + name);
    const auto copied = [&](DicomWriter& writer, std::uint32_t tag, const char* vr) {
        writer.text(tag, vr, tags.text(tag));
    };
    DicomWriter writer;
    copied(writer, 0x00080005, "CS");  // the character set of what is copied
    writer.text(tag::kClass, "UI", kRegistrationClass).text(0x00080018, "UI", instance);
    copied(writer, 0x00080020, "DA");
    writer.text(0x00080023, "DA", utc_now("%Y%m%d"));
    copied(writer, 0x00080030, "TM");
    writer.text(0x00080033, "TM", utc_now("%H%M%S"));
    copied(writer, 0x00080050, "SH");
    writer.text(tag::kModality, "CS", "REG").text(0x00080070, "LO", "raylign");
    copied(writer, 0x00080090, "PN");
    writer.text(tag::kSeriesDescription, "LO", "raylign: world from CT");
    copied(writer, 0x00100010, "PN");
    copied(writer, 0x00100020, "LO");
    copied(writer, 0x00100030, "DA");
    copied(writer, 0x00100040, "CS");
    writer.text(tag::kStudyUid, "UI",
                tags.text(tag::kStudyUid).empty() ? uid_of("study " + name) : tags.text(tag::kStudyUid));
    writer.text(tag::kSeriesUid, "UI", uid_of("series " + name));
    copied(writer, 0x00200010, "SH");
    writer.text(tag::kSeriesNumber, "IS", "1").text(0x00200013, "IS", "1");
    writer.text(tag::kFrameOfReference, "UI", world).text(0x00201040, "LO", "");
    writer.text(0x00700080, "CS", "WORLD_FROM_CT").text(0x00700081, "LO", "maps the CT's frame to the world's");
    writer.text(0x00700084, "PN", "raylign");
    writer.sequence(kRegistrations,
                    {registration_item(world, RigidTransform()), registration_item(ct_frame, world_from_ct)});
    return writer.file(kRegistrationClass, instance, "1.2.840.10008.1.2.1");
}

}  // namespace raylign::detail
