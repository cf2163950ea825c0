#include <gmock/gmock.h>

#include "io_files.h"
#include "raylign/io/views.h"
#include "xa_files.h"

namespace raylign::detail {
namespace {

using test::XaFile;
using testing::AllOf;
using testing::HasSubstr;

class DicomXray : public test::IoTest {};

TEST_F(DicomXray, IntensityRelationshipSettlesKindAndPolarity) {
    const auto notes = [&](const std::string& relation, const std::string& sign) {
        XaFile file;
        file.pixels.assign(1200, 3000);
        for (std::size_t i = 0; i < 300; ++i) file.pixels[i] = 500;
        file.set(0x00281040, "CS", relation);
        if (!sign.empty()) file.set(0x00281041, "SS", sign == "1" ? std::string("\1\0", 2) : std::string("\xff\xff"));
        const std::vector<std::string> files{write("xa.dcm", file.bytes()).string()};
        const ViewsFile views = read_views(files, ReadImages::required);
        std::string text;
        for (const std::string& note : views.notes) text += note + "\n";
        const bool first_is_denser = views.views[0].image(0, 0) > views.views[0].image(0, 20);
        return text + (first_is_denser ? "denser where 500" : "denser where 3000");
    };
    EXPECT_THAT(notes("LIN", ""),
                AllOf(HasSubstr("kind: transmission"), HasSubstr("LIN"), HasSubstr("denser where 500")));
    EXPECT_THAT(notes("LIN", "-1"), AllOf(HasSubstr("0028,1041"), HasSubstr("denser where 3000")));
    EXPECT_THAT(notes("LOG", "1"), AllOf(HasSubstr("up to a factor"), HasSubstr("denser where 500")));
    EXPECT_THAT(notes("LOG", "-1"), HasSubstr("denser where 3000"));
    EXPECT_THAT(notes("DISP", ""), HasSubstr("made up for display"));
}

}  // namespace
}  // namespace raylign::detail
