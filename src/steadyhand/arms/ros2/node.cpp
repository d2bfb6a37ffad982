#include "steadyhand/arms/ros2/node.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>

#include "steadyhand/core/attempt.hpp"

namespace steadyhand {

namespace {

constexpr int kLastDomain = 232;  ///< beyond it DDS's ports end
constexpr int kPriority = 70;     ///< between control and planner
constexpr int kAtOnce = 8;        ///< messages taken in one go
constexpr int kNeighbours = 60;   ///< participants on this computer, besides ours; the last domain has ports for 62

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;
using DdsListener = std::unique_ptr<dds_listener_t, decltype(&dds_delete_listener)>;

Error failure(const std::string& what, dds_return_t code) {
  return Error{
      fmt::format("{}: {} (Cyclone DDS; check the configuration in CYCLONEDDS_URI)", what, dds_strretcode(code))};
}

/// On DDS the topics of ROS begin with rt, and those of services with rq and rr.
std::string dds_name(const Ros2Topic& topic) {
  const std::string name = (topic.name.starts_with('/') ? "" : "/") + topic.name;
  switch (topic.kind) {
    case Ros2Topic::Kind::kRequest:
      return "rq" + name + "Request";
    case Ros2Topic::Kind::kReply:
      return "rr" + name + "Reply";
    case Ros2Topic::Kind::kTopic:
      break;
  }
  return "rt" + name;
}

Qos make_qos(bool reliable, int depth, const Ros2Type& type) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  dds_qset_reliability(qos.get(), reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(100));
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  if (!type.hash.empty()) {
    const std::string told = fmt::format("typehash=RIHS01_{};", type.hash);
    dds_qset_userdata(qos.get(), told.data(), told.size());
  }
  return qos;
}

/// Addresses of this computer for nodes on it: its loopback, on which some nodes accept no messages, and its other
/// interfaces.
std::vector<std::string> own_addresses() {
  std::vector<std::string> found = {"127.0.0.1"};
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return found;
  for (const ifaddrs* i = list; i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    if ((i->ifa_flags & IFF_UP) == 0 || (i->ifa_flags & IFF_LOOPBACK) != 0) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto& address = *reinterpret_cast<const sockaddr_in*>(i->ifa_addr);
    if (inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size()) != nullptr) found.emplace_back(text.data());
  }
  freeifaddrs(list);
  return found;
}

/// Domains are set up once a process, before the first node joins, and end after the last.
class Domains {
 public:
  static Domains& instance() {
    static Domains domains;
    return domains;
  }
  Status join(int number) {
    const std::lock_guard lock(mutex_);
    if (const auto found = joined_.find(number); found != joined_.end()) {
      ++found->second.nodes;
      return Done{};
    }
    const Result<std::string> configuration = ros2_discovery();
    if (!configuration) return configuration.error();
    const dds_entity_t domain = dds_create_domain(static_cast<dds_domainid_t>(number), configuration->c_str());
    if (domain < 0) return failure(fmt::format("ROS 2 domain {} cannot be set up", number), domain);
    joined_[number] = {domain, 1};
    return Done{};
  }
  void leave(int number) {
    const std::lock_guard lock(mutex_);
    const auto found = joined_.find(number);
    if (--found->second.nodes > 0) return;
    (void)dds_delete(found->second.domain);
    joined_.erase(found);
  }

 private:
  struct Joined {
    dds_entity_t domain = 0;
    int nodes = 0;
  };
  std::mutex mutex_;
  std::map<int, Joined> joined_;
};

}  // namespace

/// Called by DDS, whose code is C: nothing may be thrown through it.
void Ros2Node::take(dds_entity_t reader, void* listener) {
  const auto& [on_message, failed] = *static_cast<const Listener*>(listener);
  std::array<void*, kAtOnce> messages{};
  std::array<dds_sample_info_t, kAtOnce> infos;
  for (;;) {
    messages[0] = nullptr;  // DDS lends its own
    const dds_return_t count = dds_take(reader, messages.data(), infos.data(), kAtOnce, kAtOnce);
    if (count <= 0) return;
    for (int i = 0; i < count; ++i) {
      if (!infos[i].valid_data) continue;
      try {
        on_message(messages[i], infos[i].publication_handle);
      } catch (const std::exception& error) {
        if (failed) failed(error.what());
      } catch (...) {
        if (failed) failed("of unknown kind");
      }
    }
    (void)dds_return_loan(reader, messages.data(), count);
  }
}

Result<int> ros2_domain(int wanted) {
  if (wanted >= 0) return wanted;
  const char* text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == '\0') return 0;
  int domain = -1;
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, domain);
  if (error != std::errc() || stop != end || domain < 0 || domain > kLastDomain) {
    return Error{fmt::format("ROS_DOMAIN_ID is '{}'; it must be a whole number from 0 to {}", text, kLastDomain)};
  }
  return domain;
}

Result<std::string> ros2_discovery() {
  const auto variable = [](const char* name) {
    const char* text = std::getenv(name);
    return std::string_view(text == nullptr ? "" : text);
  };
  const std::string own(variable("CYCLONEDDS_URI"));
  const std::string_view range = variable("ROS_AUTOMATIC_DISCOVERY_RANGE");
  if (range == "SYSTEM_DEFAULT") return own;
  if (!range.empty() && range != "SUBNET" && range != "LOCALHOST") {
    return Error{fmt::format(
        "ROS_AUTOMATIC_DISCOVERY_RANGE is '{}'; it must be SUBNET, LOCALHOST or SYSTEM_DEFAULT, for others to be found",
        range)};
  }
  std::string peers;
  const auto add = [&](std::string_view peer) { peers += fmt::format("<Peer address='{}'/>", peer); };
  for (const std::string& address : own_addresses()) add(address);
  std::string_view rest = variable("ROS_STATIC_PEERS");
  while (!rest.empty()) {
    const std::string_view peer = rest.substr(0, rest.find(';'));
    rest.remove_prefix(std::min(rest.size(), peer.size() + 1));
    if (peer.find_first_of("<>&'\"") != peer.npos) {
      return Error{fmt::format("ROS_STATIC_PEERS has '{}'; it must be a host's name or address", peer)};
    }
    if (!peer.empty()) add(peer);
  }
  return fmt::format(
      "<CycloneDDS><Domain>{}<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>{}"
      "</MaxAutoParticipantIndex><Peers>{}</Peers></Discovery></Domain></CycloneDDS>,{}",
      range == "LOCALHOST" ? "<General><AllowMulticast>false</AllowMulticast></General>" : "", kNeighbours, peers, own);
}

void prefer_this_thread() {
  sched_param priority{};
  priority.sched_priority = kPriority;
  (void)pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
}

Result<std::unique_ptr<Ros2Node>> Ros2Node::open(int domain, bool realtime, OnFailure failed) {
  if (domain < 0 || domain > kLastDomain) {
    return Error{fmt::format("ROS 2 domain is {}; it must be from 0 to {}", domain, kLastDomain)};
  }
  Qos qos(dds_create_qos(), dds_delete_qos);
  constexpr std::string_view kEnclave = "enclave=/;";  // what ROS looks for in a participant
  dds_qset_userdata(qos.get(), kEnclave.data(), kEnclave.size());
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_NONE);
  dds_entity_t participant = 0;
  Status joined = Done{};
  std::thread([&] {  // the threads of DDS inherit this one's priority
    if (realtime) prefer_this_thread();
    const Status attempted = attempt([&] { joined = Domains::instance().join(domain); });
    if (!attempted) joined = attempted;
    if (!joined) return;
    participant = dds_create_participant(static_cast<dds_domainid_t>(domain), qos.get(), nullptr);
  })
      .join();
  if (!joined) return joined.error();
  if (participant < 0) {
    Domains::instance().leave(domain);
    return failure(fmt::format("ROS 2 domain {} cannot be joined", domain), participant);
  }
  return std::unique_ptr<Ros2Node>(new Ros2Node(domain, participant, std::move(failed)));
}

Ros2Node::~Ros2Node() {
  (void)dds_delete(participant_);
  Domains::instance().leave(domain_);
}

std::vector<int> Ros2Subscription::publishers() const {
  std::array<dds_instance_handle_t, kNeighbours> handles{};
  const dds_return_t count = dds_get_matched_publications(reader_, handles.data(), handles.size());
  std::vector<int> vendors;
  for (int i = 0; i < std::min<int>(count, kNeighbours); ++i) {
    dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader_, handles[i]);
    if (endpoint == nullptr) continue;  // gone meanwhile
    vendors.push_back(endpoint->key.v[0] << 8 | endpoint->key.v[1]);
    dds_builtintopic_free_endpoint(endpoint);
  }
  return vendors;
}

/// A topic's descriptor is read, not kept, while it is made.
Result<dds_entity_t> Ros2Node::make_topic(const Ros2Type& type, const Ros2Topic& topic) {
  const dds_topic_descriptor_t& own = *type.descriptor;
  const dds_topic_descriptor_t named{own.m_size,
                                     own.m_align,
                                     own.m_flagset,
                                     own.m_nkeys,
                                     type.name == nullptr ? own.m_typename : type.name,
                                     own.m_keys,
                                     own.m_nops,
                                     own.m_ops,
                                     own.m_meta,
                                     own.type_information,
                                     own.type_mapping,
                                     own.restrict_data_representation};
  const dds_entity_t entity = dds_create_topic(participant_, &named, dds_name(topic).c_str(), nullptr, nullptr);
  if (entity < 0) return failure(fmt::format("ROS 2 topic '{}' cannot be made", topic.name), entity);
  return entity;
}

Result<dds_entity_t> Ros2Node::make_writer(const Ros2Type& type, const Ros2Topic& topic, Time lifespan) {
  const Result<dds_entity_t> entity = make_topic(type, topic);
  if (!entity) return entity.error();
  const Qos qos = make_qos(true, topic.every ? kAtOnce : 1, type);
  if (lifespan > Time(0)) dds_qset_lifespan(qos.get(), lifespan.count());
  const dds_entity_t writer = dds_create_writer(participant_, *entity, qos.get(), nullptr);
  if (writer < 0) return failure(fmt::format("ROS 2 topic '{}' cannot be published", topic.name), writer);
  return writer;
}

Result<dds_entity_t> Ros2Node::make_reader(const Ros2Type& type, const Ros2Topic& topic, OnMessage on_message) {
  const Result<dds_entity_t> entity = make_topic(type, topic);
  if (!entity) return entity.error();
  const Qos qos = make_qos(topic.every, kAtOnce, type);
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  listeners_.push_back(std::make_unique<Listener>(Listener{std::move(on_message), failed_}));
  const DdsListener listener(dds_create_listener(listeners_.back().get()), dds_delete_listener);
  dds_lset_data_available(listener.get(), take);
  const dds_entity_t reader = dds_create_reader(participant_, *entity, qos.get(), listener.get());
  if (reader < 0) return failure(fmt::format("ROS 2 topic '{}' cannot be subscribed", topic.name), reader);
  return reader;
}

}  // namespace steadyhand
