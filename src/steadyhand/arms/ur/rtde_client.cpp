#include "steadyhand/arms/ur/rtde_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

namespace steadyhand {

namespace {

std::size_t size_of(std::string_view type) {
  struct Size {
    std::string_view type;
    std::size_t bytes;
  };
  constexpr Size kSizes[] = {{"BOOL", 1},          {"UINT8", 1},         {"UINT32", 4},    {"UINT64", 8},
                             {"INT32", 4},         {"DOUBLE", 8},        {"VECTOR3D", 24}, {"VECTOR6D", 48},
                             {"VECTOR6INT32", 24}, {"VECTOR6UINT32", 24}};
  for (const Size& size : kSizes) {
    if (size.type == type) return size.bytes;
  }
  return 0;
}

std::string joined(const std::vector<RtdeField>& fields) {
  std::string names;
  for (const RtdeField& field : fields) {
    if (!names.empty()) names += ',';
    names += field.name;
  }
  return names;
}

std::vector<std::string_view> split(std::string_view text) {
  std::vector<std::string_view> words;
  while (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    words.push_back(text.substr(0, comma));
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return words;
}

}  // namespace

Result<std::unique_ptr<RtdeClient>> RtdeClient::start(Socket socket, const RtdeRecipes& recipes, Time timeout) {
  std::unique_ptr<RtdeClient> client(new RtdeClient(std::move(socket)));
  for (client->protocol_ = recipes.newest_version;; --client->protocol_) {
    if (client->protocol_ < 1) return Error{"the controller speaks neither version 2 nor version 1 of RTDE"};
    RtdeWriter request(RtdeType::kRequestVersion);
    request.put(static_cast<std::uint16_t>(client->protocol_));
    const auto answer = client->ask(std::move(request), RtdeType::kRequestVersion, timeout);
    if (!answer) return answer.error();
    if (RtdeReader(*answer).take<std::uint8_t>() != 0) break;
  }
  const auto version = client->ask(RtdeWriter(RtdeType::kControllerVersion), RtdeType::kControllerVersion, timeout);
  if (!version) return version.error();
  RtdeReader reader(*version);
  ControllerVersion& controller = client->controller_;
  for (std::uint32_t* part : {&controller.major, &controller.minor, &controller.bugfix, &controller.build}) {
    *part = reader.take<std::uint32_t>();
  }
  if (Status s = client->agree(RtdeType::kSetupOutputs, recipes.outputs, timeout); !s) return s.error();
  if (!recipes.inputs.empty()) {
    if (Status s = client->agree(RtdeType::kSetupInputs, recipes.inputs, timeout); !s) return s.error();
  }
  const auto started = client->ask(RtdeWriter(RtdeType::kStart), RtdeType::kStart, timeout);
  if (!started) return started.error();
  if (RtdeReader(*started).take<std::uint8_t>() == 0) return Error{"the controller refuses to start the RTDE stream"};
  return client;
}

/// Sends a request and waits for the answer of the given type; skips messages of other types: text or old data.
Result<std::vector<std::uint8_t>> RtdeClient::ask(RtdeWriter request, RtdeType answer, Time timeout) {
  const auto bytes = request.packet();
  if (!request.ok()) return Error{"an RTDE request is longer than the protocol allows"};
  if (!socket_.send_all({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, timeout)) {
    return Error{"the controller closed the RTDE connection; does another program use it?"};
  }
  const auto until = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    RtdePacket packet;
    while (framer_.next(packet)) {
      if (packet.type == answer) return std::vector<std::uint8_t>(packet.payload.begin(), packet.payload.end());
    }
    const Time left = until - std::chrono::steady_clock::now();
    const Socket::Outcome outcome = fill();
    if (framer_.broken()) return Error{"the answer is not RTDE; is this port 30004 of a controller?"};
    if (outcome == Socket::Outcome::kClosed) return Error{"the controller closed the RTDE connection"};
    if (left <= Time(0) || (outcome == Socket::Outcome::kNothing && !socket_.wait_readable(left))) {
      return Error{
          fmt::format("no answer to the RTDE request '{}'; is this port 30004 of a Universal Robots controller?",
                      static_cast<char>(answer))};
    }
  }
}

/// Sets up one recipe; replaces names that the controller does not know by their alternatives.
Status RtdeClient::agree(RtdeType type, std::vector<RtdeField> fields, Time timeout) {
  const bool outputs = type == RtdeType::kSetupOutputs;
  for (bool again = true; again;) {
    again = false;
    RtdeWriter request(type);
    if (outputs && protocol_ >= 2) request.put(controller_.rate_hz());
    request.text(joined(fields));
    const auto answer = ask(std::move(request), type, timeout);
    if (!answer) return answer.error();
    RtdeReader reader(*answer);
    const bool numbered = !outputs || protocol_ >= 2;
    const std::uint8_t id = numbered ? reader.take<std::uint8_t>() : 0;
    const std::vector<std::string_view> types = split(reader.rest());
    if (types.size() != fields.size()) {
      return Error{fmt::format("the controller answers {} variables with {} types", fields.size(), types.size())};
    }
    std::size_t size = 0;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      RtdeField& field = fields[i];
      if (types[i] == "NOT_FOUND" && !field.instead.empty()) {
        field.name = std::exchange(field.instead, {});
        again = true;
      } else if (types[i] == "NOT_FOUND") {
        return Error{
            fmt::format("the controller (software {}.{}) has no variable '{}'; it needs 3.14.3 or 5.9.4 at least",
                        controller_.major, controller_.minor, field.name)};
      } else if (types[i] == "IN_USE") {
        return Error{
            fmt::format("'{}' is written by another client of the controller; end that program, or switch its fieldbus "
                        "(EtherNet/IP, "
                        "PROFINET) off",
                        field.name)};
      } else if (types[i] != field.type) {
        return Error{
            fmt::format("'{}' is of type {} on this controller; {} is expected", field.name, types[i], field.type)};
      }
      size += size_of(field.type);
    }
    if (again) continue;
    if (numbered && id == 0) return Error{fmt::format("the controller refuses the recipe '{}'", joined(fields))};
    (outputs ? output_id_ : input_id_) = id;
    if (outputs) output_size_ = size;
  }
  return Done{};
}

Socket::Outcome RtdeClient::fill() {
  std::size_t received = 0;
  const Socket::Outcome outcome = socket_.receive(framer_.space(), received);
  framer_.filled(received);
  return framer_.broken() ? Socket::Outcome::kClosed : outcome;
}

bool RtdeClient::next(RtdeReader& data) {
  RtdePacket packet;
  while (framer_.next(packet)) {
    if (packet.type != RtdeType::kData) continue;
    data = RtdeReader(packet.payload);
    if (protocol_ >= 2 && data.take<std::uint8_t>() != output_id_) continue;
    if (data.left() == output_size_) return true;
  }
  return false;
}

RtdeWriter RtdeClient::input() const {
  RtdeWriter writer(RtdeType::kData);
  writer.put(input_id_);
  return writer;
}

bool RtdeClient::send(RtdeWriter& input) {
  std::size_t sent = 0;
  if (unsent_begin_ < unsent_end_) {
    (void)socket_.send(std::span<const std::uint8_t>(unsent_).subspan(unsent_begin_, unsent_end_ - unsent_begin_),
                       sent);
    unsent_begin_ += sent;
    if (unsent_begin_ < unsent_end_) return false;
  }
  const auto bytes = input.packet();
  if (socket_.send(bytes, sent) != Socket::Outcome::kDone) return false;
  unsent_begin_ = 0;
  unsent_end_ = bytes.size() - sent;
  std::copy(bytes.begin() + sent, bytes.end(), unsent_.begin());
  return true;
}

}  // namespace steadyhand
