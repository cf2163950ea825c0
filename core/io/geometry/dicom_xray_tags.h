#pragma once

#include <cstdint>
#include <string_view>

// The tags of X-rays that say where they were taken, with the names that error messages give them.
namespace raylign::detail::xray {

struct Tag {
    std::uint32_t id;
    const char* name;
};
inline constexpr Tag kSdd{0x00181110, "DistanceSourceToDetector (0018,1110)"};
inline constexpr Tag kSpd{0x00181111, "DistanceSourceToPatient (0018,1111)"};
inline constexpr Tag kSid{0x00189402, "DistanceSourceToIsocenter (0018,9402)"};
inline constexpr Tag kMagnification{0x00181114, "EstimatedRadiographicMagnificationFactor (0018,1114)"};
inline constexpr Tag kPitch{0x00181164, "ImagerPixelSpacing (0018,1164)"};
inline constexpr Tag kPrimary{0x00181510, "PositionerPrimaryAngle (0018,1510)"};
inline constexpr Tag kSecondary{0x00181511, "PositionerSecondaryAngle (0018,1511)"};
inline constexpr Tag kPrimaryIncrement{0x00181520, "PositionerPrimaryAngleIncrement (0018,1520)"};
inline constexpr Tag kSecondaryIncrement{0x00181521, "PositionerSecondaryAngleIncrement (0018,1521)"};
inline constexpr Tag kViewPosition{0x00185101, "ViewPosition (0018,5101)"};
inline constexpr Tag kRows{0x00280010, "Rows (0028,0010)"};
inline constexpr Tag kColumns{0x00280011, "Columns (0028,0011)"};
inline constexpr Tag kFrames{0x00280008, "NumberOfFrames (0028,0008)"};
inline constexpr Tag kActiveOrigin{0x00187028, "DetectorActiveOrigin (0018,7028)"};
inline constexpr Tag kActiveDimensions{0x00187026, "DetectorActiveDimensions (0018,7026)"};
inline constexpr Tag kElementSpacing{0x00187022, "DetectorElementSpacing (0018,7022)"};
inline constexpr Tag kFieldOrigin{0x00187030, "FieldOfViewOrigin (0018,7030)"};
inline constexpr Tag kFieldRotation{0x00187032, "FieldOfViewRotation (0018,7032)"};
inline constexpr Tag kFieldFlip{0x00187034, "FieldOfViewHorizontalFlip (0018,7034)"};
inline constexpr Tag kPatientOrientation{0x00200020, "PatientOrientation (0020,0020)"};

inline constexpr std::string_view kRtImage = "1.2.840.10008.5.1.4.1.1.481.1";

}  // namespace raylign::detail::xray
