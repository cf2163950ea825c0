#include "apps/objects/object_options.h"

namespace raylign::detail::apps {

void add_several_objects_flags(CLI::App& command, SceneFlags& flags) {
    for (const char* name : {"--object", "--start"}) command.remove_option(command.get_option(name));
    describe(command.add_option("--object", flags.objects,
                                "Object of --labels by name or number, with a pose of its own; may be repeated;\n"
                                "all-bones: every bone of the map that a view shows; or a box to keep of the CT,\n"
                                "X0,Y0,Z0,X1,Y1,Z1 in mm (LPS), or voxels:I0,J0,K0,I1,J1,K1; default the whole CT"),
             "NAME|BOX ...", kObjectGroup);
    describe(command.add_option("--bone", flags.bones,
                                "Object with a CT of its own, or of -v by labels of --labels (3 or 3,4 or a name);\n"
                                "may be repeated; default none"),
             "NAME=FILE|LABELS ...", kObjectGroup);
    command
        .add_flag("--segment-bones", flags.segment_bones,
                  "No --labels: split the CT into connected bones, named by place (left_1, middle_2, ...\n"
                  "from the head down); for registration, no diagnosis; bone is above --bone-threshold,\n"
                  "else 200 HU; default off")
        ->group(kObjectGroup);
    describe(command.add_option("--rest", flags.rest,
                                "What is left of the CT beside its objects: body (moves), still or none; default none"),
             "NAME", kObjectGroup);
    describe(command.add_option(
                 "--start", flags.starts,
                 "world_from_ct to start from, for all objects or one: pose.json, .tfm (ct_from_world), .dcm,\n"
                 ".jts, .tra, trajectory.csv or \"dicom\"; may be repeated;\n"
                 "default: CT centre where central rays meet, patient axes as world axes"),
             "[NAME=]FILE ...", kStartGroup);
}

}  // namespace raylign::detail::apps
