#pragma once

#include <ostream>
#include <streambuf>
#include <string>

namespace steadyhand {

/// As long as it lives, what is written to a stream reaches it as printable() has it, a line at a time: names of files
/// and what is in them must not command the user's terminal.
class PrintableStream final : private std::streambuf {
 public:
  explicit PrintableStream(std::ostream& stream);
  ~PrintableStream() override;

 private:
  int_type overflow(int_type c) override;
  int sync() override;
  bool pass_on();

  std::ostream* stream_;
  std::streambuf* target_;
  std::string line_;
};

}  // namespace steadyhand
