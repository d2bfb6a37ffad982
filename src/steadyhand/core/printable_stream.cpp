#include "steadyhand/core/printable_stream.hpp"

#include "steadyhand/core/text.hpp"

namespace steadyhand {

PrintableStream::PrintableStream(std::ostream& stream) : stream_(&stream), target_(stream.rdbuf(this)) {}

PrintableStream::~PrintableStream() {
  (void)sync();
  stream_->rdbuf(target_);
}

PrintableStream::int_type PrintableStream::overflow(int_type c) {
  if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
  line_ += traits_type::to_char_type(c);
  return line_.back() != '\n' || pass_on() ? c : traits_type::eof();
}

int PrintableStream::sync() { return pass_on() ? target_->pubsync() : -1; }

bool PrintableStream::pass_on() {
  const std::string shown = printable(line_);
  line_.clear();
  const auto size = static_cast<std::streamsize>(shown.size());
  return target_->sputn(shown.data(), size) == size;
}

}  // namespace steadyhand
