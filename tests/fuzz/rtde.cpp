// Bytes from a controller over RTDE: the first one selects how the rest is split into pieces.
#include <sys/socket.h>

#include "fuzz/fuzz.hpp"
#include "steadyhand/arms/ur/rtde_client.hpp"

namespace steadyhand {

FUZZ(rtde) {
  if (input.size() < 2) return;
  const std::size_t piece = 1 + static_cast<std::uint8_t>(input.front());
  input.remove_prefix(1);
  RtdeFramer framer;
  std::size_t seen = 0;
  for (std::string_view rest = input; !rest.empty() && !framer.broken();) {
    const std::size_t size = std::min(piece, rest.size());
    const auto space = framer.space();
    fuzz::require(space.size() >= size, "room for a packet");
    std::copy_n(rest.begin(), size, space.begin());
    framer.filled(size);
    rest.remove_prefix(size);
    for (RtdePacket packet; framer.next(packet);) seen += kRtdeHeader + packet.payload.size();
  }
  fuzz::require(seen <= input.size(), "no more than came");

  auto ends = Socket::pair();
  fuzz::require(static_cast<bool>(ends), "a pair of sockets");
  std::size_t sent = 0;
  (void)ends->first.send({reinterpret_cast<const std::uint8_t*>(input.data()), input.size()}, sent);
  (void)shutdown(ends->first.descriptor(), SHUT_WR);  // nothing more will be sent: the reader need not wait for it
  const RtdeRecipes recipes{{{"timestamp", "DOUBLE", ""}, {"actual_q", "VECTOR6D", "target_q"}},
                            {{"input_int_register_24", "INT32", ""}}};
  auto client = RtdeClient::start(std::move(ends->second), recipes, std::chrono::seconds(1));
  if (!client) return fuzz::require(!client.error().message.empty(), "a refusal says why");
  while ((*client)->fill() == Socket::Outcome::kDone) {
    for (RtdeReader data({}); (*client)->next(data);)
      fuzz::require(data.left() == 56, "a package of the recipe's size");
  }
}

}  // namespace steadyhand
