#include "serve/frames.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace steadyhand {
namespace {

using Kind = FrameEvent::Kind;

/// As a client sends it.
std::string frame(unsigned head, const std::string& payload, std::uint32_t mask = 0x37fa213d) {
  std::string bytes(1, static_cast<char>(head));
  if (payload.size() < 126) {
    bytes += static_cast<char>(0x80 | payload.size());
  } else {
    bytes += {static_cast<char>(0xfe), static_cast<char>(payload.size() >> 8), static_cast<char>(payload.size())};
  }
  std::string key;
  for (int i = 3; i >= 0; --i) key += static_cast<char>(mask >> (8 * i));
  bytes += key;
  for (std::size_t i = 0; i < payload.size(); ++i) bytes += static_cast<char>(payload[i] ^ key[i % 4]);
  return bytes;
}

struct Heard {
  Kind kind;
  std::string payload;
  CloseCode code;
  bool operator==(const Heard& other) const { return kind == other.kind && payload == other.payload; }
};

/// All events of these bytes, fed in pieces of at most this size.
std::vector<Heard> hear(std::string_view bytes, std::size_t piece, std::size_t longest = 2048) {
  FrameReader reader(longest);
  std::vector<Heard> heard;
  while (!bytes.empty()) {
    std::string_view part = bytes.substr(0, piece);
    bytes.remove_prefix(part.size());
    while (!part.empty()) {
      const FrameEvent event = reader.next(part);
      if (event.kind == Kind::kNone) continue;
      heard.push_back({event.kind, std::string(event.payload), event.code});
      if (event.kind == Kind::kBroken || event.kind == Kind::kClose) return heard;
    }
  }
  return heard;
}

TEST(Frames, ReadsTheExamplesOfTheRfc) {
  const std::string hello("\x81\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58", 11);
  EXPECT_EQ(frame(0x81, "Hello"), hello);
  EXPECT_EQ(hear(hello, 11), (std::vector<Heard>{{Kind::kMessage, "Hello", {}}}));
  EXPECT_EQ(accept_key("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
}

TEST(Frames, WritesTheThreeKindsOfLengths) {
  const auto head = [](std::size_t size) {
    std::string out;
    append_frame_head(out, Opcode::kText, size);
    return out;
  };
  EXPECT_EQ(head(5), "\x81\x05");
  EXPECT_EQ(head(125), "\x81\x7d");
  EXPECT_EQ(head(126), std::string("\x81\x7e\x00\x7e", 4));
  EXPECT_EQ(head(65535), "\x81\x7e\xff\xff");
  EXPECT_EQ(head(65536), std::string("\x81\x7f\x00\x00\x00\x00\x00\x01\x00\x00", 10));
}

/// In pieces of any size; with control frames between the parts of a message.
TEST(Frames, PutsTogetherWhatComesInPieces) {
  const std::string longest(2048, 'x');
  const std::string bytes = frame(0x01, "one ") + frame(0x89, "ping") + frame(0x00, "") + frame(0x8a, "") +
                            frame(0x80, "two") + frame(0x82, longest) + frame(0x81, "") + frame(0x81, "last");
  const std::vector<Heard> expected = {{Kind::kPart, "", {}},           {Kind::kPing, "ping", {}},
                                       {Kind::kPart, "", {}},           {Kind::kPong, "", {}},
                                       {Kind::kMessage, "one two", {}}, {Kind::kMessage, longest, {}},
                                       {Kind::kMessage, "", {}},        {Kind::kMessage, "last", {}}};
  for (std::size_t piece = 1; piece < 40; ++piece) EXPECT_EQ(hear(bytes, piece), expected) << piece;
  EXPECT_EQ(hear(bytes, bytes.size()), expected);
}

TEST(Frames, RefusesWhatTheRfcForbids) {
  std::string unmasked = frame(0x81, "a");
  unmasked[1] = 1;
  const std::string huge("\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff\x00\x00\x00\x00", 14);
  const struct {
    const char* what;
    std::string bytes;
    CloseCode code;
  } cases[] = {
      {"no mask", unmasked, CloseCode::kProtocol},
      {"a reserved bit", frame(0xc1, "a"), CloseCode::kProtocol},
      {"an unknown opcode", frame(0x83, "a"), CloseCode::kProtocol},
      {"an unknown control frame", frame(0x8b, "a"), CloseCode::kProtocol},
      {"a ping in parts", frame(0x09, "a"), CloseCode::kProtocol},
      {"a long ping", frame(0x89, std::string(126, 'a')), CloseCode::kProtocol},
      {"a part of nothing", frame(0x80, "a"), CloseCode::kProtocol},
      {"a message within a message", frame(0x01, "a") + frame(0x81, "b"), CloseCode::kProtocol},
      {"too long", frame(0x81, std::string(2049, 'a')), CloseCode::kTooBig},
      {"too long in parts", frame(0x01, std::string(2000, 'a')) + frame(0x80, std::string(49, 'a')),
       CloseCode::kTooBig},
      {"a length that overflows", huge, CloseCode::kTooBig},
      {"a length that overflows with what is there", frame(0x01, "a") + '\x80' + huge.substr(1), CloseCode::kTooBig},
  };
  for (const auto& [what, bytes, code] : cases) {
    const auto heard = hear(bytes + frame(0x81, "never heard"), 1000);
    ASSERT_FALSE(heard.empty()) << what;
    EXPECT_EQ(heard.back().kind, Kind::kBroken) << what;
    EXPECT_EQ(heard.back().code, code) << what;
  }
}

TEST(Frames, NoBytesBreakTheReader) {
  std::mt19937 random(3);
  long long whole = 0, broken = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = frame(0x81, "good") + frame(random() % 2 ? 0x01 : 0x89, std::string(random() % 130, 'x'));
    for (auto edits = random() % 4; edits > 0; --edits) bytes[random() % bytes.size()] = static_cast<char>(random());
    for (const Heard& heard : hear(bytes, 1 + random() % 64, 256)) {
      EXPECT_LE(heard.payload.size(), 256u);
      whole += heard.kind == Kind::kMessage;
      broken += heard.kind == Kind::kBroken;
    }
  }
  EXPECT_GT(whole, 5000);
  EXPECT_GT(broken, 1000);
}

}  // namespace
}  // namespace steadyhand
