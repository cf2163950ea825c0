#include "apps/shared/lines.h"
#include "apps/study/report.h"

namespace raylign::detail::apps {
namespace {

constexpr int kNameWidth = 14;

std::string share_text(const Proportion& p) {
    return format("%zu of %zu (%.0f %%, %.0f-%.0f)", p.successes, p.trials, 100 * p.rate, 100 * p.low, 100 * p.high);
}

std::string percentiles_line(const char* name, const Percentiles& p, const char* unit) {
    return line(name,
                format(" p50 %.3g  p75 %.3g  p95 %.3g  p99 %.3g  max %.3g %s", p.p50, p.p75, p.p95, p.p99, p.max, unit),
                kNameWidth);
}

std::string case_summary(const Study& study, const StudyJournal& journal, std::size_t study_case) {
    const std::vector<TrialOutcome> outcomes = outcomes_of_case(journal, study_case);
    const std::vector<IntervalSuccess> intervals = successes_per_interval(study.intervals, outcomes);
    const StudySummary all = summarise(outcomes);
    std::string text = case_label(study.cases[study_case]) + "\n";
    text += line("success",
                 format(" %s, capture range %.0f mm", share_text(all.success).c_str(), capture_range_mm(intervals)),
                 kNameWidth);
    text += percentiles_line("mTRE", all.mtre_mm, "mm");
    text += percentiles_line("mRPD", all.mrpd_mm, "mm");
    text += percentiles_line("in-plane", all.in_plane_mm, "mm");
    text += percentiles_line("depth", all.depth_mm, "mm");
    text += percentiles_line("rotation", all.rotation_deg, "deg");
    text += percentiles_line("time", all.time_s, "s");
    text += percentiles_line("evaluations", all.evaluations, "");
    text += percentiles_line("linearizations", all.linearizations, "");
    text +=
        line("verdict", format(" %zu undetected failures, %zu false alarms", all.undetected_failures, all.false_alarms),
             kNameWidth);
    if (all.within_twice_expected.trials > 0) {
        text += line("expected",
                     format(" true error below twice the expected one in %s believed",
                            share_text(all.within_twice_expected).c_str()),
                     kNameWidth);
    }
    for (const IntervalSuccess& i : intervals) {
        text += format("  %5.1f-%-5.1f mm  %s\n", i.low_mm, i.high_mm,
                       share_text(wilson_interval(i.successes, i.trials)).c_str());
    }
    return text;
}

}  // namespace

std::string study_summary(const Study& study, const StudyJournal& journal) {
    std::string text;
    if (!study.options.detector.is_ideal()) text += "X-rays: " + study.simulation + "\n";
    for (std::size_t c = 0; c < study.cases.size(); ++c) text += case_summary(study, journal, c);
    for (const LeftOut& left_out : study.left_out) text += "left out: " + left_out.name + ": " + left_out.reason + "\n";
    return text;
}

}  // namespace raylign::detail::apps
