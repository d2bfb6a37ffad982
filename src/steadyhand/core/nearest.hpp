#pragma once

#include <string>
#include <vector>

namespace steadyhand {

/// Insertions, deletions and replacements that turn one word into the other.
int edit_distance(const std::string& a, const std::string& b);

/// Help such as " (did you mean 'home'? Known: ...)" for a word that is not in `known`: the nearest word, if one is
/// near, and all known words.
std::string suggestion(const std::string& word, const std::vector<std::string>& known);

}  // namespace steadyhand
