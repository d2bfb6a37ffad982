#pragma once

#include <functional>
#include <memory>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/record/mcap_sink.hpp"

namespace steadyhand {

/// Where a session's recordings go. One thread, the session's writer.
class RecordingPlace {
 public:
  struct Opened {
    std::string name;   ///< without folder and extension
    std::string where;  ///< as people find it
    std::unique_ptr<McapSink> sink;
  };

  virtual ~RecordingPlace() = default;
  /// A new recording by the first name of numbered(1), numbered(2), ... that is free.
  virtual Result<Opened> open(const std::function<std::string(int)>& numbered) = 0;
  /// Reason why nothing more may be written; empty: there is space.
  virtual std::string no_room() { return {}; }
  /// Deletes old recordings to make space for this one. @return what it did, for people; empty: nothing
  virtual std::string make_room(const Opened& /*newest*/) { return {}; }
  /// Whether it was deleted or moved away while it was written.
  virtual bool is_gone(const Opened& /*opened*/) { return false; }
};

}  // namespace steadyhand
