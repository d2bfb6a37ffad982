#include "steadyhand/files/record/settings_change.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "steadyhand/core/json_writer.hpp"

namespace steadyhand {

namespace {

/// Of version 0.2.
Weights read_sentence(std::string_view text) {
  Weights weights;
  std::istringstream entries{std::string(text)};
  for (std::string entry; std::getline(entries, entry, ',');) {
    std::istringstream words(entry);
    std::string name;
    words >> name;
    for (double value = 0.0; words >> value;) weights[name].push_back(value);
  }
  return weights;
}

}  // namespace

std::string weights_text(const Weights& weights) {
  JsonBuffer text;
  JsonWriter json(text);
  json.begin_object();
  for (const auto& [name, values] : weights) json.member(name, values);
  json.end_object();
  return text;
}

Weights read_weights(std::string_view text) {
  if (!text.starts_with('{')) return read_sentence(text);
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  const bool is_of_numbers =
      json.is_object() && std::all_of(json.begin(), json.end(), [](const auto& values) {
        return values.is_array() &&
               std::all_of(values.begin(), values.end(), [](const auto& each) { return each.is_number(); });
      });
  return is_of_numbers ? json.get<Weights>() : Weights();
}

}  // namespace steadyhand
