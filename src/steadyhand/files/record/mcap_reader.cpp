#include "steadyhand/files/record/mcap_reader.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <utility>

#include "steadyhand/core/text.hpp"
#include "steadyhand/files/record/crc32.hpp"
#include "steadyhand/files/record/mcap_format.hpp"

namespace steadyhand {

namespace {

using mcap::Opcode;

constexpr std::uint64_t kHeadSize = 1 + 8;            ///< opcode and length of a record
constexpr std::uint64_t kLargestRecord = 256u << 20;  ///< bytes, read into memory; our chunks have 1 MiB

/// In a chunk, behind its times, size and checksum: how it is packed.
constexpr std::string_view kZstd("\4\0\0\0zstd", 8);
constexpr std::uint64_t kBeforeName = 3 * 8 + 4;

/// Takes fields off the front of bytes. Fields that are not there are 0 or empty, and then ok() is false.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : rest_(bytes) {}

  template <typename Number>
  Number number() {
    Number value{};
    const std::string_view bytes = raw(sizeof(Number));
    if (ok_) std::memcpy(&value, bytes.data(), sizeof(Number));
    return value;
  }
  std::string_view raw(std::uint64_t size) {
    if (!ok_ || size > rest_.size()) {
      ok_ = false;
      return {};
    }
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }
  template <typename Length = std::uint32_t>
  std::string_view sized() {
    return raw(number<Length>());
  }
  std::map<std::string, std::string> map() {
    std::map<std::string, std::string> entries;
    Fields content(sized());
    while (content.ok() && !content.empty()) {
      const std::string_view key = content.sized(), value = content.sized();
      entries.emplace(key, value);
    }
    ok_ = ok_ && content.ok();
    return entries;
  }
  std::string_view rest() const { return rest_; }
  bool ok() const { return ok_; }
  bool empty() const { return rest_.empty(); }

 private:
  std::string_view rest_;
  bool ok_ = true;
};

class Reader {
 public:
  Reader(const std::filesystem::path& path, const McapMessageHandler& handler)
      : name_(path.string()), handler_(handler) {}

  Result<McapOverview> read() {
    std::error_code error;
    size_ = std::filesystem::file_size(name_, error);  // a pipe has none: to open it might wait for good
    if (!error) stream_.open(name_, std::ios::binary);
    if (error || !stream_) return Error{fmt::format("{}: cannot be read", name_)};
    std::string magic(mcap::kMagic.size(), '\0');
    if (!fill(magic) || magic != mcap::kMagic) {
      magic.resize(200);
      seek(0);
      (void)fill(magic);
      return Error{fmt::format("{}: {}", name_, is_lfs_pointer(magic) ? kLfsPointer : "is no MCAP file")};
    }
    whole_until_ = overview_.end;
    std::optional<Error> damage;
    while (!overview_.complete) {
      const std::optional<std::uint64_t> length = begin_record();
      if (!length) {
        if (!resume()) break;
        continue;
      }
      const std::uint64_t at = record_at_, next = overview_.end + *length;
      const Status read = read_record(*length);
      if (read) continue;
      if (damaged_.empty()) return read.error();
      if (!damage) damage = read.error();
      whole_until_ = at + kHeadSize;  // it is not tried again
      lose(at, next, std::exchange(damaged_, ""));
      seek(next);
    }
    if (damage && !overview_.any) return *damage;
    return std::move(overview_);
  }

 private:
  bool fill(std::string& bytes) {
    stream_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    overview_.end += static_cast<std::uint64_t>(stream_.gcount());
    return static_cast<std::size_t>(stream_.gcount()) == bytes.size();
  }

  void seek(std::uint64_t at) {
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(at));
    overview_.end = at;
  }

  void lose(std::uint64_t from, std::uint64_t until, const std::string& reason) {
    if (!loss_is_open_) overview_.lost.push_back({from, 0, latest_, latest_, reason});
    McapLoss& loss = overview_.lost.back();
    if (until > loss.at) loss.bytes = std::max(loss.bytes, until - loss.at);
    loss_is_open_ = true;
  }

  /// Behind what cannot be a record: continues at the next chunk that is whole. False if there is none, as in a file
  /// that was cut.
  bool resume() {
    const std::uint64_t end = overview_.end;
    const std::optional<std::uint64_t> next = find_chunk(whole_until_);
    seek(next.value_or(end));
    if (next) lose(std::min(*next, end), *next, "no record begins there");
    return next.has_value();
  }

  /// Where the next whole chunk begins that zstd has packed, as chunks of ours are.
  std::optional<std::uint64_t> find_chunk(std::uint64_t from) {
    constexpr std::uint64_t kBefore = kHeadSize + kBeforeName, kBlock = 1u << 16;
    constexpr std::size_t kMostLosses = 1000;
    if (overview_.lost.size() >= kMostLosses) return give_up();
    std::string block;
    for (std::uint64_t at = from; at < size_; at += kBlock - kZstd.size()) {
      block.resize(std::min(kBlock, size_ - at));
      seek(at);
      if (!fill(block)) return std::nullopt;
      for (std::size_t i = block.find(kZstd); i != std::string::npos; i = block.find(kZstd, i + 1)) {
        if (at + i < from + kBefore) continue;
        if (is_chunk(at + i - kBefore)) return at + i - kBefore;
        if (++false_chunks_ == kMostFalseChunks || tried_ > 2 * size_ + kLargestRecord) return give_up();
      }
    }
    return std::nullopt;
  }

  /// The rest is not searched: a file made for it could take hours.
  std::optional<std::uint64_t> give_up() {
    lose(whole_until_, size_, "too damaged to read further");
    return std::nullopt;
  }

  bool is_chunk(std::uint64_t at) {
    seek(at);
    const std::optional<std::uint64_t> length = begin_record();
    if (!length || opcode_ != Opcode::kChunk || *length > kLargestRecord) return false;
    tried_ += *length;
    record_.resize(*length);
    const bool whole = fill(record_) && unpack(Fields(record_));
    damaged_.clear();
    return whole;
  }

  /// Length of the next record; none if the file ends within it, or it can be none.
  std::optional<std::uint64_t> begin_record() {
    if (size_ - overview_.end < kHeadSize) return std::nullopt;
    record_at_ = overview_.end;
    std::string head(kHeadSize, '\0');
    if (!fill(head)) return std::nullopt;
    Fields fields(head);
    opcode_ = fields.number<Opcode>();
    const auto length = fields.number<std::uint64_t>();
    const auto code = static_cast<unsigned>(opcode_);
    const bool exists = (code > 0 && opcode_ <= Opcode::kDataEnd) || code >= 0x80;  // the latter are of applications
    if (exists && length <= size_ - overview_.end) return length;
    overview_.end = record_at_;
    return std::nullopt;
  }

  Status read_record(std::uint64_t length) {
    const bool wanted = opcode_ == Opcode::kMetadata || opcode_ == Opcode::kChunk || opcode_ == Opcode::kSchema ||
                        opcode_ == Opcode::kChannel || opcode_ == Opcode::kMessage;
    constexpr std::uint64_t kFooterLength = 8 + 8 + 4;
    if (opcode_ == Opcode::kFooter && length != kFooterLength) return corrupt("a footer that is none");
    if (opcode_ == Opcode::kFooter) overview_.complete = true;
    const bool outside_only = opcode_ == Opcode::kChunk && !handler_;
    if (!wanted || outside_only) {
      const std::uint64_t seen = std::min<std::uint64_t>(length, kBeforeName + kZstd.size());
      record_.resize(seen);
      if (!fill(record_)) return Error{fmt::format("{}: cannot be read at byte {}", name_, record_at_)};
      if (outside_only) {
        note_chunk(Fields(record_));
        whole_until_ = record_at_ + kHeadSize;
      }
      if (!wanted && record_.ends_with(kZstd)) return corrupt("a chunk that is called another kind of record");
      seek(overview_.end + length - seen);
      return Done{};
    }
    if (length > kLargestRecord) return corrupt(fmt::format("a record of {} bytes", length));
    record_.resize(length);
    if (!fill(record_)) return Error{fmt::format("{}: cannot be read at byte {}", name_, record_at_)};
    if (opcode_ == Opcode::kChunk) return read_chunk(Fields(record_));
    return read_content(opcode_, Fields(record_));
  }

  Error corrupt(const std::string& what) {
    damaged_ = what;
    return Error{fmt::format("{}: corrupt at byte {}: {}", name_, record_at_, what)};
  }

  void note_chunk(Fields fields) {
    const auto first = fields.number<std::uint64_t>(), last = fields.number<std::uint64_t>();
    ++overview_.chunks;
    // Times that cannot be are not worth an error here: what is inside is not looked at either.
    constexpr std::uint64_t kLatest = std::numeric_limits<std::int64_t>::max();
    if (last > 0 && first <= last && last <= kLatest) note_time(Time(first), Time(last));
  }

  void note_time(Time first, Time last) {
    if (loss_is_open_) overview_.lost.back().last = std::max(first, latest_);
    loss_is_open_ = false;
    latest_ = last;
    overview_.first = overview_.any ? std::min(overview_.first, first) : first;
    overview_.last = overview_.any ? std::max(overview_.last, last) : last;
    overview_.any = true;
  }

  /// The records of a chunk.
  Result<std::string_view> unpack(Fields fields) {
    (void)fields.number<std::uint64_t>();
    (void)fields.number<std::uint64_t>();
    const auto size = fields.number<std::uint64_t>();
    const auto crc = fields.number<std::uint32_t>();
    const std::string_view compression = fields.sized();
    std::string_view content = fields.sized<std::uint64_t>();
    if (!fields.ok()) return corrupt("a chunk that is shorter than it says");
    const std::uint64_t end = record_at_ + kHeadSize + record_.size() - fields.rest().size();
    if (compression == "zstd") {
      if (size > kLargestRecord) return corrupt(fmt::format("a chunk of {} bytes", size));
      chunk_.resize(size);
      const std::size_t got = ZSTD_decompress(chunk_.data(), chunk_.size(), content.data(), content.size());
      if (ZSTD_isError(got) || got != size) return corrupt("a chunk that zstd cannot unpack");
      content = chunk_;
    } else if (!compression.empty()) {
      return corrupt(fmt::format("compression '{}'; zstd and none are known", compression));
    }
    if (crc != 0 && crc != crc32(content)) return corrupt("a chunk whose checksum is wrong");
    whole_until_ = end;
    return content;
  }

  Status read_chunk(Fields fields) {
    const Result<std::string_view> content = unpack(fields);
    if (!content) return content.error();
    ++overview_.chunks;
    Fields records(*content);
    while (!records.empty()) {
      const auto opcode = records.number<Opcode>();
      const std::string_view record = records.sized<std::uint64_t>();
      if (!records.ok()) return corrupt("a record that reaches out of its chunk");
      if (Status s = read_content(opcode, Fields(record)); !s) return s;
    }
    return Done{};
  }

  Status read_content(Opcode opcode, Fields fields) {
    if (opcode == Opcode::kMetadata) {
      const std::string name(fields.sized());
      std::map<std::string, std::string> entries = fields.map();
      if (!fields.ok()) return corrupt("a metadata record");
      overview_.metadata[name] = std::move(entries);
    } else if (opcode == Opcode::kChannel) {
      const auto id = fields.number<std::uint16_t>();
      (void)fields.number<std::uint16_t>();
      Channel channel;
      channel.topic = fields.sized();
      channel.encoding = fields.sized();
      channel.metadata = fields.map();
      if (!fields.ok()) return corrupt("a channel record");
      channels_[id] = std::move(channel);
    } else if (opcode == Opcode::kMessage) {
      const auto id = fields.number<std::uint16_t>();
      (void)fields.number<std::uint32_t>();
      const auto log = fields.number<std::int64_t>(), publish = fields.number<std::int64_t>();
      if (!fields.ok() || log < 0 || publish < 0) return corrupt("a message record");
      if (!channels_.contains(id)) read_summary();
      const auto channel = channels_.find(id);
      if (channel == channels_.end()) return corrupt(fmt::format("a message of channel {}, which is not there", id));
      note_time(Time(log), Time(log));
      if (!handler_) return Done{};
      const Channel& c = channel->second;
      return handler_({c.topic, c.encoding, &c.metadata, Time(log), Time(publish), fields.rest()});
    }
    return Done{};
  }

  /// At its end a complete file repeats its channels: those of a chunk that was lost.
  void read_summary() {
    constexpr std::uint64_t kFooter = kHeadSize + 8 + 8 + 4, kTail = kFooter + mcap::kMagic.size();
    if (std::exchange(summary_is_read_, true) || size_ < kTail) return;
    std::ifstream stream(name_, std::ios::binary);
    const auto read = [&](std::uint64_t from, std::uint64_t size) {
      std::string bytes(size, '\0');
      stream.seekg(static_cast<std::streamoff>(from));
      return stream.read(bytes.data(), static_cast<std::streamsize>(size)) ? bytes : std::string();
    };
    const std::string tail = read(size_ - kTail, kFooter);
    Fields footer(tail);
    const auto opcode = footer.number<Opcode>();
    (void)footer.number<std::uint64_t>();
    const auto begin = footer.number<std::uint64_t>(), end = size_ - kTail;
    if (opcode != Opcode::kFooter || begin == 0 || begin > end || end - begin > kLargestRecord) return;
    const std::string summary = read(begin, end - begin);
    Fields records(summary);
    while (!records.empty()) {
      const auto kind = records.number<Opcode>();
      const std::string_view record = records.sized<std::uint64_t>();
      if (!records.ok()) break;
      if (kind == Opcode::kChannel) (void)read_content(kind, Fields(record));
    }
    damaged_.clear();
  }

  struct Channel {
    std::string topic, encoding;
    std::map<std::string, std::string> metadata;
  };

  std::string name_;
  const McapMessageHandler& handler_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, record_at_ = 0;
  std::uint64_t whole_until_ = 0;  ///< from where on the next chunk is looked for, if need be
  std::string damaged_;            ///< the error of the record that was read last
  bool loss_is_open_ = false;      ///< nothing was read since the last loss
  bool summary_is_read_ = false;
  static constexpr int kMostFalseChunks = 100;  ///< that are tried: to unpack each takes time
  int false_chunks_ = 0;
  std::uint64_t tried_ = 0;  ///< bytes read in search of a chunk
  Time latest_{0};           ///< log time of the last message
  Opcode opcode_{};
  std::string record_, chunk_;
  std::map<std::uint16_t, Channel> channels_;
  McapOverview overview_;
};

}  // namespace

bool is_mcap(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::ifstream stream(path, std::ios::binary);
  std::string magic(mcap::kMagic.size(), '\0');
  return stream.read(magic.data(), static_cast<std::streamsize>(magic.size())) && magic == mcap::kMagic;
}

std::string to_text(const McapLoss& loss) {
  return fmt::format("{} bytes at byte {} are damaged ({}): messages from {:.3f} s {} are lost", loss.bytes, loss.at,
                     loss.reason, to_seconds(loss.first),
                     loss.last > loss.first ? fmt::format("to {:.3f} s", to_seconds(loss.last)) : std::string("on"));
}

Result<McapOverview> read_mcap(const std::filesystem::path& path, const McapMessageHandler& handler) {
  return Reader(path, handler).read();
}

}  // namespace steadyhand
