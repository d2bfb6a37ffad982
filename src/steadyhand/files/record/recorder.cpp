#include "steadyhand/files/record/recorder.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

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
  const Schema pose = schema_of<Message<OperatorSample>, Message<Target>>(),
               poses = schema_of<ReferenceMessage, PlanMessage>();
  operator_sample_ = add("/operator_sample", pose);
  target_ = add("/target", pose);
  reference_ = add("/reference", poses);
  plan_ = add("/plan", poses, joints);
  joint_command_ = add("/joint_command", schema_of<Message<JointCommand>>(), joints);
  joint_state_ = add("/joint_state", schema_of<Message<JointState>>(), joints);
  plan_step_ = add("/plan_step", schema_of<StepMessage>(), joints);
  if (settings.live || settings.cells) cell_ = add("/cell", schema_of<CellLook>());
  for (const CameraInfo& camera : settings.cameras) {
    const std::uint16_t channel = add("/camera/" + camera.name, schema_of<PictureMessage>(),
                                      {{"width", fmt::format("{}", camera.width)},
                                       {"height", fmt::format("{}", camera.height)},
                                       {"rate_hz", fmt::format("{:g}", camera.rate_hz)}});
    cameras_.emplace_back(channel, camera.name);
  }
  if (!settings.live) return;
  supervision_ = add("/supervision", schema_of<StateChange>());
  operator_settings_ = add("/operator_settings", schema_of<Message<SettingsChange>>());
  liquid_ = add("/liquid", schema_of<LiquidMessage>());
  active_constraint_ = add("/active_constraint", schema_of<LimitChange>());
  statistics_ = add("/statistics", schema_of<Message<SessionStatistics>>());
  episode_ = add("/episode", schema_of<Message<EpisodeMark>>());
  scene_ = add("/scene", schema_of<Message<SceneLook>>());
}

template <typename M>
Status Recorder::send(std::uint16_t channel, const Stamp& stamp, const M& message) {
  message_.clear();
  JsonOut<MessageStyle>(message_).put(message);
  return writer_.write(channel, std::max(Time(0), stamp.made), std::max(Time(0), stamp.hand), message_);
}

template <typename M>
Status Recorder::send(std::uint16_t channel, Time at, const M& message) {
  return send(channel, Stamp{at, at}, message);
}

Status Recorder::write(const OperatorSample& s) { return send(operator_sample_, s.stamp, message_of(s)); }
Status Recorder::write(const Target& t) { return send(target_, t.stamp, message_of(t)); }
Status Recorder::write(const Reference& r) {
  return send(reference_, r.stamp, ReferenceMessage{{&r}, names_.tool_count()});
}
Status Recorder::write(const Plan& plan, const ToolPaths& paths) {
  return send(plan_, plan.stamp, PlanMessage{{&plan}, paths});
}
Status Recorder::write(const JointCommand& c) { return send(joint_command_, c.stamp, message_of(c)); }
Status Recorder::write(const JointState& s) { return send(joint_state_, s.stamp, message_of(s)); }
Status Recorder::write(const PlanStep& step) {
  StepMessage message{step, {}};
  for (std::size_t i = 0; i < names_.terms.size(); ++i) message.shares.emplace_back(names_.terms[i], step.shares[i]);
  return send(plan_step_, from_seconds(step.t_s), message);
}
Status Recorder::write(const SupervisionChange& c) {
  const auto text = [](std::string_view view) { return std::string(view); };
  return send(
      supervision_, c.at,
      StateChange{c.at, text(to_string(c.from)), text(to_string(c.to)), text(c.reason), c.is_failure, c.code, c.tool});
}
Status Recorder::write(const SettingsChange& c) { return send(operator_settings_, c.at, message_of(c)); }
Status Recorder::write(Time at, const LiquidState& liquid, int tool) {
  return send(liquid_, at, LiquidMessage{at, liquid, tool});
}
Status Recorder::write(Time at, const ActiveConstraint& c) {
  return send(active_constraint_, at, LimitChange{at, std::string(to_string(c.kind)), c.first, c.second});
}
Status Recorder::write(Time at, const Cell& cell) { return send(cell_, at, CellLook{at, {cell_json(cell)}}); }
Status Recorder::write(const SessionStatistics& s) { return send(statistics_, s.now, message_of(s)); }
Status Recorder::write(const EpisodeMark& mark) { return send(episode_, mark.at, message_of(mark)); }
Status Recorder::write(const SceneLook& look) { return send(scene_, look.scene.at, message_of(look)); }
Status Recorder::write(const VideoPacket& picture) {
  const auto& [channel, name] = cameras_.at(static_cast<std::size_t>(picture.camera));
  return send(channel, picture.stamp, PictureMessage{{&picture}, name});
}

}  // namespace steadyhand
