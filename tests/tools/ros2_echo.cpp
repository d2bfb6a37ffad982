// Sends each message that comes at /echo/in/TYPE back at /echo/out/TYPE, read and written as our types have it. For the
// test in Python that holds them against the types of others. Until a signal.
#include <signal.h>

#include <iostream>

#include "steadyhand/arms/ros2/node.hpp"

namespace {

using namespace steadyhand;

template <typename Message>
Status echo(Ros2Node& node, const std::string& type) {
  auto back = node.publish<Message>("/echo/out/" + type);
  if (!back) return back.error();
  return node.listen<Message>("/echo/in/" + type, [back = *back](const Message& message, Ros2PublisherId) mutable {
    (void)back.send(message);
  });
}

Status echo_all(Ros2Node& node) {
  for (const Status& made : {echo<JointTrajectoryMessage>(node, "JointTrajectory"),
                             echo<JointStateMessage>(node, "JointState"), echo<PoseStampedMessage>(node, "PoseStamped"),
                             echo<PathMessage>(node, "Path"), echo<MarkerArrayMessage>(node, "MarkerArray")}) {
    if (!made) return made;
  }
  return Done{};
}

}  // namespace

int main() {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  const auto fail = [](const Error& error) {
    std::cerr << error.message << "\n";
    return 2;
  };
  const auto domain = ros2_domain();
  if (!domain) return fail(domain.error());
  const auto node = Ros2Node::open(*domain);
  if (!node) return fail(node.error());
  if (const Status made = echo_all(**node); !made) return fail(made.error());
  std::cout << "ready" << std::endl;
  int signal = 0;
  sigwait(&ends, &signal);
}
