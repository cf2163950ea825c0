#include <gmock/gmock.h>

#include "io_files.h"
#include "raylign/io/pose.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::HasSubstr;
using Points = std::vector<Eigen::Vector3d>;

class TargetsIo : public test::IoTest {
protected:
    std::string error_reading(const std::string& name, const std::string& text) {
        return error_of([&] { (void)read_targets(write(name, text)); });
    }
};

const Points kTwo = {{1.5, -2, 3}, {4, 5, -6.25}};

TEST_F(TargetsIo, JsonIsRead) {
    EXPECT_EQ(read_targets(write("t.json", R"({"targets_ct_mm": [[1.5, -2, 3], [4, 5, -6.25]]})")), kTwo);
}
TEST_F(TargetsIo, CsvIsReadWithHeadingCommentsAndWindowsLineEnds) {
    EXPECT_EQ(read_targets(write("t.csv", "x,y,z\r\n# two\r\n1.5, -2, 3\r\n\r\n4,5,-6.25\r\n")), kTwo);
    EXPECT_EQ(read_targets(write("u.csv", "1.5,-2,3\n4,5,-6.25")), kTwo);
}

const std::string kColumns = "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
const std::string kRowsInRas = "1,-1.5,2,3,0,0,0,1,1,1,0,\"F-1, left\",,\n2,-4,-5,-6.25,0,0,0,1,1,1,0,F-2,,\n";
const std::string kRowsInLps = "1,1.5,-2,3,0,0,0,1,1,1,0,F-1,,\n2,4,5,-6.25,0,0,0,1,1,1,0,F-2,,\n";

TEST_F(TargetsIo, FcsvInRasIsTurnedToLps) {
    for (const std::string system : {"# CoordinateSystem = 0\n", "# CoordinateSystem = RAS\n", ""}) {
        EXPECT_EQ(
            read_targets(write("t.fcsv", "# Markups fiducial file version = 4.10\n" + system + kColumns + kRowsInRas)),
            kTwo);
    }
}
TEST_F(TargetsIo, FcsvInLpsStaysAsItIs) {
    for (const std::string system : {"# CoordinateSystem = 1\n", "# CoordinateSystem = LPS\n"}) {
        EXPECT_EQ(read_targets(write("t.fcsv", system + kColumns + kRowsInLps)), kTwo);
    }
}

TEST_F(TargetsIo, ASlipInTheFirstRowIsNoHeading) {
    for (const std::string first : {"1O,2,3", "x,2,3", "1,2,three", "-l,-2,-3", "1O,2O,3O"}) {
        EXPECT_THAT(error_reading("t.csv", first + "\n4,5,6\n7,8,9\n"), HasSubstr("t.csv, line 1")) << first;
    }
}

TEST_F(TargetsIo, TablesOfOtherProgramsAreRead) {
    EXPECT_EQ(read_targets(write("bom.csv", "\xEF\xBB\xBFx,y,z\n1.5,-2,3\n4,5,-6.25\n")), kTwo);
    EXPECT_EQ(read_targets(write("bom2.csv",
                                 "\xEF\xBB\xBF"
                                 "1.5,-2,3\n4,5,-6.25\n")),
              kTwo);
    EXPECT_EQ(read_targets(write("semi.csv", "x;y;z\n1.5;-2;3\n4;5;-6.25\n")), kTwo);
    EXPECT_EQ(read_targets(write("tab.csv", "1.5\t-2\t3\n4\t5\t-6.25\n")), kTwo);
    EXPECT_EQ(read_targets(write("mac.csv", "1.5,-2,3\r4,5,-6.25\r")), kTwo);
    EXPECT_EQ(read_targets(write("quoted.csv", "\"1.5\",\"-2\",\"3\"\n4,5,-6.25\n")), kTwo);
    EXPECT_THAT(error_reading("wide.csv", std::string("\xFF\xFE"
                                                      "1\0,\0",
                                                      6)),
                HasSubstr("UTF-16"));
    EXPECT_THAT(error_reading("comma.csv", "1,5;2,0;3,1\n"), HasSubstr("comma.csv, line 1"));
    EXPECT_THAT(error_reading("nul.csv", std::string("1,2,3\n\0", 7)), HasSubstr("no text file"));
}

TEST_F(TargetsIo, MarkupsOfAllSlicersAreRead) {
    const auto markups = [&](const std::string& keys, const std::string& positions) {
        return write("m.mrk.json", R"({"@schema": "x", "markups": [{"type": "Fiducial", )" + keys +
                                       R"("controlPoints": [)" + positions + "]}]}");
    };
    const std::string lps = R"({"position": [1.5, -2, 3]}, {"position": [4, 5, -6.25], "positionStatus": "defined"})";
    const std::string ras = R"({"position": [-1.5, 2, 3]}, {"position": [-4, -5, -6.25]}, {"position": [0, 0, 0],
                               "positionStatus": "undefined"})";
    EXPECT_EQ(read_targets(markups("", lps)), kTwo);
    for (const std::string system : {R"("LPS")", "1"}) {
        EXPECT_EQ(read_targets(markups("\"coordinateSystem\": " + system + ", ", lps)), kTwo) << system;
    }
    for (const std::string system : {R"("RAS")", "0"}) {
        EXPECT_EQ(read_targets(markups("\"coordinateSystem\": " + system + ", ", ras)), kTwo) << system;
    }
    EXPECT_EQ(read_targets(markups(R"("coordinateUnits": ["mm", "UCUM", "millimeter"], )", lps)), kTwo);
    const auto message = [&](const std::string& keys) {
        return error_of([&] { (void)read_targets(markups(keys, lps)); });
    };
    EXPECT_THAT(message(R"("coordinateUnits": ["um", "UCUM", "micrometer"], )"), HasSubstr("must be mm"));
    EXPECT_THAT(message(R"("coordinateUnits": "cm", )"), HasSubstr("must be mm"));
    EXPECT_THAT(message(R"("coordinateSystem": 2, )"), AllOf(HasSubstr("CoordinateSystem = 2"), HasSubstr("LPS")));
}

TEST_F(TargetsIo, FcsvOfSlicer3NamesItsColumns) {
    EXPECT_EQ(read_targets(write("t.fcsv",
                                 "# Fiducial List file\n# columns = label,x,y,z,sel,vis\n"
                                 "\"F, 1\",-1.5,2,3,1,1\nF2,-4,-5,-6.25,1,1\n")),
              kTwo);
    EXPECT_THAT(error_reading("u.fcsv", "# columns = label,z,y,x\n"), HasSubstr("u.fcsv, line 1"));
}

TEST_F(TargetsIo, BadFilesNameTheLineOrKey) {
    EXPECT_THAT(error_reading("a.csv", "1,2,3\n1,2\n"), AllOf(HasSubstr("a.csv, line 2"), HasSubstr("1,2")));
    EXPECT_THAT(error_reading("b.csv", "1,2,3\n1,two,3\n"), AllOf(HasSubstr("line 2"), HasSubstr("y = two")));
    EXPECT_THAT(error_reading("c.csv", "1,2,nan\n"), HasSubstr("finite"));
    EXPECT_THAT(error_reading("d.csv", "x,y,z\n"), HasSubstr("no targets"));
    EXPECT_THAT(error_reading("e.csv", ""), HasSubstr("empty"));
    EXPECT_THAT(error_reading("f.fcsv", "# CoordinateSystem = IJK\n1,2,3,4\n"), HasSubstr("IJK"));
    EXPECT_THAT(error_reading("g.json", R"({"targets_ct_mm": [[1,2,3],[1,2]]})"), HasSubstr("targets_ct_mm[1]"));
    EXPECT_THAT(error_reading("h.json", R"({"targets_ct_mm": []})"), HasSubstr("no targets"));
    EXPECT_THAT(error_reading("i.json", R"({"target": []})"), HasSubstr("did you mean \"targets_ct_mm\""));
    EXPECT_THAT(error_reading("j.txt", "1,2,3"), HasSubstr(".fcsv"));
}

}  // namespace
}  // namespace raylign::detail
