#pragma once

#include <algorithm>
#include <vector>

namespace raylign::detail::apps {

template <class T>
void append(std::vector<T>& list, const std::vector<T>& more) {
    list.insert(list.end(), more.begin(), more.end());
}

/// Without what is there already: several objects may share their files.
template <class T>
void append_new(std::vector<T>& list, const std::vector<T>& more) {
    for (const T& item : more) {
        if (std::ranges::find(list, item) == list.end()) list.push_back(item);
    }
}

}  // namespace raylign::detail::apps
