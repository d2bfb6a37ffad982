#pragma once

#include <ostream>
#include <streambuf>
#include <string>

namespace steadyhand {

/// While it exists, text for a stream passes through printable(), a line at a time: the names and contents of files
/// must not control the user's terminal.
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
