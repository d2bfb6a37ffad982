#include "steadyhand/files/input/hand_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "steadyhand/files/input/recording.hpp"

namespace steadyhand {
namespace {

using Keys = std::vector<std::string>;

enum class Side { kNone, kLeft, kRight };

Side side_of(const std::string& name) {
  const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
  if (name == "lhand" || has("left")) return Side::kLeft;
  return name == "rhand" || has("right") ? Side::kRight : Side::kNone;
}

bool has(const Keys& keys, const std::string& key) { return std::ranges::find(keys, key) != keys.end(); }

Error no_track(const Keys& keys, const std::string& key, const std::string& name) {
  return Error{fmt::format("{}: has no track \"{}\"; its tracks are: {}", name, key, fmt::join(keys, ", "))};
}

/// The tool of this name, or the only one on the same side.
std::optional<int> tool_for(const std::string& key, const Keys& tools) {
  if (const auto same = std::ranges::find(tools, key); same != tools.end()) return same - tools.begin();
  const Side side = side_of(key);
  if (side == Side::kNone || std::ranges::count(tools, side, side_of) != 1) return std::nullopt;
  return std::ranges::find(tools, side, side_of) - tools.begin();
}

/// Of a robot with one tool.
Result<std::vector<ChosenHand>> choose_one(const Keys& keys, const std::string& wanted, const std::string& name) {
  if (!wanted.empty())
    return has(keys, wanted) ? Result(std::vector{ChosenHand{wanted}}) : no_track(keys, wanted, name);
  for (const char* usual : {"rhand", "right"}) {
    if (has(keys, usual)) return std::vector{ChosenHand{usual}};
  }
  return keys.size() == 1 ? Result(std::vector{ChosenHand{keys.front()}}) : no_track(keys, "rhand", name);
}

/// Keys in the order of the tools, separated by commas; one alone moves the tool of its side, or the first.
Result<std::vector<ChosenHand>> choose_given(const Keys& keys, const RecordingOptions& options,
                                             const std::string& name) {
  Keys wanted(1);
  for (const char c : options.track) {
    if (c == ',') {
      wanted.emplace_back();
    } else {
      wanted.back() += c;
    }
  }
  if (wanted.size() > options.tools.size()) {
    return Error{fmt::format("{}: the track \"{}\" names {} hands; the robot has the tools {}", name, options.track,
                             wanted.size(), fmt::join(options.tools, ", "))};
  }
  std::vector<ChosenHand> chosen;
  for (std::size_t t = 0; t < wanted.size(); ++t) {
    if (wanted[t].empty()) continue;
    if (!has(keys, wanted[t])) return no_track(keys, wanted[t], name);
    if (std::ranges::count(wanted, wanted[t]) > 1) {
      return Error{fmt::format("{}: the track \"{}\" names the hand \"{}\" twice; a hand moves one tool", name,
                               options.track, wanted[t])};
    }
    const int tool = wanted.size() == 1 ? tool_for(wanted[t], options.tools).value_or(0) : static_cast<int>(t);
    chosen.push_back({wanted[t], tool});
  }
  if (!chosen.empty()) return chosen;
  return Error{fmt::format("{}: the track \"{}\" names no hand; its tracks are: {}", name, options.track,
                           fmt::join(keys, ", "))};
}

}  // namespace

Result<std::vector<ChosenHand>> choose_hands(const Keys& keys, const RecordingOptions& options,
                                             const std::string& name) {
  if (options.tools.size() < 2) return choose_one(keys, options.track, name);
  if (!options.track.empty()) return choose_given(keys, options, name);
  std::vector<ChosenHand> chosen;
  for (std::size_t t = 0; t < options.tools.size(); ++t) {
    const auto fits = [&](const std::string& key) { return tool_for(key, options.tools) == static_cast<int>(t); };
    if (std::ranges::count_if(keys, fits) == 1) {
      chosen.push_back({*std::ranges::find_if(keys, fits), static_cast<int>(t)});
    } else if (std::ranges::count_if(keys, fits) > 1) {
      return Error{
          fmt::format("{}: several of its tracks fit the tool \"{}\"; its tracks are: {}. Choose one for each "
                      "of the tools {}, as in --track A,B",
                      name, options.tools[t], fmt::join(keys, ", "), fmt::join(options.tools, ", "))};
    }
  }
  if (chosen.empty() && keys.size() == 1) chosen.push_back({keys.front()});
  if (!chosen.empty()) return chosen;
  return Error{
      fmt::format("{}: none of its tracks is named after a tool, or left or right as a tool; its tracks are: "
                  "{}. Choose one for each of the tools {}, as in --track A,B",
                  name, fmt::join(keys, ", "), fmt::join(options.tools, ", "))};
}

std::string note_on_hands(const Keys& keys, const std::vector<ChosenHand>& chosen, const std::string& name) {
  Keys used, unused;
  for (const ChosenHand& hand : chosen) used.push_back(hand.key);
  for (const std::string& key : keys) {
    if (side_of(key) != Side::kNone && !has(used, key)) unused.push_back(key);
  }
  if (unused.empty()) return "";
  return fmt::format("{}: the hand {} is used, and {} is not; --track selects", name, fmt::join(used, ", "),
                     fmt::join(unused, ", "));
}

}  // namespace steadyhand
