#include <array>
#include <string>

#include "core/base/error.h"
#include "core/registration/registration.h"

namespace raylign {
namespace {

template <class Value, std::size_t N>
using Names = std::array<std::pair<Value, std::string_view>, N>;

constexpr Names<Method, 4> kMethods{{{Method::automatic, "auto"},
                                     {Method::gauss_newton, "gauss-newton"},
                                     {Method::steepest_descent, "steepest-descent"},
                                     {Method::bobyqa, "bobyqa"}}};
constexpr Names<Content, 3> kContents{
    {{Content::automatic, "auto"}, {Content::whole, "whole"}, {Content::part, "part"}}};
constexpr Names<Search, 4> kSearches{
    {{Search::automatic, "auto"}, {Search::none, "none"}, {Search::near, "near"}, {Search::global, "global"}}};

template <class Value, std::size_t N>
std::string_view name_in(const Names<Value, N>& names, Value value) {
    for (const auto& [known, name] : names) {
        if (known == value) return name;
    }
    return "unknown";
}

template <class Value, std::size_t N>
Value value_in(const Names<Value, N>& names, std::string_view what, std::string_view wanted) {
    std::string allowed;
    for (const auto& [value, name] : names) {
        if (name == wanted) return value;
        allowed += (allowed.empty() ? "one of " : ", ") + std::string(name);
    }
    throw bad_value(what, wanted, allowed);
}

}  // namespace

std::string_view method_name(Method method) { return name_in(kMethods, method); }
Method method_from_name(std::string_view name) { return value_in(kMethods, "method", name); }
std::string_view content_name(Content content) { return name_in(kContents, content); }
Content content_from_name(std::string_view name) { return value_in(kContents, "content", name); }
std::string_view search_name(Search search) { return name_in(kSearches, search); }
Search search_from_name(std::string_view name) { return value_in(kSearches, "search", name); }

}  // namespace raylign
