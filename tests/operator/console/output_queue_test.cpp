#include "steadyhand/operator/console/output_queue.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <string>
#include <thread>

namespace steadyhand {
namespace {

using Clock = std::chrono::steady_clock;

struct Pipe {
  Pipe() {
    EXPECT_EQ(pipe2(ends, O_CLOEXEC), 0);
    signal(SIGPIPE, SIG_IGN);
  }
  ~Pipe() {
    close_reader();
    close(ends[1]);
  }
  void close_reader() {
    if (ends[0] >= 0) close(ends[0]);
    ends[0] = -1;
  }
  std::string read_until(const std::string& end) {
    std::string text;
    char piece[1000];
    while (text.size() < end.size() || text.compare(text.size() - end.size(), end.size(), end) != 0) {
      const ssize_t got = read(ends[0], piece, sizeof(piece));
      if (got <= 0) break;
      text.append(piece, static_cast<std::size_t>(got));
    }
    return text;
  }
  int ends[2];
};

std::string line(int i) { return "line " + std::to_string(i) + " of what the program says\n"; }

TEST(OutputQueue, LosesNothingOnAReaderThatKeepsUp) {
  Pipe pipe;
  OutputQueue out(pipe.ends[1]);
  std::string said, read;
  for (int round = 0; round < 100; ++round) {  // 3 MB, of which never more than 32 KB wait
    for (int i = 0; i < 1000; ++i) {
      said += line(i);
      out.say(line(i));
    }
    out.say("end of the round\n");
    said += "end of the round\n";
    read += pipe.read_until("end of the round\n");
  }
  EXPECT_TRUE(out.finish(std::chrono::seconds(5)));
  EXPECT_TRUE(read == said);
}

TEST(OutputQueue, NobodyWaitsForAReaderThatDoesNotRead) {
  static Pipe& pipe = *new Pipe;  // for good: the thread that is left behind writes into it
  const auto begin = Clock::now();
  {
    OutputQueue out(pipe.ends[1]);
    for (int i = 0; i < 100000; ++i) out.say(line(i));  // 3 MB
    EXPECT_FALSE(out.finish(std::chrono::milliseconds(200)));
  }
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(5));
}

TEST(OutputQueue, TellsWhatIsMissing) {
  Pipe pipe;
  OutputQueue out(pipe.ends[1]);
  out.say(std::string(OutputQueue::kMost, '.'));  // more than the pipe holds
  std::string read = pipe.read_until(".");        // the writer is in the middle of it, and blocked
  const int lines = 2 * OutputQueue::kMost / static_cast<int>(line(0).size());
  for (int i = 0; i < lines; ++i) out.say(line(0));
  std::atomic<bool> seen{false};
  std::thread reader([&] {
    read = pipe.read_until("the last line\n");
    seen = true;
  });
  while (!seen) {
    out.say("the last line\n");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  reader.join();
  EXPECT_NE(read.find(" lines are missing here: the terminal did not read them in time)\nthe last line\n"),
            std::string::npos);
  EXPECT_FALSE(out.finish(std::chrono::seconds(5)));
}

TEST(OutputQueue, NoTextCommandsATerminalButOurOwn) {
  Pipe pipe;
  OutputQueue out(pipe.ends[1]);
  out.say("refused: there is no recording '\x1b]0;mine\a'\n");
  out.draw("\x1b[0m the end\n");
  EXPECT_EQ(pipe.read_until("the end\n"), "refused: there is no recording '\\x1b]0;mine\\x07'\n\x1b[0m the end\n");
}

TEST(OutputQueue, AReaderThatGoesAwayIsAnError) {
  Pipe pipe;
  OutputQueue out(pipe.ends[1]);
  pipe.close_reader();
  out.say("nobody reads this\n");
  EXPECT_FALSE(out.finish(std::chrono::seconds(5)));
}

TEST(OutputQueue, WithoutAWordItEndsAtOnce) {
  Pipe pipe;
  OutputQueue out(pipe.ends[1]);
  EXPECT_TRUE(out.finish(std::chrono::seconds(5)));
}

}  // namespace
}  // namespace steadyhand
