#include "serve/http.hpp"

#include <gtest/gtest.h>

#include <random>

namespace steadyhand {
namespace {

TEST(Http, ReadsARequest) {
  const auto request = parse_request(
      "GET /live?x=1 HTTP/1.1\r\nHost: robot.local:8642\r\nCONNECTION: keep-alive, Upgrade\r\nUpgrade: WebSocket\r\n"
      "Empty:\r\nSpaced: \t a b \t\r\n\r\n");
  ASSERT_TRUE(request);
  EXPECT_EQ(request->method, "GET");
  EXPECT_EQ(request->target, "/live?x=1");
  EXPECT_EQ(request->host(), "robot.local:8642");
  EXPECT_TRUE(request->wants_websocket());
  EXPECT_TRUE(request->keep_alive);
  EXPECT_EQ(*request->find("empty"), "");
  EXPECT_EQ(*request->find("spaced"), "a b");
  EXPECT_EQ(request->find("none"), nullptr);
}

TEST(Http, KnowsWhatIsKeptAlive) {
  const auto kept = [](const std::string& text) { return parse_request("GET / " + text + "\r\n\r\n")->keep_alive; };
  EXPECT_TRUE(kept("HTTP/1.1"));
  EXPECT_FALSE(kept("HTTP/1.1\r\nConnection: Close"));
  EXPECT_FALSE(kept("HTTP/1.0"));
  EXPECT_TRUE(kept("HTTP/1.0\r\nConnection: keep-alive"));
  EXPECT_FALSE(
      parse_request("GET / HTTP/1.1\r\nConnection: upgraded\r\nUpgrade: websocket\r\n\r\n")->wants_websocket());
}

TEST(Http, RefusesWhatCouldBeUnderstoodDifferently) {
  for (const std::string text : {
           "",
           "GET\r\n",
           "GET /\r\n",
           "GET / HTTP/2.0\r\n",
           "GET / HTTP/1.1 \r\n",
           "GET  / HTTP/1.1\r\n",
           "G@T / HTTP/1.1\r\n",
           "GET /\x01 HTTP/1.1\r\n",
           "GET / HTTP/1.1\r\nno colon\r\n",
           "GET / HTTP/1.1\r\nHost : a\r\n",
           "GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\n",
           "GET / HTTP/1.1\r\nHost: a\r\n folded: b\r\n",
           "GET / HTTP/1.1\r\nHost: a\nOther: b\r\n",
           "GET / HTTP/1.1\r\nContent-Length: 5\r\n",
           "GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n",
       }) {
    EXPECT_FALSE(parse_request(text + "\r\n")) << text;
  }
  EXPECT_TRUE(parse_request("GET / HTTP/1.1\r\nContent-Length: 0\r\n\r\n"));
  std::string many = "GET / HTTP/1.1\r\n";
  for (int i = 0; i < 200; ++i) many += "a: b\r\n";
  EXPECT_FALSE(parse_request(many + "\r\n"));
}

TEST(Http, NoBytesBreakTheReader) {
  std::mt19937 random(4);
  const std::string good = "GET /index.html HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  int read = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text = good;
    for (auto edits = random() % 4; edits > 0; --edits) text[random() % text.size()] = static_cast<char>(random());
    const auto request = parse_request(text);
    if (!request) continue;
    ++read;
    for (const auto& [name, value] : request->fields)
      EXPECT_EQ((name + value).find_first_of("\r\n"), std::string::npos);
  }
  EXPECT_GT(read, 5000);
  EXPECT_LT(read, 20'000);
}

TEST(Http, WritesAHead) {
  EXPECT_EQ(answer_head(HttpStatus::kNotFound, {{"Content-Length", "0"}}),
            "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n");
}

}  // namespace
}  // namespace steadyhand
