#include "core/io/images/quiet_itk.h"

#include <H5Epublic.h>
#include <gdcmTrace.h>
#include <itkObject.h>

#include <iostream>
#include <sstream>

namespace raylign::detail {
namespace {

std::string one_line(const std::string& text) {
    std::istringstream words(text);
    std::string line, word;
    while (words >> word) line += (line.empty() ? "" : " ") + word;
    return line;
}

}  // namespace

struct QuietItk::State {
    std::ostringstream captured;
    std::streambuf* cerr_buffer = std::cerr.rdbuf();
    bool itk_warnings = itk::Object::GetGlobalWarningDisplay();
    bool gdcm_debug = gdcm::Trace::GetDebugFlag();
    bool gdcm_warning = gdcm::Trace::GetWarningFlag();
    bool gdcm_error = gdcm::Trace::GetErrorFlag();
    H5E_auto2_t hdf5_handler = nullptr;
    void* hdf5_data = nullptr;
};

QuietItk::QuietItk() : state_(std::make_unique<State>()) {
    std::cerr.rdbuf(state_->captured.rdbuf());
    itk::Object::SetGlobalWarningDisplay(false);
    gdcm::Trace::SetDebug(false);
    gdcm::Trace::SetWarning(false);
    gdcm::Trace::SetError(false);
    H5Eget_auto2(H5E_DEFAULT, &state_->hdf5_handler, &state_->hdf5_data);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

QuietItk::~QuietItk() {
    std::cerr.rdbuf(state_->cerr_buffer);
    itk::Object::SetGlobalWarningDisplay(state_->itk_warnings);
    gdcm::Trace::SetDebug(state_->gdcm_debug);
    gdcm::Trace::SetWarning(state_->gdcm_warning);
    gdcm::Trace::SetError(state_->gdcm_error);
    H5Eset_auto2(H5E_DEFAULT, state_->hdf5_handler, state_->hdf5_data);
}

std::string QuietItk::text() const { return one_line(state_->captured.str()); }

std::string reason_of(const itk::ExceptionObject& failure) {
    std::string reason = one_line(failure.GetDescription());
    // "itk::ERROR: NiftiImageIO(0x55d0c8a3b2f0): ..." : the address changes from run to run and tells nobody anything.
    const std::size_t prefix = reason.find("): ");
    if (reason.starts_with("ITK ERROR: ") || reason.starts_with("itk::ERROR: ")) {
        reason = reason.substr(prefix == std::string::npos ? reason.find(": ") + 2 : prefix + 3);
    }
    return reason;
}

}  // namespace raylign::detail
