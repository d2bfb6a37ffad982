#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/arms/ur/rtde_packet.hpp"
#include "steadyhand/arms/ur/socket.hpp"
#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// A variable of a recipe, as the RTDE guide names and types it.
struct RtdeField {
  std::string_view name, type;
  std::string_view instead;  ///< name to take where the controller's software does not know the first
};

struct ControllerVersion {
  std::uint32_t major = 0, minor = 0, bugfix = 0, build = 0;
  /// Control cycles a second: e-Series and later 500, CB3 125.
  double rate_hz() const { return major >= 5 ? 500.0 : 125.0; }
};

struct RtdeRecipes {
  std::vector<RtdeField> outputs, inputs;  ///< without inputs the client only listens
  int newest_version = 2;                  ///< version of the protocol at which the negotiation starts
};

/// One RTDE connection: set up once, blocking; then data both ways without waiting or allocating.
class RtdeClient {
 public:
  /// Negotiates the protocol (2, else 1), agrees on the recipes and starts the stream at the controller's full rate
  /// (125 Hz with protocol 1). If the controller refuses a variable, fails with its name: its software does not know
  /// it, or another client writes it already. @param timeout for each answer
  static Result<std::unique_ptr<RtdeClient>> start(Socket socket, const RtdeRecipes& recipes, Time timeout);

  int protocol() const { return protocol_; }
  const ControllerVersion& controller() const { return controller_; }
  /// Data packages a second.
  double rate_hz() const { return protocol_ >= 2 ? controller_.rate_hz() : 125.0; }

  /// Takes in arrived data, once. kClosed also for a stream that is not RTDE.
  Socket::Outcome fill();
  /// The next data package that was taken in; its variables in the recipe's order. False: no more. Skips packages of
  /// other sizes than the recipe's.
  bool next(RtdeReader& data);
  bool wait(Time timeout) const { return socket_.wait_readable(timeout); }

  /// An empty package for the inputs, to be filled in the recipe's order and given to send().
  RtdeWriter input() const;
  /// False: not sent, since the connection is congested or lost. Nothing is queued: the next one is newer.
  bool send(RtdeWriter& input);

  int descriptor() const { return socket_.descriptor(); }

 private:
  explicit RtdeClient(Socket socket) : socket_(std::move(socket)) {}
  Result<std::vector<std::uint8_t>> ask(RtdeWriter request, RtdeType answer, Time timeout);
  Status agree(RtdeType type, std::vector<RtdeField> fields, Time timeout);

  Socket socket_;
  RtdeFramer framer_;
  int protocol_ = 2;
  ControllerVersion controller_;
  std::uint8_t output_id_ = 0, input_id_ = 0;
  std::size_t output_size_ = 0;  ///< bytes of the variables of a data package
  std::array<std::uint8_t, 4096> unsent_{};
  std::size_t unsent_begin_ = 0, unsent_end_ = 0;  ///< rest of a package of which a part was sent
};

}  // namespace steadyhand
