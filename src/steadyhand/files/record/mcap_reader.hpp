#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// One message; the views hold during the call that gets it.
struct McapMessage {
  std::string_view topic, encoding;
  const std::map<std::string, std::string>* channel_metadata = nullptr;
  Time log{0}, publish{0};
  std::string_view data;
};

/// A part of a damaged file that could not be read.
struct McapLoss {
  std::uint64_t at = 0, bytes = 0;  ///< in the file
  Time first{0}, last{0};           ///< messages between these log times may be missing
  std::string reason;
};

/// "900 bytes at byte 5000 are damaged (a chunk whose checksum is wrong): messages from 1.000 s to 2.000 s are lost".
std::string to_text(const McapLoss& loss);

/// An MCAP file's contents, except its messages.
struct McapOverview {
  bool complete = false;       ///< it has its end; a file whose writer was killed has not
  std::uint64_t end = 0;       ///< bytes up to which it was read
  std::uint64_t chunks = 0;    ///< complete ones
  bool any = false;            ///< there are messages; then:
  Time first{0}, last{0};      ///< log times of the earliest and the latest
  std::vector<McapLoss> lost;  ///< in the order of the file
  std::map<std::string, std::map<std::string, std::string>> metadata;  ///< records by name
};

/// Gets each message; an error ends the reading.
using McapMessageHandler = std::function<Status(const McapMessage&)>;

/// True if the file begins like an MCAP file.
bool is_mcap(const std::filesystem::path& path);

/// Reads an MCAP file from its beginning, so that one whose writer was killed gives all its complete chunks: the first
/// record that is cut ends the reading, without error. A damaged part (checksum, length, contents) is skipped, with the
/// reading continued at the next chunk that is whole, and noted in `lost`. Without a handler chunks are skipped and
/// only looked at from outside, which is fast, and finds no damage within them. Refused, with the byte: a file that is
/// no MCAP, or of which no chunk can be read.
Result<McapOverview> read_mcap(const std::filesystem::path& path, const McapMessageHandler& handler = {});

}  // namespace steadyhand
