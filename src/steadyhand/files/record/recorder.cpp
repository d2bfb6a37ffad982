#include "steadyhand/files/record/recorder.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "steadyhand/files/record/schemas.hpp"

namespace steadyhand {

Result<Recorder> Recorder::create(std::unique_ptr<McapSink> sink, const RecorderSettings& settings) {
  Result<McapWriter> writer = McapWriter::create(std::move(sink), settings.mcap);
  if (!writer) return writer.error();
  if (!settings.run.empty()) {
    if (Status status = writer->add_metadata("run", settings.run); !status) return status.error();
  }
  return Recorder(std::move(*writer), settings);
}

Recorder::Recorder(McapWriter writer, const RecorderSettings& settings)
    : writer_(std::move(writer)), names_(settings.names) {
  const std::map<std::string, std::string> joints = {{"joints", fmt::format("{}", fmt::join(names_.joints, ","))},
                                                     {"units", fmt::format("{}", fmt::join(names_.joint_units, ","))}};
  const auto add = [&](const std::string& topic, Schema schema,
                       const std::map<std::string, std::string>& metadata = {}) {
    return writer_.add_channel({topic, std::move(schema.name), std::move(schema.text), metadata});
  };
  operator_sample_ = add("/operator_sample", operator_sample_schema());
  target_ = add("/target", target_schema());
  reference_ = add("/reference", reference_schema());
  plan_ = add("/plan", plan_schema(), joints);
  joint_command_ = add("/joint_command", joint_command_schema(), joints);
  joint_state_ = add("/joint_state", joint_state_schema(), joints);
  plan_step_ = add("/plan_step", plan_step_schema(), joints);
  if (settings.live || settings.cells) cell_ = add("/cell", cell_schema());
  for (const CameraInfo& camera : settings.cameras) {
    const std::uint16_t channel = add("/camera/" + camera.name, video_schema(),
                                      {{"width", fmt::format("{}", camera.width)},
                                       {"height", fmt::format("{}", camera.height)},
                                       {"rate_hz", fmt::format("{:g}", camera.rate_hz)}});
    cameras_.emplace_back(channel, camera.name);
  }
  if (!settings.live) return;
  supervision_ = add("/supervision", supervision_schema());
  operator_settings_ = add("/operator_settings", operator_settings_schema());
  liquid_ = add("/liquid", liquid_schema());
  active_constraint_ = add("/active_constraint", active_constraint_schema());
  statistics_ = add("/statistics", statistics_schema());
  episode_ = add("/episode", episode_schema());
  scene_ = add("/scene", scene_schema());
}

Status Recorder::send(std::uint16_t channel, const Stamp& stamp) {
  Status status = writer_.write(channel, std::max(Time(0), stamp.made), std::max(Time(0), stamp.hand),
                                {message_.data(), message_.size()});
  message_.clear();
  return status;
}

Status Recorder::write(const OperatorSample& sample) {
  append_json(message_, sample);
  return send(operator_sample_, sample.stamp);
}

Status Recorder::write(const Target& target) {
  append_json(message_, target);
  return send(target_, target.stamp);
}

Status Recorder::write(const Reference& reference) {
  append_json(message_, reference);
  return send(reference_, reference.stamp);
}

Status Recorder::write(const Plan& plan, std::span<const Pose> path) {
  append_json(message_, plan, path);
  return send(plan_, plan.stamp);
}

Status Recorder::write(const JointCommand& command) {
  append_json(message_, command);
  return send(joint_command_, command.stamp);
}

Status Recorder::write(const JointState& state) {
  append_json(message_, state);
  return send(joint_state_, state.stamp);
}

Status Recorder::write(const PlanStep& step) {
  append_json(message_, step, names_);
  const Time t = from_seconds(step.t_s);
  return send(plan_step_, {t, t});
}

Status Recorder::write(const SupervisionChange& change) {
  append_json(message_, change);
  return send(supervision_, {change.at, change.at});
}

Status Recorder::write(const SettingsChange& change) {
  append_json(message_, change);
  return send(operator_settings_, {change.at, change.at});
}

Status Recorder::write(Time at, const LiquidState& liquid) {
  append_json(message_, at, liquid);
  return send(liquid_, {at, at});
}

Status Recorder::write(Time at, const ActiveConstraint& constraint) {
  append_json(message_, at, constraint);
  return send(active_constraint_, {at, at});
}

Status Recorder::write(Time at, const Cell& cell) {
  append_json(message_, at, cell);
  return send(cell_, {at, at});
}

Status Recorder::write(const SessionStatistics& statistics) {
  append_json(message_, statistics);
  return send(statistics_, {statistics.now, statistics.now});
}

Status Recorder::write(const EpisodeMark& mark) {
  append_json(message_, mark);
  return send(episode_, {mark.at, mark.at});
}

Status Recorder::write(const SceneLook& look) {
  append_json(message_, look);
  return send(scene_, {look.scene.at, look.scene.at});
}

Status Recorder::write(const VideoPacket& picture) {
  const auto& [channel, name] = cameras_.at(picture.camera);
  append_json(message_, picture, name);
  return send(channel, picture.stamp);
}

}  // namespace steadyhand
