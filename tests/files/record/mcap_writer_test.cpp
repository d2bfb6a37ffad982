#include "steadyhand/files/record/mcap_writer.hpp"

#include <gtest/gtest.h>
#include <zstd.h>

#include <cstring>
#include <random>

#include "steadyhand/files/record/crc32.hpp"
#include "test_data.hpp"

/// The layout, byte by byte, read by a parser of the test's own; tests/python/test_mcap.py reads it with the public
/// one.
namespace steadyhand {
namespace {

using mcap::Opcode;

struct Record {
  Opcode opcode;
  std::size_t start;  ///< the opcode's offset in the file (or chunk)
  std::string content;

  template <typename Number>
  Number at(std::size_t offset) const {
    Number value;
    EXPECT_LE(offset + sizeof value, content.size());
    std::memcpy(&value, content.data() + offset, sizeof value);
    return value;
  }
  std::size_t end() const { return start + 9 + content.size(); }
};

std::vector<Record> parse(const std::string& bytes, std::size_t begin, std::size_t end) {
  std::vector<Record> records;
  while (begin < end) {
    std::uint64_t length;
    std::memcpy(&length, bytes.data() + begin + 1, 8);
    if (begin + 9 + length > end) throw std::runtime_error("a record is longer than what is left");
    records.push_back({static_cast<Opcode>(bytes[begin]), begin, bytes.substr(begin + 9, length)});
    begin = records.back().end();
  }
  return records;
}

/// The records inside a chunk; checks its checksum.
std::vector<Record> open_chunk(const Record& chunk) {
  const auto size = chunk.at<std::uint64_t>(16);
  const std::size_t compression_end = 28 + 4 + 4;  // behind the text "zstd"
  EXPECT_EQ(chunk.content.substr(28 + 4, 4), "zstd");
  const std::size_t data = compression_end + 8;
  std::string records(size, '\0');
  EXPECT_EQ(ZSTD_decompress(records.data(), size, chunk.content.data() + data, chunk.content.size() - data), size);
  EXPECT_EQ(crc32(records), chunk.at<std::uint32_t>(24));
  return parse(records, 0, records.size());
}

TEST(Crc32, KnowsThePublishedCheckValue) {
  EXPECT_EQ(crc32("123456789"), 0xCBF43926u);
  EXPECT_EQ(crc32("6789", crc32("12345")), 0xCBF43926u);
}

class McapFile : public testing::Test {
 protected:
  static constexpr int kMessages = 300;

  void write(const McapSettings& settings) {
    Result<McapWriter> writer = McapWriter::create(path_, settings);
    ASSERT_TRUE(writer) << writer.error().message;
    ASSERT_TRUE(writer->add_metadata("run", {{"profile", "waiter"}}));
    const auto first = writer->add_channel({"/first", "Shared", "{}", {{"unit", "rad"}}});
    const auto second = writer->add_channel({"/second", "Shared", "{}", {}});
    for (int i = 0; i < kMessages; ++i) {
      const Time t = std::chrono::milliseconds(10 * i);
      ASSERT_TRUE(writer->write(i % 3 ? first : second, t, t / 2, "{\"i\":" + std::to_string(i) + "}"));
    }
    ASSERT_TRUE(writer->close());
    bytes_ = test::read_file(path_);
    records_ = parse(bytes_, 8, bytes_.size() - 8);
  }
  std::vector<Record> all(Opcode opcode) const {
    std::vector<Record> found;
    for (const Record& record : records_) {
      if (record.opcode == opcode) found.push_back(record);
    }
    return found;
  }

  std::filesystem::path path_ = test::temporary_file("layout.mcap");
  std::string bytes_;
  std::vector<Record> records_;
};

TEST_F(McapFile, HasTheSectionsInOrder) {
  write({});
  EXPECT_EQ(bytes_.substr(0, 8), mcap::kMagic);
  EXPECT_EQ(bytes_.substr(bytes_.size() - 8), mcap::kMagic);
  EXPECT_EQ(records_.front().opcode, Opcode::kHeader);
  ASSERT_EQ(records_.back().opcode, Opcode::kFooter);

  const Record& footer = records_.back();
  const Record data_end = all(Opcode::kDataEnd).at(0);
  EXPECT_EQ(footer.at<std::uint64_t>(0), data_end.end());
  EXPECT_EQ(footer.at<std::uint64_t>(8), all(Opcode::kSummaryOffset).at(0).start);
  EXPECT_EQ(crc32(bytes_.substr(data_end.end(), footer.start + 9 + 16 - data_end.end())), footer.at<std::uint32_t>(16));
  EXPECT_EQ(crc32(bytes_.substr(0, data_end.start)), data_end.at<std::uint32_t>(0));
}

TEST_F(McapFile, ChunksHoldEveryMessageOnceAndInOrder) {
  write({.chunk_bytes = 700});
  ASSERT_GT(all(Opcode::kChunk).size(), 5u);
  int i = 0;
  std::uint32_t sequence[2] = {0, 0};
  for (const Record& chunk : all(Opcode::kChunk)) {
    for (const Record& message : open_chunk(chunk)) {
      if (message.opcode != Opcode::kMessage) continue;
      const int channel = i % 3 ? 1 : 2;
      EXPECT_EQ(message.at<std::uint16_t>(0), channel);
      EXPECT_EQ(message.at<std::uint32_t>(2), sequence[channel - 1]++);
      EXPECT_EQ(message.at<std::uint64_t>(6), 10'000'000u * i);
      EXPECT_EQ(message.at<std::uint64_t>(14), 5'000'000u * i);
      EXPECT_EQ(message.content.substr(22), "{\"i\":" + std::to_string(i) + "}");
      EXPECT_GE(message.at<std::uint64_t>(6), chunk.at<std::uint64_t>(0));
      EXPECT_LE(message.at<std::uint64_t>(6), chunk.at<std::uint64_t>(8));
      ++i;
    }
  }
  EXPECT_EQ(i, kMessages);
}

TEST_F(McapFile, IndexesPointAtTheirRecords) {
  write({.chunk_bytes = 700});
  const std::vector<Record> chunks = all(Opcode::kChunk), indexes = all(Opcode::kChunkIndex);
  ASSERT_EQ(chunks.size(), indexes.size());
  std::uint64_t indexed = 0;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    EXPECT_EQ(indexes[i].at<std::uint64_t>(16), chunks[i].start);
    EXPECT_EQ(indexes[i].at<std::uint64_t>(24), chunks[i].end() - chunks[i].start);
    const std::vector<Record> inside = open_chunk(chunks[i]);
    const auto map_bytes = indexes[i].at<std::uint32_t>(32);
    for (std::size_t entry = 36; entry < 36 + map_bytes; entry += 10) {
      const auto channel = indexes[i].at<std::uint16_t>(entry);
      const auto offset = indexes[i].at<std::uint64_t>(entry + 2);
      const Record index = parse(bytes_, offset, chunks[i].end() + indexes[i].at<std::uint64_t>(36 + map_bytes)).at(0);
      ASSERT_EQ(index.opcode, Opcode::kMessageIndex);
      EXPECT_EQ(index.at<std::uint16_t>(0), channel);
      for (std::size_t at = 6; at < index.content.size(); at += 16, ++indexed) {
        const auto message = std::find_if(inside.begin(), inside.end(), [&](const Record& record) {
          return record.start == index.at<std::uint64_t>(at + 8);
        });
        ASSERT_NE(message, inside.end());
        EXPECT_EQ(message->opcode, Opcode::kMessage);
        EXPECT_EQ(message->at<std::uint16_t>(0), channel);
        EXPECT_EQ(message->at<std::uint64_t>(6), index.at<std::uint64_t>(at));
      }
    }
  }
  EXPECT_EQ(indexed, std::uint64_t{kMessages});
}

TEST_F(McapFile, ChunksEndAfterTheirPeriod) {
  write({.chunk_period = std::chrono::milliseconds(100)});
  ASSERT_EQ(all(Opcode::kChunk).size(), std::size_t{kMessages / 10});
  for (const Record& chunk : all(Opcode::kChunk)) {
    EXPECT_EQ(chunk.at<std::uint64_t>(8) - chunk.at<std::uint64_t>(0), 90'000'000u);
  }
}

TEST_F(McapFile, WhatIsFlushedIsInTheFileBeforeItIsClosed) {
  Result<McapWriter> writer = McapWriter::create(path_);
  ASSERT_TRUE(writer);
  const auto channel = writer->add_channel({"/first", "Schema", "{}", {}});
  ASSERT_TRUE(writer->write(channel, Time{1}, Time{1}, "{}"));
  ASSERT_TRUE(writer->flush());
  const std::string bytes = test::read_file(path_);
  const std::vector<Record> records = parse(bytes, 8, bytes.size());
  ASSERT_EQ(records.size(), 3u);  // header, chunk, message index
  EXPECT_EQ(open_chunk(records[1]).back().opcode, Opcode::kMessage);
}

TEST_F(McapFile, IsValidWithoutMessages) {
  for (const bool with_channel : {false, true}) {
    Result<McapWriter> writer = McapWriter::create(path_);
    ASSERT_TRUE(writer);
    if (with_channel) writer->add_channel({"/first", "Schema", "{}", {}});
    ASSERT_TRUE(writer->close());
    ASSERT_TRUE(writer->close());
    bytes_ = test::read_file(path_);
    records_ = parse(bytes_, 8, bytes_.size() - 8);
    EXPECT_EQ(all(Opcode::kChannel).size(), with_channel ? 1u : 0u);
    const Record statistics = all(Opcode::kStatistics).at(0);
    EXPECT_EQ(statistics.at<std::uint64_t>(0), 0u);
    EXPECT_EQ(statistics.at<std::uint64_t>(26), 0u);
    EXPECT_EQ(statistics.at<std::uint64_t>(34), 0u);
  }
}

TEST(McapErrors, AFileThatCannotBeCreatedIsNamed) {
  const Result<McapWriter> writer = McapWriter::create("/nowhere/run.mcap");
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message.find("/nowhere/run.mcap"), std::string::npos);
}

TEST(McapErrors, AFullDiskIsReportedAndStays) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const Result<McapWriter> writer = McapWriter::create("/dev/full");
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message.find("No space left"), std::string::npos) << writer.error().message;
}

TEST(McapErrors, ANegativeTimeIsRefusedAndTheFileGoesOn) {
  Result<McapWriter> writer = McapWriter::create(test::temporary_file("negative.mcap"));
  ASSERT_TRUE(writer);
  const auto channel = writer->add_channel({"/first", "Schema", "{}", {}});
  EXPECT_FALSE(writer->write(channel, Time{-1}, Time{0}, "{}"));
  EXPECT_TRUE(writer->write(channel, Time{0}, Time{0}, "{}"));
  EXPECT_EQ(writer->message_count(), 1u);
  EXPECT_TRUE(writer->close());
  EXPECT_FALSE(writer->write(channel, Time{1}, Time{0}, "{}"));
}

}  // namespace
}  // namespace steadyhand
