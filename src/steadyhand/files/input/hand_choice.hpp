#pragma once

#include <functional>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

struct RecordingOptions;

/// A hand of a file, and the tool that it moves.
struct ChosenHand {
  std::string key;  ///< name in the file; empty: the file names none
  int tool = 0;
};

/// Chooses among the hands of a file, by their keys.
using ChooseHands = std::function<Result<std::vector<ChosenHand>>(const std::vector<std::string>& keys)>;

/// As RecordingOptions::track says. `name` is the file's, for messages.
Result<std::vector<ChosenHand>> choose_hands(const std::vector<std::string>& keys, const RecordingOptions& options,
                                             const std::string& name);

/// Which hands of the file are not used and how to choose others, for people; empty: all are.
std::string note_on_hands(const std::vector<std::string>& keys, const std::vector<ChosenHand>& chosen,
                          const std::string& name);

}  // namespace steadyhand
