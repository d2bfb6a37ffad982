#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "steadyhand/arms/ur/rtde_client.hpp"
#include "steadyhand/arms/ur/ur_primary.hpp"

namespace steadyhand {

/// An object that one thread makes and ends, and another uses. Neither waits.
template <typename T>
class HandOver {
 public:
  ~HandOver() {
    give(nullptr);
    give_back(nullptr);
  }
  void give(std::unique_ptr<T> made) { delete incoming_.exchange(made.release()); }
  /// Null: there is none yet.
  std::unique_ptr<T> take() {
    const bool any = incoming_.load(std::memory_order_relaxed) != nullptr;
    return std::unique_ptr<T>(any ? incoming_.exchange(nullptr) : nullptr);
  }
  void give_back(std::unique_ptr<T> used) { delete outgoing_.exchange(used.release()); }

 private:
  std::atomic<T*> incoming_{nullptr}, outgoing_{nullptr};
};

/// Connections to a controller, made by a second thread for the control thread: one for states after a loss, and a
/// new one for each program, since the controller decides when a connection is opened whether it may send programs.
class UrConnections {
 public:
  /// Makes one connection to the controller; may block.
  using Dial = std::function<Result<Socket>()>;
  /// A connection for programs, and the request for which it was made.
  struct Script : UrPrimary {
    Script(Socket socket, int wish_) : UrPrimary(std::move(socket)), wish(wish_) {}
    int wish;
  };

  /// @param timeout s, for each step of connecting
  UrConnections(Dial rtde, Dial script, double timeout)
      : dial_rtde_(std::move(rtde)), dial_script_(std::move(script)), timeout_(timeout) {}
  ~UrConnections();

  static Result<std::unique_ptr<RtdeClient>> open(const Dial& rtde, double timeout);
  Result<Socket> dial_script() const { return dial_script_(); }
  void start_thread();
  /// One pass of the second thread: makes the connections that are wanted, ends those that are not. An exception in it
  /// counts as a failed connection.
  void keep();

  // ---- of the control thread
  /// Asks for a new one for states, in place of this one.
  void replace(std::unique_ptr<RtdeClient> lost);
  std::unique_ptr<RtdeClient> take_rtde() { return rtde_.take(); }
  /// Asks for a new one for programs, in place of this one.
  void replace(std::unique_ptr<Script> used);
  void end(std::unique_ptr<Script> used);
  /// Null: there is none yet.
  std::unique_ptr<Script> take_script();
  bool script_failed() const { return script_failed_ == script_wish_; }

 private:
  void wake();

  Dial dial_rtde_, dial_script_;
  double timeout_;
  HandOver<RtdeClient> rtde_;
  HandOver<Script> script_;
  std::atomic<bool> rtde_wanted_{false};
  std::atomic<int> script_wish_{0};    ///< number of requests for a connection for programs
  std::atomic<int> script_failed_{0};  ///< the newest request that failed
  int script_served_ = 0;              ///< second thread: the newest request that it handled
  std::atomic<int> work_{0};           ///< grows with each request, for the second thread to wait on
  std::atomic<bool> running_{true};
  std::thread keeper_;
};

}  // namespace steadyhand
