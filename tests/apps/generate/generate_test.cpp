#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <regex>
#include <set>
#include <sstream>

#include "apps/generate/texts.h"
#include "apps/shared/help.h"
#include "tests/apps/run_program.h"

namespace raylign::detail::test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// What `raylign ... --help` names: the words of its lines that start an option.
std::set<std::string> options_in_help(const std::vector<std::string>& arguments) {
    std::set<std::string> names;
    std::istringstream lines(run_raylign(arguments).out);
    const std::regex option("^  (-[a-z])?,?(--[a-z0-9-]+)?( |$)");
    for (std::string line; std::getline(lines, line);) {
        std::smatch found;
        if (!std::regex_search(line, found, option)) continue;
        for (const std::size_t i : {1, 2}) {
            if (found[i].matched) names.insert(found[i]);
        }
    }
    return names;
}

std::vector<std::string> commands_in_help() {
    std::vector<std::string> commands;
    std::istringstream lines(run_raylign({"--help"}).out);
    bool are_here = false;
    for (std::string line; std::getline(lines, line);) {
        if (line.empty()) are_here = false;
        if (are_here) commands.push_back(line.substr(2, line.find(' ', 2) - 2));
        if (line == "Commands:") are_here = true;
    }
    return commands;
}

std::string generated(const std::string& kind, const std::string& file) {
    TestFolder folder;
    const ProgramResult result = run_raylign({"generate", kind, "-o", folder.path("out")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_text(folder.path("out/" + file));
}

/// The part of a completion for one command.
std::string between(const std::string& text, const std::string& begin, const std::string& end) {
    const std::size_t first = text.find(begin);
    EXPECT_NE(first, std::string::npos) << begin;
    return first == std::string::npos ? "" : text.substr(first, text.find(end, first) - first);
}

TEST(Generate, HelpNamesAllCommandsAndTheirOptions) {  // or the tests below compare nothing
    EXPECT_EQ(commands_in_help().size(), 14U);
    EXPECT_GT(options_in_help({"register", "--help"}).size(), 40U);
    EXPECT_THAT(options_in_help({"register", "--help"}), Contains("-v"));
}

TEST(Generate, EveryOptionOfTheHelpIsInTheManPageOfItsCommand) {
    TestFolder folder;
    ASSERT_EQ(run_raylign({"generate", "man", "-o", folder.path("man")}).exit_code, 0);
    for (const std::string& command : commands_in_help()) {
        const std::string page = read_text(folder.path("man/raylign-" + command + ".1"));
        for (const std::string& name : options_in_help({command, "--help"})) {
            const std::string hyphens = std::regex_replace(name, std::regex("-"), "\\-");
            EXPECT_THAT(page, HasSubstr("\\fB" + hyphens + "\\fR")) << command;
        }
        EXPECT_THAT(read_text(folder.path("man/raylign.1")), HasSubstr("\\fB" + command + "\\fR"));
    }
    EXPECT_EQ(names_in(folder.path("man")).size(), commands_in_help().size() + 1);
}

TEST(Generate, EveryOptionOfTheHelpIsCompletedInBash) {
    const std::string text = generated("bash", "raylign");
    for (const std::string& command : commands_in_help()) {
        const std::string part = between(text, "        " + command + ")\n", "            case");
        for (const std::string& name : options_in_help({command, "--help"})) {
            EXPECT_TRUE(std::regex_search(part, std::regex("[\" ]" + name + "[\" ]"))) << command << " " << name;
        }
    }
}

TEST(Generate, EveryOptionOfTheHelpIsCompletedInZshAndFish) {
    const std::string zsh = generated("zsh", "_raylign"), fish = generated("fish", "raylign.fish");
    for (const std::string& command : commands_in_help()) {
        const std::string part = between(zsh, "        " + command + ")\n", "return 0 ;;");
        for (const std::string& name : options_in_help({command, "--help"})) {
            EXPECT_THAT(part, HasSubstr("'*" + name + "[")) << command;
            const std::string here = name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
            EXPECT_TRUE(std::regex_search(fish, std::regex("from " + command + "'.*" + here + " "))) << name;
        }
    }
}

TEST(Generate, FishOffersFilesBesideWordsOnlyWhereACommandTakesThem) {
    const std::string fish = generated("fish", "raylign.fish");
    EXPECT_THAT(fish, HasSubstr("'__fish_seen_subcommand_from help' -fa 'start "));
    EXPECT_THAT(fish, HasSubstr("'__fish_seen_subcommand_from import' -a 'deepfluoro "));
}

/// What bash offers for a command line whose last word is being typed.
std::string offered(const std::vector<std::string>& words) {
    TestFolder folder;
    EXPECT_EQ(run_raylign({"generate", "bash", "-o", folder.path("bash")}).exit_code, 0);
    std::string script = ". " + folder.path("bash/raylign") + "; cd " + folder.path("bash") + "; COMP_WORDS=(";
    for (const std::string& word : words) script += " '" + word + "'";
    script += "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _raylign; echo \"${COMPREPLY[*]}\" > answer";
    write_text_file(folder.path("script"), script);
    EXPECT_EQ(std::system(("bash " + folder.path("script")).c_str()), 0);
    const std::string answer = read_text(folder.path("bash/answer"));
    return answer.substr(0, answer.find('\n'));
}

TEST(BashCompletion, OffersWhatFits) {
    EXPECT_EQ(offered({"raylign", "reg"}), "register");
    EXPECT_EQ(offered({"raylign", "register", "--thr"}), "--threads");
    EXPECT_EQ(offered({"raylign", "register", "--method", ""}), "auto gauss-newton steepest-descent bobyqa");
    EXPECT_EQ(offered({"raylign", "register", "--views", "a.json", "ray"}), "raylign");  // the file there
    EXPECT_EQ(offered({"raylign", "track", "--bone", "femur", "=", "ray"}), "raylign");
    EXPECT_EQ(offered({"raylign", "register", "--threads", ""}), "");
    EXPECT_EQ(offered({"raylign", "phantom", "b"}), "box");
    EXPECT_EQ(offered({"raylign", "help", "t"}), "trust");
    EXPECT_EQ(offered({"raylign", "phantom", "--size", "64", "e"}), "ellipsoid");
    EXPECT_EQ(offered({"raylign", "geometry", "ray"}), "raylign");
}

TEST(Choices, AreReadFromDescriptions) {
    using apps::listed_choices;
    EXPECT_THAT(listed_choices("gc (gradient correlation) or ncc; default gc"), ElementsAre("gc", "ncc"));
    EXPECT_THAT(listed_choices("On gl: hardware (texture filters), or exact; default hardware"),
                ElementsAre("hardware", "exact"));
    EXPECT_THAT(listed_choices("One of auto, a, b-2; default auto"), ElementsAre("auto", "a", "b-2"));
    EXPECT_THAT(listed_choices("Of deepfluoro, as 17-1882; default the only one"), IsEmpty());
    EXPECT_THAT(listed_choices("joseph"), IsEmpty());
    EXPECT_THAT(listed_choices("True pose, to report the error; default none"), IsEmpty());
}

TEST(ManPage, KeepsWhatRoffWouldTakeForItsOwn) {
    CLI::App app;
    apps::set_up_program(app);
    CLI::App& command = *app.add_subcommand("try", "'quoted' c:\\new");
    std::string value;
    apps::describe(command.add_option("--odd-name", value, ".mha is a file, \\n no line"), "WORD", apps::kInputGroup);
    apps::finish_command(command, ".first\n'second");
    const std::string page = apps::man_pages(apps::program_table(app)).back().text;
    EXPECT_THAT(page, HasSubstr("\\fB\\-\\-odd\\-name\\fR \\fIWORD\\fR\n\\&.mha is a file, \\(rsn no line.\n"));
    EXPECT_THAT(page, HasSubstr("\n\\&.first\n\\&'second\n"));
}

TEST(Generate, IsNotShownAndRefusesOtherKinds) {
    EXPECT_THAT(commands_in_help(), Not(Contains("generate")));
    const ProgramResult result = run_raylign({"generate", "csh", "-o", "nowhere"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("what to generate = csh: must be man, bash, zsh or fish"));
}

}  // namespace
}  // namespace raylign::detail::test
