#pragma once

#include <string>
#include <vector>

namespace steadyhand {

/// Insertions, deletions and replacements that turn one word into the other.
int edit_distance(const std::string& a, const std::string& b);

/// " (did you mean 'home'? Known: ...)"-like help for a word that is not among `known`: the nearest word where one is
/// near, and all of them.
std::string suggestion(const std::string& word, const std::vector<std::string>& known);

}  // namespace steadyhand
