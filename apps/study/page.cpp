#include <algorithm>

#include "apps/report_page/report_page.h"
#include "apps/shared/lines.h"
#include "apps/study/report.h"
#include "core/base/error.h"

namespace raylign::detail::apps {
namespace {

constexpr std::size_t kMostPictures = 6;  // a page should stay light

const TrialRecord* worst_of_case(const StudyJournal& journal, std::size_t study_case) {
    const TrialRecord* worst = nullptr;
    for (const auto& [number, record] : journal.trials()) {
        if (record.study_case != study_case) continue;
        if (worst == nullptr || record.final_mtre_mm > worst->final_mtre_mm) worst = &record;
    }
    return worst;
}

PageOverlay picture_of(const Study& study, const TrialRecord& record, const std::filesystem::path& scratch) {
    const StudyCase& study_case = study.cases[record.study_case];
    const View view = trial_views(study, study_case, record.seed).front();
    const auto session = study.backends[record.study_case]->prepare(
        {volume_of(study, study_case), {&view, 1}, render_settings(study.options.backend), {}});
    const RigidTransform start = start_of_trial(study, trial_place(study, record.trial)).world_from_ct;
    return page_overlay(case_label(study_case) + ": trial " + std::to_string(record.trial) +
                            format(", %.3g mm mTRE", record.final_mtre_mm),
                        view, session->render(start, 0), session->render(record.world_from_ct, 0), scratch);
}

}  // namespace

std::string study_page(const Study& study, const StudyJournal& journal, const Invocation& invocation,
                       const std::filesystem::path& scratch) {
    std::vector<PageOverlay> pictures;
    for (std::size_t c = 0; c < std::min(study.cases.size(), kMostPictures); ++c) {
        const TrialRecord* worst = worst_of_case(journal, c);
        if (worst == nullptr || !worst->error.empty()) continue;
        pictures.push_back(picture_of(study, *worst, scratch));
    }
    return report_page("study", study_json(study, journal, invocation), pictures, {{"trials", trials_json(journal)}});
}

}  // namespace raylign::detail::apps
