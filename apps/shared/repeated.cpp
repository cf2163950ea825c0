#include "apps/shared/repeated.h"

#include "apps/shared/invocation.h"

namespace raylign::detail::apps {

std::string repeated(const std::string& name, const CLI::App& command,
                     const std::function<bool(const CLI::Option&)>& keeps) {
    std::vector<std::string> words{"raylign", name};
    for (const CLI::Option* option : command.get_options()) {
        if (option->count() == 0 || !keeps(*option)) continue;
        words.push_back(option->get_name());
        if (option->get_expected_max() == 0) continue;  // a flag
        for (const std::string& value : option->results()) words.push_back(value);
    }
    return quote_for_shell(words);
}

}  // namespace raylign::detail::apps
