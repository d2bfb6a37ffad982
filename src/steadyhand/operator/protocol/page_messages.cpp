#include "steadyhand/operator/protocol/page_messages.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "steadyhand/core/json_in.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;
using Parsed = std::optional<Result<ClientMessage>>;

/// Other members of a stop are ignored: a mistake there must not keep the arm moving.
bool is_stop(const Json& json) {
  const auto is = [&](const char* key, const char* value) {
    const auto found = json.find(key);
    return found != json.end() && *found == value;
  };
  return is("type", RequestMessage::kType.data()) && is("kind", "stop");
}

/// Other members of another version's message are not known.
std::optional<HelloMessage> of_another_version(const Json& json) {
  const auto version = json.find("version");
  if (version == json.end() || !version->is_number_unsigned() || *version > 1'000'000) return std::nullopt;
  const int number = version->get<int>();
  return number == kProtocolVersion ? std::nullopt : std::optional(HelloMessage{number, {}});
}

template <typename Message>
Result<ClientMessage> read(const Json& json) {
  if constexpr (std::is_same_v<Message, HelloMessage>) {
    if (auto hello = of_another_version(json)) return ClientMessage(*std::move(hello));
  }
  Message message;
  JsonIn in(json, true);
  in.skip("type");
  in.members(message);
  if (in.error()) return *in.error();
  return ClientMessage(std::move(message));
}

/// Reads what `type` names; if it is none of these, `known` has all names.
template <typename... Messages>
Parsed read_any(const Json& json, std::string_view type, std::string& known, const std::variant<Messages...>*) {
  Parsed parsed;
  const auto attempt = [&]<typename Message>(std::type_identity<Message>) {
    known += (known.empty() ? "" : ", ") + std::string(Message::kType);
    if (!parsed && type == Message::kType) parsed = read<Message>(json);
  };
  (attempt(std::type_identity<Messages>{}), ...);
  return parsed;
}

}  // namespace

Result<ClientMessage> parse_client_message(std::string_view text) {
  if (text.size() > kMaxClientMessage) return Error{fmt::format("a message has at most {} bytes", kMaxClientMessage)};
  const Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (json.is_discarded()) return Error{"not JSON, or a number that no double holds"};
  if (!json.is_object()) return Error{"a message must be a JSON object"};
  const auto type = json.find("type");
  if (type == json.end() || !type->is_string()) return Error{"'type' must be text"};
  if (is_stop(json)) return ClientMessage(RequestMessage{});
  std::string known;
  Parsed parsed =
      read_any(json, type->get_ref<const std::string&>(), known, static_cast<const ClientMessage*>(nullptr));
  if (parsed) return *std::move(parsed);
  return Error{fmt::format("'type' must be one of {}, not {}", known, excerpt(*type))};
}

PolicyTarget TargetMessage::target() const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  return {{p.value_or(Vector3::Constant(kNone)), q.value_or(Quaternion::Identity())}, gripper, tool};
}

Shape PlacedShape::shape() const {
  switch (kind) {
    case ShapeKind::kSphere:
      return Shape::sphere(radius);
    case ShapeKind::kCapsule:
      return Shape::capsule(0.5 * length, radius);
    case ShapeKind::kCylinder:
      return Shape::cylinder(radius, 0.5 * length);
    case ShapeKind::kBox:
      return Shape::box(0.5 * size - Vector3::Constant(rounding), rounding);
    case ShapeKind::kHalfSpace:
      break;
  }
  return Shape::half_space();
}

CellObject PlacedShape::object(const std::string& name) const {
  CellObject object;
  object.name = name;
  object.shape = shape();
  object.origin = Eigen::Translation3d(X_base_shape.p) * X_base_shape.q;
  object.velocity = velocity.value_or(Vector3::Zero());
  object.margin = margin;
  return object;
}

std::string picture_message(const VideoPacket& packet) {
  static_assert(std::endian::native == std::endian::little, "numbers of a picture's head are little-endian");
  constexpr std::size_t kHead = 16;
  const auto camera = static_cast<std::uint16_t>(packet.camera);
  const double exposed = to_seconds(packet.stamp.hand);
  std::string message(kHead, '\0');
  message[0] = 1;  // type: a frame follows
  message[1] = packet.is_key ? 1 : 0;
  std::memcpy(&message[2], &camera, sizeof(camera));
  std::memcpy(&message[8], &exposed, sizeof(exposed));
  return message += packet.data;
}

}  // namespace steadyhand
