#include "apps/shared/outputs.h"

#include "core/base/error.h"

namespace raylign::detail::apps {

void refuse_to_overwrite(const std::vector<std::filesystem::path>& inputs, const std::filesystem::path& folder,
                         const std::vector<std::string>& names) {
    for (const std::string& name : names) {
        const std::filesystem::path output = folder / name;
        for (const std::filesystem::path& input : inputs) {
            std::error_code missing;  // a file that is not there cannot be overwritten
            if (std::filesystem::equivalent(input, output, missing)) {
                throw Error("-o " + folder.string() + ": would overwrite the input " + input.string() +
                            "; give another folder");
            }
        }
    }
}

}  // namespace raylign::detail::apps
