#pragma once

#include <string>
#include <string_view>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Where an MCAP file's bytes go, and how its chunks are packed. One thread.
class McapSink {
 public:
  virtual ~McapSink() = default;
  /// What people know the file by.
  virtual std::string name() const = 0;
  /// Appends.
  virtual Status put(std::string_view bytes) = 0;
  /// Nothing is put afterwards.
  virtual Status close() { return Done{}; }
  /// MCAP's name of how chunks are compressed; empty: they are not.
  virtual std::string_view compression() const { return {}; }
  /// The chunk compressed; valid until the next call.
  virtual Result<std::string_view> compress(std::string_view chunk) { return chunk; }
};

}  // namespace steadyhand
