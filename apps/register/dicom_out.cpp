#include "apps/register/dicom_out.h"

#include "apps/shared/json_text.h"
#include "apps/shared/outputs.h"
#include "core/base/text.h"
#include "core/io/dicom/secondary_capture.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

std::string overlay_dicom(const std::string& view) { return "overlay_" + view + ".dcm"; }
std::string drr_dicom(const std::string& view) { return "drr_" + view + ".dcm"; }

/// DICOM's texts have a longest length, and no character set of their own here.
std::string short_ascii(const std::string& text) {
    constexpr std::size_t kMost = 1000;
    std::string result;
    for (const char c : text.substr(0, kMost)) result += c >= 32 && c < 127 && c != '\\' ? c : '?';
    return result;
}

}  // namespace

DicomOut::DicomOut(const std::filesystem::path& folder, const std::vector<View>& views,
                   const std::vector<std::filesystem::path>& inputs)
    : inputs_(inputs) {
    if (folder.empty()) return;
    std::vector<std::string> names;
    for (const View& view : views) {
        names.push_back(overlay_dicom(view.name));
        names.push_back(drr_dicom(view.name));
    }
    refuse_to_overwrite(inputs, folder, names);
    folder_ = std::make_unique<OutputFolder>(folder);
}

void DicomOut::stage(const View& view, const ViewOrigin& origin, const RgbImage& overlay, const Image& drr,
                     const ResultTexts& result) {
    if (!folder_) return;
    std::vector<std::filesystem::path> files{origin.image};
    files.insert(files.end(), inputs_.begin(), inputs_.end());
    const std::filesystem::path source = dicom_study_file(files);
    const std::string by = "raylign " RAYLIGN_VERSION ", 2-D/3-D registration of a CT with X-rays. ";
    CaptureTexts texts{.series = "raylign: registration, not for diagnosis",
                       .derivation = by + "Contours of the CT's DRR (orange) and of the X-ray (blue) over the X-ray " +
                                     view.name + ", at the start and as found.",
                       .comment = short_ascii("NOT FOR DIAGNOSIS. Verdict: " + result.verdict),
                       .series_seed = result.poses + result.verdict,
                       .instance = ++staged_};
    write_text(folder_->stage(overlay_dicom(view.name)), secondary_capture(texts, overlay, source));
    texts.derivation = by + "DRR of the CT in the view " + view.name + ", as found: line integrals of the attenuation.";
    texts.instance = ++staged_;
    write_text(folder_->stage(drr_dicom(view.name)), secondary_capture(texts, drr, source));
}

void DicomOut::commit() {
    if (folder_) folder_->commit();
}

ResultTexts result_texts(bool is_ok, const std::vector<std::string>& reasons,
                         std::span<const RigidTransform> world_from_ct) {
    ResultTexts texts{is_ok ? "ok" : "DOUBTFUL: " + joined(reasons, "; "), {}};
    for (const RigidTransform& pose : world_from_ct) texts.poses += one_line(matrix_json(pose));
    return texts;
}

}  // namespace raylign::detail::apps
