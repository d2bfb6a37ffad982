#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "steadyhand/arms/ur/socket.hpp"

namespace steadyhand {

/// The server of a Robotiq gripper's URCap, and the gripper: answers SET and GET over connections that it is handed,
/// and moves its fingers with each question to where they are to be.
class FakeRobotiq {
 public:
  FakeRobotiq() : server_([this] { serve(); }) {}
  ~FakeRobotiq() {
    running_ = false;
    server_.join();
  }

  /// A connection to it, as Socket::connect makes one.
  Result<Socket> dial() {
    const std::lock_guard lock(mutex_);
    if (refuses) return Error{"nobody is there"};
    auto ends = Socket::pair();
    if (!ends) return ends.error();
    peers_.push_back({std::move(ends->second), {}});
    return std::move(ends->first);
  }
  void drop_connections() {
    const std::lock_guard lock(mutex_);
    peers_.clear();
  }
  int value(const std::string& name) {
    const std::lock_guard lock(mutex_);
    return values_[name];
  }
  void set(const std::string& name, int value) {
    const std::lock_guard lock(mutex_);
    values_[name] = value;
  }
  /// How often a position was set.
  int told() const { return told_; }

  std::atomic<bool> refuses{false}, silent{false};
  /// In place of every answer; empty: as it should be.
  void answer_always(std::string answer) {
    const std::lock_guard lock(mutex_);
    always_ = std::move(answer);
  }

 private:
  struct Peer {
    Socket socket;
    std::string said;
  };

  std::string answer(const std::string& line) {
    if (!always_.empty()) return always_;
    if (line.starts_with("GET ")) {
      const std::string name = line.substr(4);
      const int wanted = values_["PRE"];
      int& position = values_["POS"];
      if (name == "POS") position += std::clamp(wanted - position, -30, 30);
      return name + " " + std::to_string(values_[name]) + "\n";
    }
    const std::size_t space = line.find(' ', 4);
    const std::string name = line.substr(4, space - 4);
    values_[name == "POS" ? "PRE" : name] = std::stoi(line.substr(space + 1));
    told_ += name == "POS";
    return "ack\n";
  }

  void serve() {
    while (running_) {
      {
        const std::lock_guard lock(mutex_);
        for (Peer& peer : peers_) {
          std::array<std::uint8_t, 256> bytes;
          std::size_t n = 0;
          if (peer.socket.receive(bytes, n) == Socket::Outcome::kDone) {
            peer.said.append(reinterpret_cast<const char*>(bytes.data()), n);
          }
          for (std::size_t end; (end = peer.said.find('\n')) != std::string::npos; peer.said.erase(0, end + 1)) {
            if (!silent) (void)peer.socket.send_all(answer(peer.said.substr(0, end)), std::chrono::seconds(1));
          }
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  std::mutex mutex_;
  std::vector<Peer> peers_;
  std::map<std::string, int> values_{{"STA", 3}, {"FLT", 0}, {"POS", 3}, {"PRE", 3}};
  std::string always_;
  std::atomic<int> told_{0};
  std::atomic<bool> running_{true};
  std::thread server_;
};

}  // namespace steadyhand
