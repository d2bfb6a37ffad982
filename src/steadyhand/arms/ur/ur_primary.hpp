#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "steadyhand/arms/ur/socket.hpp"

namespace steadyhand {

/// Denavit and Hartenberg's parameters of an arm as its factory measured them: joint i leads from frame to frame by
/// Rz(theta_i + q_i) Tz(d_i) Tx(a_i) Rx(alpha_i). rad, m.
struct UrKinematics {
  std::array<double, 6> theta{}, a{}, d{}, alpha{};
};

/// A message on a controller's primary interface that this program uses.
struct UrMessage {
  enum class Kind {
    kOther,
    kError,      ///< "C210A0" and the like
    kException,  ///< a program ended because of it
    kKinematics
  };
  Kind kind = Kind::kOther;
  int code = 0, argument = 0;  ///< for an error: C code A argument
  int level = 0;               ///< for an error: 0 debug, 1 info, 2 warning, 3 violation, 4 fault, 5 critical fault
  int line = 0;                ///< for an exception
  std::string_view text;       ///< valid until the next fill()
  UrKinematics kinematics;
  bool serious() const { return kind == Kind::kException || (kind == Kind::kError && level >= 3 && level <= 5); }
};

/// Code of the error that a connection may not send programs: it was opened while the robot was in local control.
inline constexpr int kUrReadOnly = 210;

/// Type bytes of the interface.
enum class UrPackage : std::uint8_t { kState = 16, kMessage = 20 };
enum class UrStatePart : std::uint8_t { kRobotMode = 0, kKinematics = 5 };
enum class UrMessageType : std::uint8_t { kText = 0, kVersion = 3, kError = 6, kKey = 7, kException = 10 };

/// The primary interface of a Universal Robots controller (TCP 30001): programs one way, states ten times a second and
/// messages the other. The controller decides on opening whether it takes programs. All memory from the constructor.
class UrPrimary {
 public:
  explicit UrPrimary(Socket socket) : socket_(std::move(socket)), buffer_(kRoom) {}

  Socket::Outcome send(std::span<const std::uint8_t> bytes, std::size_t& sent) { return socket_.send(bytes, sent); }
  /// Takes in arrived data, once. kClosed also for a stream that is not a controller's.
  Socket::Outcome fill();
  /// The next message that was taken in; kOther if this program does not use it. False: no more.
  bool next(UrMessage& message);
  bool wait(Time timeout) const { return socket_.wait_readable(timeout); }

 private:
  static constexpr std::size_t kRoom = 1 << 17, kLargest = 1 << 16;
  Socket socket_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0, end_ = 0;
  bool broken_ = false;
};

/// Listens on a new connection until the controller sends its arm's kinematics; none if it does not.
std::optional<UrKinematics> read_kinematics(UrPrimary& primary, Time timeout);

}  // namespace steadyhand
