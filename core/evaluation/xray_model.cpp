#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/error.h"
#include "core/base/text.h"
#include "raylign/xray.h"

namespace raylign {
using namespace detail;
namespace {

struct Ranged {
    const char* name;
    double value, low, high;
    bool may_be_zero = true;
};

void check_ranges(const XrayModel& m, std::string_view where) {
    const Ranged values[] = {{"photons_per_mm2", m.photons_per_mm2, 1, 1e9},
                             {"focal_spot_mm", m.focal_spot_mm, 0, 5},
                             {"scatter_ratio", m.scatter_ratio, 0, 5},
                             {"scatter_near_mm", m.scatter_near_mm, 1, 500, false},
                             {"scatter_far_mm", m.scatter_far_mm, 1, 500, false},
                             {"scatter_far_share", m.scatter_far_share, 0, 1},
                             {"blade_share.x", m.blade_share.x(), 0, 0.4},
                             {"blade_share.y", m.blade_share.y(), 0, 0.4},
                             {"round_field_share", m.round_field_share, 0.5, 1.5},
                             {"marker_share", m.marker_share, 0, 0.1},
                             {"ramp", m.ramp, 0, 1},
                             {"blur_mm", m.blur_mm, 0, 5},
                             {"vignetting", m.vignetting, 0, 0.9},
                             {"electronic_noise", m.electronic_noise, 0, 0.1},
                             {"full_scale", m.full_scale, 0.05, 20, m.bits == 0},
                             {"floor_share", m.floor_share, 0, 0.5},
                             {"bits", static_cast<double>(m.bits), 8, 16}};
    for (const Ranged& v : values) {
        if (v.may_be_zero && v.value == 0) continue;
        if (v.value >= v.low && v.value <= v.high) continue;
        const bool says_zero = v.may_be_zero && v.low > 0;
        throw bad_value(v.name, text_of(v.value), text_of(says_zero ? "0 or " : "", "in [", v.low, ", ", v.high, "]"),
                        where);
    }
}

void check_spectrum(const std::vector<SpectrumLine>& spectrum, std::string_view where) {
    if (spectrum.empty()) throw bad_value("spectrum", "no energies", "at least one energy and its weight", where);
    double sum = 0;
    for (std::size_t i = 0; i < spectrum.size(); ++i) {
        const std::string name = text_of("spectrum[", i, "].");
        const SpectrumLine& line = spectrum[i];
        if (!(line.energy_kev >= 10 && line.energy_kev <= 150)) {
            throw bad_value(name + "energy_kev", text_of(line.energy_kev), "in [10, 150]", where);
        }
        if (!(line.weight > 0 && line.weight <= 1.01)) {
            throw bad_value(name + "weight", text_of(line.weight), "positive and at most 1", where);
        }
        sum += line.weight;
    }
    if (std::abs(sum - 1) > 0.01) throw bad_value("sum of the spectrum's weights", text_of(sum), "1 within 1 %", where);
}

// Spectra: bremsstrahlung by Kramers' law, (kVp - e) / e photons per keV [Kramers23], through aluminium and copper
// [Hubbell95], summed over bins of 10 keV from 20 on at their mean energies; without the anode's own lines and
// absorption.
// Photons: 30174 per mm2 and uGy of RQA5 (IEC 62220-1:2003), times the dose of one image behind the body, times 100:
// 20 cm of tissue let 1 in 100 through.
// Scatter: over primary about 1 behind 20 cm of tissue (line integral 4.5) with a grid, 3 to 4 without, less across an
// air gap; kernels of some cm [Seibert88].
// Blur: light spread of CsI: 10 % of the contrast left at 3 cycles/mm (flat panels), 1 (image intensifiers, screens).

XrayModel mobile_c_arm() {
    XrayModel m;
    m.name = "c-arm";
    m.source =
        "mobile C-arm with image intensifier: Kramers 75 kVp, 4 mm Al + 0.2 mm Cu; 0.2 uGy an image behind the body "
        "(30174 photons/mm2/uGy, RQA5); grid; 0.6 mm focal spot; air saturates, as automatic exposure sets the body; "
        "lens and video losses are chosen";
    m.spectrum = {{28, 0.027}, {36, 0.209}, {45, 0.329}, {55, 0.274}, {64, 0.143}, {72, 0.018}};
    m.photons_per_mm2 = 6e5;
    m.focal_spot_mm = 0.6;
    m.scatter_ratio = 0.25;
    m.round_field_share = 0.97;
    m.marker_share = 0.04;
    m.ramp = 0.08;
    m.blur_mm = blur_from_mtf10_mm(1);
    m.vignetting = 0.25;
    m.electronic_noise = 0.001;
    m.full_scale = 0.6;
    m.floor_share = 0.02;
    m.bits = 10;
    return m;
}

XrayModel biplane_laboratory() {
    XrayModel m;
    m.name = "biplane-lab";
    m.source =
        "motion laboratory, image intensifiers and high-speed cameras: Kramers 70 kVp, 3 mm Al; 0.05 uGy a frame "
        "behind the body; no grid, air gap; 0.6 mm focal spot; 8 bits; lens and video losses are chosen";
    m.spectrum = {{26, 0.243}, {35, 0.334}, {45, 0.247}, {54, 0.136}, {63, 0.040}};
    m.photons_per_mm2 = 1.5e5;
    m.focal_spot_mm = 0.6;
    m.scatter_ratio = 0.35;
    m.scatter_near_mm = 20;
    m.scatter_far_mm = 80;
    m.round_field_share = 0.95;
    m.ramp = 0.1;
    m.blur_mm = blur_from_mtf10_mm(0.8);
    m.vignetting = 0.3;
    m.electronic_noise = 0.003;
    m.full_scale = 0.4;
    m.floor_share = 0.02;
    m.bits = 8;
    return m;
}

XrayModel flat_panel() {
    XrayModel m;
    m.name = "flat-panel";
    m.source =
        "angiography or radiography with a CsI flat panel: Kramers 90 kVp, 3 mm Al + 0.1 mm Cu; 1 uGy an image behind "
        "the body; grid; 1 mm focal spot; 14 bits without saturation, flat field corrected to 2 % (chosen)";
    m.spectrum = {{27, 0.066}, {35, 0.220}, {45, 0.257}, {55, 0.210}, {65, 0.143}, {74, 0.080}, {83, 0.024}};
    m.photons_per_mm2 = 3e6;
    m.focal_spot_mm = 1;
    m.scatter_ratio = 0.2;
    m.blade_share = {0.04, 0.03};
    m.marker_share = 0.04;
    m.ramp = 0.02;
    m.blur_mm = blur_from_mtf10_mm(3);
    m.electronic_noise = 0.0002;
    m.full_scale = 1.25;
    m.floor_share = 0.002;
    m.bits = 14;
    return m;
}

}  // namespace

double blur_from_mtf10_mm(double cycles_per_mm) {
    if (!(cycles_per_mm > 0 && std::isfinite(cycles_per_mm))) {
        throw bad_value("frequency of 10 % modulation transfer", text_of(cycles_per_mm) + " cycles/mm", "positive");
    }
    return std::sqrt(std::numbers::ln10 / 2) / (std::numbers::pi * cycles_per_mm);
}

std::span<const XrayModel> xray_models() {
    static const std::array<XrayModel, 4> models{XrayModel{.source = "none: the line integral itself"}, mobile_c_arm(),
                                                 biplane_laboratory(), flat_panel()};
    return models;
}

const XrayModel& xray_model(std::string_view name) {
    for (const XrayModel& model : xray_models()) {
        if (model.name == name) return model;
    }
    throw bad_value("X-ray model", name, "one of " + joined(xray_models(), &XrayModel::name, ", "));
}

void check_xray_model(const XrayModel& model, std::string_view where) {
    check_spectrum(model.spectrum, where);
    check_ranges(model, where);
}

}  // namespace raylign
