#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/io/files/output.h"
#include "core/io/images/png.h"
#include "raylign/image.h"
#include "raylign/io/views.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"

namespace raylign::detail::apps {

/// What all pictures of one result tell.
struct ResultTexts {
    std::string verdict;  ///< as a person is to read it beside the picture
    std::string poses;    ///< the same for the same result
};
[[nodiscard]] ResultTexts result_texts(bool is_ok, const std::vector<std::string>& reasons,
                                       std::span<const RigidTransform> world_from_ct);

/// --dicom-out: overlay and DRR of each view as DICOM Secondary Captures of the patient's study, which is that of the
/// X-ray, or else of the CT, where one of them is DICOM. Without a folder all of it does nothing.
class DicomOut {
public:
    /// Throws Error where the folder cannot be written or a file would replace one of the inputs.
    DicomOut(const std::filesystem::path& folder, const std::vector<View>& views,
             const std::vector<std::filesystem::path>& inputs);

    void stage(const View& view, const ViewOrigin& origin, const RgbImage& overlay, const Image& drr,
               const ResultTexts& result);
    void commit();

private:
    std::unique_ptr<OutputFolder> folder_;
    std::vector<std::filesystem::path> inputs_;
    int staged_ = 0;
};

}  // namespace raylign::detail::apps
