// A hand that moves 10 cm to the side in a second, and where the joints are told to be then.
#include <cstdio>

#include "steadyhand/pipeline/pipeline.hpp"

int main() {
  using namespace steadyhand;
  auto arm = Pipeline::make("ur5e", "waiter");
  if (!arm) return std::fprintf(stderr, "%s\n", arm.error().message.c_str()), 2;
  JointCommand command;
  for (int i = 0; i <= 500; ++i) {
    const Time now = from_seconds(i / 500.0);
    OperatorSample hand;
    hand.stamp = {now, now};
    hand.X_operator_hand.p.y() = 0.1 * i / 500.0;
    hand.clutch = true;
    if (!(*arm)->feed(hand)) return 1;
    command = (*arm)->update(now);
  }
  for (const double q : command.q) std::printf("%.12f ", q);
  std::printf("\n");
}
