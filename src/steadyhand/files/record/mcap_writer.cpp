#include "steadyhand/files/record/mcap_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "steadyhand/files/record/crc32.hpp"

namespace steadyhand {

using mcap::Bytes;
using mcap::Opcode;

void McapWriter::TimeSpan::include(std::uint64_t t) {
  first = std::min(first, t);
  last = std::max(last, t);
}

McapWriter::McapWriter(std::unique_ptr<McapSink> sink, const McapSettings& settings)
    : sink_(std::move(sink)), name_(sink_->name()), settings_(settings) {}

Result<McapWriter> McapWriter::create(std::unique_ptr<McapSink> sink, const McapSettings& settings) {
  McapWriter writer(std::move(sink), settings);
  Bytes header, record;
  header.sized("");  // no profile: the topics follow no other framework's conventions
  header.sized("steadyhand");
  record.raw(mcap::kMagic);
  record.record(Opcode::kHeader, header.view());
  if (Status status = writer.put(record.view()); !status) return status.error();
  return writer;
}

McapWriter::~McapWriter() {
  if (sink_) (void)close();
}

Status McapWriter::fail(const std::string& what) {
  error_ = Error{fmt::format("{}: {}", name_, what)};
  return *error_;
}

Status McapWriter::put(std::string_view bytes) {
  if (!sink_) return Error{fmt::format("{}: already closed", name_)};
  if (const Status status = sink_->put(bytes); !status) return fail(status.error().message);
  position_ += bytes.size();
  data_crc_ = crc32(bytes, data_crc_);
  return Done{};
}

std::uint16_t McapWriter::add_channel(const McapChannel& channel) {
  const auto known = std::find_if(schemas_.begin(), schemas_.end(),
                                  [&](const Schema& schema) { return schema.name == channel.schema_name; });
  const auto schema_id = static_cast<std::uint16_t>(known - schemas_.begin() + 1);
  if (known == schemas_.end()) {
    Bytes content, record;
    content.number(schema_id);
    content.sized(channel.schema_name);
    content.sized("jsonschema");
    content.sized(channel.schema);
    record.record(Opcode::kSchema, content.view());
    schemas_.push_back({channel.schema_name, std::string(record.view())});
    chunk_.raw(record.view());
  }

  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  Bytes content, record;
  content.number(id);
  content.number(schema_id);
  content.sized(channel.topic);
  content.sized("json");
  content.map(channel.metadata);
  record.record(Opcode::kChannel, content.view());
  channels_.push_back({id, schema_id, std::string(record.view()), 0, {}});
  chunk_.raw(record.view());
  return id;
}

Status McapWriter::add_metadata(const std::string& name, const std::map<std::string, std::string>& entries) {
  if (error_) return *error_;
  Bytes content, record, index;
  content.sized(name);
  content.map(entries);
  record.record(Opcode::kMetadata, content.view());
  index.number(position_);
  index.number<std::uint64_t>(record.size());
  index.sized(name);
  metadata_indexes_.record(Opcode::kMetadataIndex, index.view());
  ++metadata_count_;
  return put(record.view());
}

Status McapWriter::write(std::uint16_t channel, Time log, Time publish, std::string_view json) {
  if (error_) return *error_;
  if (closed_) return Error{fmt::format("{}: already closed", name_)};
  if (log < Time{0} || publish < Time{0}) {
    return Error{fmt::format("{}: a message at {} ns, published at {} ns: MCAP has no times before 0", name_,
                             log.count(), publish.count())};
  }
  const auto log_time = static_cast<std::uint64_t>(log.count());
  if (chunk_span_.first <= chunk_span_.last && log_time >= chunk_span_.first + settings_.chunk_period.count()) {
    if (Status status = flush(); !status) return status;
  }

  Channel& entry = channels_.at(channel - 1);
  entry.chunk_index.push_back({log_time, chunk_.size()});
  chunk_.number(Opcode::kMessage);
  chunk_.number<std::uint64_t>(2 + 4 + 8 + 8 + json.size());
  chunk_.number(channel);
  chunk_.number(entry.messages++);
  chunk_.number(log_time);
  chunk_.number(static_cast<std::uint64_t>(publish.count()));
  chunk_.raw(json);
  chunk_span_.include(log_time);
  ++message_count_;
  return chunk_.size() >= settings_.chunk_bytes ? flush() : Done{};
}

Status McapWriter::flush() {
  if (error_) return *error_;
  if (chunk_.empty()) return Done{};
  // A chunk that declares channels but has no message spans [0, 0], as in the specification.
  if (chunk_span_.first > chunk_span_.last) {
    chunk_span_ = {0, 0};
  } else {
    file_span_.include(chunk_span_.first);
    file_span_.include(chunk_span_.last);
  }

  const Result<std::string_view> compressed = sink_->compress(chunk_.view());
  if (!compressed) return fail(compressed.error().message);

  Bytes content, output;
  content.number(chunk_span_.first);
  content.number(chunk_span_.last);
  content.number<std::uint64_t>(chunk_.size());
  content.number(crc32(chunk_.view()));
  content.sized(sink_->compression());
  content.sized<std::uint64_t>(*compressed);
  output.record(Opcode::kChunk, content.view());
  const std::uint64_t chunk_length = output.size();

  Bytes offsets;
  for (Channel& channel : channels_) {
    auto& entries = channel.chunk_index;
    if (entries.empty()) continue;
    std::stable_sort(entries.begin(), entries.end(),
                     [](const IndexEntry& a, const IndexEntry& b) { return a.log_time < b.log_time; });
    offsets.number(channel.id);
    offsets.number<std::uint64_t>(position_ + output.size());
    Bytes index;
    index.number(channel.id);
    index.sized({reinterpret_cast<const char*>(entries.data()), entries.size() * sizeof(IndexEntry)});
    output.record(Opcode::kMessageIndex, index.view());
    entries.clear();
  }

  Bytes index;
  index.number(chunk_span_.first);
  index.number(chunk_span_.last);
  index.number(position_);
  index.number(chunk_length);
  index.sized(offsets.view());
  index.number<std::uint64_t>(output.size() - chunk_length);
  index.sized(sink_->compression());
  index.number<std::uint64_t>(compressed->size());
  index.number<std::uint64_t>(chunk_.size());
  chunk_indexes_.record(Opcode::kChunkIndex, index.view());

  ++chunk_count_;
  chunk_span_ = {};
  chunk_.clear();
  return put(output.view());
}

Status McapWriter::close() {
  if (closed_) return error_ ? Status(*error_) : Done{};
  closed_ = true;
  Status status = flush();
  if (status) status = write_summary();
  const Status closed = std::exchange(sink_, nullptr)->close();
  if (!closed && status) status = fail(closed.error().message);
  return status;
}

Status McapWriter::write_summary() {
  Bytes data_end_content, data_end;
  data_end_content.number(data_crc_);
  data_end.record(Opcode::kDataEnd, data_end_content.view());
  if (Status status = put(data_end.view()); !status) return status;

  Bytes summary, offsets;
  const std::uint64_t summary_start = position_;
  const auto group = [&](Opcode opcode, const auto& write_records) {
    const std::uint64_t start = summary_start + summary.size();
    write_records();
    const std::uint64_t length = summary_start + summary.size() - start;
    if (length == 0) return;
    Bytes content;
    content.number(opcode);
    content.number(start);
    content.number(length);
    offsets.record(Opcode::kSummaryOffset, content.view());
  };
  group(Opcode::kSchema, [&] {
    for (const Schema& schema : schemas_) summary.raw(schema.record);
  });
  group(Opcode::kChannel, [&] {
    for (const Channel& channel : channels_) summary.raw(channel.record);
  });
  group(Opcode::kStatistics, [&] {
    Bytes counts, content;
    for (const Channel& channel : channels_) {
      counts.number(channel.id);
      counts.number<std::uint64_t>(channel.messages);
    }
    content.number(message_count_);
    content.number<std::uint16_t>(schemas_.size());
    content.number<std::uint32_t>(channels_.size());
    content.number<std::uint32_t>(0);  // attachments
    content.number(metadata_count_);
    content.number(chunk_count_);
    content.number<std::uint64_t>(message_count_ ? file_span_.first : 0);
    content.number(file_span_.last);
    content.sized(counts.view());
    summary.record(Opcode::kStatistics, content.view());
  });
  group(Opcode::kMetadataIndex, [&] { summary.raw(metadata_indexes_.view()); });
  group(Opcode::kChunkIndex, [&] { summary.raw(chunk_indexes_.view()); });
  const std::uint64_t offsets_start = summary_start + summary.size();
  summary.raw(offsets.view());

  // The checksum covers the summary and the footer up to the checksum itself, so the footer is laid out by hand.
  summary.number(Opcode::kFooter);
  summary.number<std::uint64_t>(8 + 8 + 4);
  summary.number(summary_start);
  summary.number(offsets_start);
  summary.number(crc32(summary.view()));
  summary.raw(mcap::kMagic);
  return put(summary.view());
}

}  // namespace steadyhand
