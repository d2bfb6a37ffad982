#include "steadyhand/apps/commands/progress_bar.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "steadyhand/core/text.hpp"

namespace steadyhand {

ProgressBar::ProgressBar(int runs, std::string doing)
    : doing_(std::move(doing)),
      runs_(runs),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()),
      drawn_(start_) {}

void ProgressBar::show(const std::string& run, double fraction) {
  if (!terminal_) {
    if (announced_ == run) return;
    announced_ = run;
    fmt::print(stderr, "{} {}{}\n", doing_, run, runs_ > 1 ? fmt::format(" ({} of {})", done_ + 1, runs_) : "");
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (now - drawn_ < std::chrono::milliseconds(50) && fraction < 1.0) return;
  drawn_ = now;
  there_ = true;
  const double total = (done_ + fraction) / runs_;
  const double left = std::chrono::duration<double>(now - start_).count() * (1.0 - total) / total;
  constexpr int kWidth = 40;
  const int filled = static_cast<int>(total * kWidth + 0.5);
  fmt::print(stderr, "\r\033[K{:<14} [{:=<{}}{:<{}}] {:3.0f} %  {:.0f} s left", printable(run), "", filled, "",
             kWidth - filled, 100.0 * total, left);
  std::fflush(stderr);
}

void ProgressBar::finish() {
  if (there_) fmt::print(stderr, "\r\033[K");
  there_ = false;
}

}  // namespace steadyhand
