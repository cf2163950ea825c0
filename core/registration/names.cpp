#include "core/base/names.h"
#include "raylign/options.h"

namespace raylign {
using namespace detail;
namespace {

constexpr Names<Method, 4> kMethods{{{Method::automatic, "auto"},
                                     {Method::gauss_newton, "gauss-newton"},
                                     {Method::steepest_descent, "steepest-descent"},
                                     {Method::bobyqa, "bobyqa"}}};
constexpr Names<Content, 3> kContents{
    {{Content::automatic, "auto"}, {Content::whole, "whole"}, {Content::part, "part"}}};
constexpr Names<Search, 4> kSearches{
    {{Search::automatic, "auto"}, {Search::none, "none"}, {Search::near, "near"}, {Search::global, "global"}}};

}  // namespace

std::string_view method_name(Method method) { return name_in(kMethods, method); }
Method method_from_name(std::string_view name) { return value_in(kMethods, "method", name); }
std::string_view content_name(Content content) { return name_in(kContents, content); }
Content content_from_name(std::string_view name) { return value_in(kContents, "content", name); }
std::string_view search_name(Search search) { return name_in(kSearches, search); }
Search search_from_name(std::string_view name) { return value_in(kSearches, "search", name); }

}  // namespace raylign
