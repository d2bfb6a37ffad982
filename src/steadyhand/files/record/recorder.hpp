#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/video.hpp"
#include "steadyhand/files/record/mcap_writer.hpp"
#include "steadyhand/files/record/messages.hpp"
#include "steadyhand/planning/plan/active_constraint.hpp"
#include "steadyhand/session/supervise/supervision.hpp"

namespace steadyhand {

struct RecorderSettings {
  McapSettings mcap;
  RunNames names;
  bool live = false;                       ///< with the channels of a live session
  std::map<std::string, std::string> run;  ///< what was run with which settings; the file's metadata "run"
  std::vector<CameraInfo> cameras{};       ///< that film
  bool cells = false;                      ///< with the obstacles' channel, which live sessions always have
};

/// Taps every arrow into one MCAP file, a topic per arrow. A message's log time is its `stamp.made` (t_s for a step),
/// its publish time the `stamp.hand`, both at least 0. One thread (the writer's); allocates.
class Recorder {
 public:
  /// Begins a file in a sink. @pre there is one
  static Result<Recorder> create(std::unique_ptr<McapSink> sink, const RecorderSettings& settings);
  /// Creates a file, as open_mcap_file().
  static Result<Recorder> create(const std::string& path, const RecorderSettings& settings);

  Status write(const OperatorSample& sample);                   ///< /operator_sample
  Status write(const Target& target);                           ///< /target
  Status write(const Reference& reference);                     ///< /reference
  Status write(const Plan& plan, const ToolPaths& paths = {});  ///< /plan; paths: X_base_tool at its nodes
  Status write(const JointCommand& command);                    ///< /joint_command
  Status write(const JointState& state);                        ///< /joint_state
  Status write(const PlanStep& step);                           ///< /plan_step
  // for live sessions
  Status write(const SupervisionChange& change);                   ///< /supervision
  Status write(const SettingsChange& change);                      ///< /operator_settings
  Status write(Time at, const LiquidState& liquid, int tool = 0);  ///< /liquid
  Status write(Time at, const ActiveConstraint& constraint);       ///< /active_constraint
  Status write(Time at, const Cell& cell);                         ///< /cell
  Status write(const SessionStatistics& statistics);               ///< /statistics
  Status write(const EpisodeMark& mark);                           ///< /episode
  Status write(const SceneLook& look);                             ///< /scene
  Status write(const VideoPacket& picture);                        ///< /camera/NAME
  /// A named table of text.
  Status add_metadata(const std::string& name, const std::map<std::string, std::string>& entries) {
    return writer_.add_metadata(name, entries);
  }

  /// Writes what is held back. Call when no message has come for a while.
  Status flush() { return writer_.flush(); }
  /// Completes the file; nothing can be written afterwards.
  Status close() { return writer_.close(); }

 private:
  Recorder(McapWriter writer, const RecorderSettings& settings);
  template <typename M>
  Status send(std::uint16_t channel, const Stamp& stamp, const M& message);
  template <typename M>
  Status send(std::uint16_t channel, Time at, const M& message);

  McapWriter writer_;
  RunNames names_;
  JsonBuffer message_;
  std::uint16_t operator_sample_, target_, reference_, plan_, joint_command_, joint_state_, plan_step_;
  std::uint16_t supervision_ = 0, operator_settings_ = 0, liquid_ = 0, active_constraint_ = 0, statistics_ = 0,
                cell_ = 0, episode_ = 0, scene_ = 0;
  std::vector<std::pair<std::uint16_t, std::string>> cameras_;  ///< channel and name
};

}  // namespace steadyhand
