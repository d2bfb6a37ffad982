#include "steadyhand/operator/server/peer_user.hpp"

#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>

namespace steadyhand {
namespace {

using boost::asio::ip::tcp;

struct Question {
  nlmsghdr head;
  inet_diag_req_v2 request;
};

struct Answer {
  nlmsghdr head;
  inet_diag_msg socket;
  std::byte more[512];  // attributes that come unasked
};

/// The one socket of this machine that is connected so, as seen from its own end.
Question ask_for(const tcp::endpoint& from, const tcp::endpoint& to) {
  Question q{};
  q.head.nlmsg_len = sizeof q;
  q.head.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  q.head.nlmsg_flags = NLM_F_REQUEST;
  q.request.sdiag_family = AF_INET;
  q.request.sdiag_protocol = IPPROTO_TCP;
  q.request.idiag_states = ~0u;
  inet_diag_sockid& id = q.request.id;
  id.idiag_sport = htons(from.port());
  id.idiag_dport = htons(to.port());
  const auto source = from.address().to_v4().to_bytes(), destination = to.address().to_v4().to_bytes();
  std::memcpy(id.idiag_src, source.data(), source.size());
  std::memcpy(id.idiag_dst, destination.data(), destination.size());
  id.idiag_cookie[0] = id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  return q;
}

}  // namespace

std::optional<unsigned> peer_user(const tcp::socket& socket) {
  boost::system::error_code gone;
  const tcp::endpoint here = socket.local_endpoint(gone), there = socket.remote_endpoint(gone);
  if (gone || !here.address().is_v4() || !there.address().is_v4() || !there.address().is_loopback()) return {};
  const int kernel = ::socket(AF_NETLINK, SOCK_DGRAM | SOCK_CLOEXEC, NETLINK_SOCK_DIAG);
  if (kernel < 0) return {};
  const Question question = ask_for(there, here);
  Answer answer{};
  // The kernel has answered by the time that it has taken the question.
  const bool asked = ::send(kernel, &question, sizeof question, 0) == static_cast<ssize_t>(sizeof question);
  const ssize_t size = asked ? ::recv(kernel, &answer, sizeof answer, MSG_DONTWAIT) : -1;
  ::close(kernel);
  if (size < static_cast<ssize_t>(offsetof(Answer, more)) || answer.head.nlmsg_type != SOCK_DIAG_BY_FAMILY) return {};
  if (answer.socket.idiag_state != TCP_ESTABLISHED) return {};
  return answer.socket.idiag_uid;
}

}  // namespace steadyhand
