// tests/install/example/files.cpp
#include <cstdio>

#include "raylign/io.h"
#include "scene.h"

int main() {
    using namespace raylign;
    {  // Files as they might lie on your disk.
        const Patient patient;
        write_volume("ct.nii.gz", patient.ct);
        for (const View& view : patient.views) write_image(view.name + ".tif", view.image);
        write_views("views.json", patient.views, {"AP.tif", "LAT.tif"});
        write_pose("start.json", perturbed_start(patient.truth, patient.targets, 5.0, 1));
    }

    // A CT in HU needs no option; this one holds attenuations [1/mm]. A folder with a DICOM series is a path, too.
    const VolumeFile ct = read_volume("ct.nii.gz", {.is_attenuation = true});
    const ViewsFile xrays = read_views("views.json", ReadImages::required);
    const RigidTransform start = read_pose("start.json");
    for (const std::string& note : xrays.notes) std::printf("%s\n", note.c_str());  // what was decided on reading

    const BackendChoice choice = create_backend("auto");
    const RegistrationResult result = register_volume(ct.volume, xrays.views, start, {}, *choice.backend);
    write_pose("pose.json", result.world_from_ct);
    write_pose("pose.tfm", result.world_from_ct);  // for ITK and 3D Slicer

    const double error_mm = Patient().error_mm(read_pose("pose.json"));
    std::printf("%s\nerror %.2f mm\n", brief(result).c_str(), error_mm);
    return result.ok && error_mm < 1.25 ? 0 : 1;
}
