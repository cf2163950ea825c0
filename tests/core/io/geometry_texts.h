#pragma once

#include <string>

#include "raylign/io/geometry.h"
#include "views_text.h"

namespace raylign::detail::test {

inline const std::string kMayaCam2 =
    "image size\n120,100\n\ncamera matrix\n2000,0,61\n0,2100,48\n0,0,1\n\nrotation\n0,0,1\n-1,0,0\n0,-1,0\n\n"
    "translation\n5\n-7\n900\n";

inline std::string rtk(const std::string& parameters, const std::string& common = "") {
    return "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>\n<RTKThreeDCircularGeometry version=\"3\">\n" + common +
           "<Projection>" + parameters + "</Projection></RTKThreeDCircularGeometry>\n";
}
inline const std::string kRtkDistances =
    "<SourceToIsocenterDistance>1000</SourceToIsocenterDistance>"
    "<SourceToDetectorDistance>1536</SourceToDetectorDistance>";
inline const GeometryHints kRtk{.size_px = Eigen::Vector2i(120, 100), .pixel_pitch_mm = Eigen::Vector2d(2, 3)};

}  // namespace raylign::detail::test
