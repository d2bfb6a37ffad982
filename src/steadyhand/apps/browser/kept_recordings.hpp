#pragma once

#include <functional>
#include <set>
#include <string>
#include <string_view>

#include "steadyhand/files/archive/recording_place.hpp"

namespace steadyhand {

/// Recordings for a caller without files: `keep` gets their bytes as they come, uncompressed.
class KeptRecordings final : public RecordingPlace {
 public:
  /// Bytes that follow those before; none when the recording is complete.
  using Keep = std::function<void(std::string_view name, std::string_view bytes)>;

  explicit KeptRecordings(Keep keep) : keep_(std::move(keep)) {}
  Result<Opened> open(const std::function<std::string(int)>& numbered) override;

 private:
  Keep keep_;
  std::set<std::string> names_;  ///< taken
};

}  // namespace steadyhand
