#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/files/record/mcap_format.hpp"
#include "steadyhand/files/record/mcap_sink.hpp"

namespace steadyhand {

struct McapSettings {
  std::size_t chunk_bytes = 1 << 20;                   ///< a chunk is written once it holds this much, uncompressed
  Time chunk_period = std::chrono::milliseconds(500);  ///< or once its messages span this much log time
  int compression_level = 1;                           ///< zstd's, for a file: 1 (fast) to 19
  bool replace = true;                                 ///< a file that is there; otherwise it is an error
};

/// A file with chunks compressed by zstd. Each put reaches the operating system.
Result<std::unique_ptr<McapSink>> open_mcap_file(const std::string& path, const McapSettings& settings = {});

/// A topic whose messages are JSON.
struct McapChannel {
  std::string topic;
  std::string schema_name;  ///< channels that share a name share the schema
  std::string schema;       ///< JSON Schema text
  std::map<std::string, std::string> metadata;
};

/// Writes an MCAP file: chunks with checksums and indexes, and a summary to seek by. Each chunk goes to the sink as
/// soon as it is complete, so a killed process loses at most the open one, and what is before stays readable. One
/// thread; allocates. After an error every further call returns that error.
class McapWriter {
 public:
  /// Begins the file in a sink. @pre there is one
  static Result<McapWriter> create(std::unique_ptr<McapSink> sink, const McapSettings& settings = {});
  /// Creates a file, as open_mcap_file().
  static Result<McapWriter> create(const std::string& path, const McapSettings& settings = {});
  McapWriter(McapWriter&&) = default;
  McapWriter& operator=(McapWriter&&) = delete;
  /// Closes the file as well as it can; call close() to learn of errors.
  ~McapWriter();

  /// The number to pass to write().
  std::uint16_t add_channel(const McapChannel& channel);
  /// A named table of text, e.g. what was recorded with which settings.
  Status add_metadata(const std::string& name, const std::map<std::string, std::string>& entries);
  /// `log` must not be negative; `publish` is the time of the event that the message reports.
  Status write(std::uint16_t channel, Time log, Time publish, std::string_view json);
  /// Writes the open chunk now. For a session in which no message has come for a while.
  Status flush();
  /// Writes the open chunk and the summary. Further calls do nothing.
  Status close();

  std::uint64_t message_count() const { return message_count_; }

 private:
  struct TimeSpan {
    std::uint64_t first = UINT64_MAX, last = 0;
    void include(std::uint64_t t);
  };
  struct IndexEntry {
    std::uint64_t log_time, offset;
  };
  struct Channel {
    std::uint16_t id, schema_id;
    std::string record;
    std::uint32_t messages = 0;
    std::vector<IndexEntry> chunk_index;  ///< messages of the open chunk
  };
  struct Schema {
    std::string name, record;
  };

  McapWriter(std::unique_ptr<McapSink> sink, const McapSettings& settings);
  Status put(std::string_view bytes);
  Status fail(const std::string& what);
  Status write_summary();

  std::unique_ptr<McapSink> sink_;  ///< none once closed
  std::string name_;
  McapSettings settings_;
  std::optional<Error> error_;
  bool closed_ = false;

  std::vector<Schema> schemas_;    ///< the schema with id i is at i - 1: 0 means "no schema"
  std::vector<Channel> channels_;  ///< the channel with id i is at i - 1
  std::uint64_t message_count_ = 0, position_ = 0;
  std::uint32_t data_crc_ = 0, chunk_count_ = 0, metadata_count_ = 0;
  TimeSpan file_span_, chunk_span_;
  mcap::Bytes chunk_, chunk_indexes_, metadata_indexes_;
};

}  // namespace steadyhand
