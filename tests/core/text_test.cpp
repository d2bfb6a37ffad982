#include "steadyhand/core/text.hpp"

#include <gtest/gtest.h>

#include <sstream>
#include <utility>
#include <vector>

#include "steadyhand/core/printable_stream.hpp"

namespace steadyhand {
namespace {

TEST(Printable, LeavesTextAndShowsWhatWouldCommandATerminal) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", ""},
      {"plain, 0 to 9\n\ttabs and lines\n", "plain, 0 to 9\n\ttabs and lines\n"},
      {"grün, 碗, 🍵, █▀▄", "grün, 碗, 🍵, █▀▄"},
      {"\x1b[2J\x1b]0;title\a", "\\x1b[2J\\x1b]0;title\\x07"},
      {"a\rb\bc\x7f", "a\\x0db\\x08c\\x7f"},
      {std::string("\0", 1), "\\x00"},
      {"\xc2\x9b"
       "2J",
       "\\xc2\\x9b2J"},  // CSI in one character
      {"\x9b"
       "2J",
       "\\x9b2J"},  // the same for a terminal that knows no UTF-8
      {"a\u202eb\u2066", "a\\xe2\\x80\\xaeb\\xe2\\x81\\xa6"},
      {"\xc0\x9b", "\\xc0\\x9b"},                    // the same as 1b, in too many bytes
      {"\xed\xa0\x80", "\\xed\\xa0\\x80"},           // half a pair
      {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"},  // beyond the last character
      {"cut \xe2\x96", "cut \\xe2\\x96"},
  };
  for (const auto& [text, shown] : cases) EXPECT_EQ(printable(text), shown);
}

TEST(PrintableStream, ShowsControlCharactersAsLongAsItLives) {
  std::ostringstream out;
  {
    PrintableStream shown(out);
    out << "a name: \x1b[2J" << "\xe2" << "\x96\x88\n" << "no end";
    EXPECT_EQ(out.str(), "a name: \\x1b[2J\u2588\n");
  }
  out << "\x1b[0m";
  EXPECT_EQ(out.str(), "a name: \\x1b[2J\u2588\nno end\x1b[0m");
}

}  // namespace
}  // namespace steadyhand
