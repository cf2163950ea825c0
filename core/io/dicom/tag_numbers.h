#pragma once

#include <cstdint>

/// Elements of DICOM by (group << 16) + element.
namespace raylign::detail::tag {

inline constexpr std::uint32_t kFileClass = 0x00020002, kTransferSyntax = 0x00020010;
inline constexpr std::uint32_t kImageType = 0x00080008, kClass = 0x00080016, kModality = 0x00080060,
                               kSeriesDescription = 0x0008103e, kFrameType = 0x00089007;
inline constexpr std::uint32_t kStudyUid = 0x0020000d, kSeriesUid = 0x0020000e, kSeriesNumber = 0x00200011,
                               kPosition = 0x00200032, kOrientation = 0x00200037, kFrameOfReference = 0x00200052,
                               kStackId = 0x00209056, kTemporalPosition = 0x00209128;
inline constexpr std::uint32_t kSamples = 0x00280002, kPhotometric = 0x00280004, kFrameCount = 0x00280008,
                               kRows = 0x00280010, kColumns = 0x00280011, kPixelSpacing = 0x00280030,
                               kBitsAllocated = 0x00280100, kBitsStored = 0x00280101, kHighBit = 0x00280102,
                               kRepresentation = 0x00280103, kPadding = 0x00280120, kPaddingLimit = 0x00280121,
                               kWindow = 0x00281050, kIntercept = 0x00281052, kSlope = 0x00281053,
                               kRescaleType = 0x00281054, kLutSequence = 0x00283000, kLutDescriptor = 0x00283002,
                               kLutType = 0x00283004, kLutData = 0x00283006, kVoiLut = 0x00283010;
inline constexpr std::uint32_t kPresentationShape = 0x20500020;
inline constexpr std::uint32_t kSharedGroups = 0x52009229, kPerFrameGroups = 0x52009230;
inline constexpr std::uint32_t kOverlayBits = 0x60000100, kOverlayPosition = 0x60000102;
inline constexpr std::uint32_t kPixelData = 0x7fe00010;

}  // namespace raylign::detail::tag
