#include "steadyhand/operator/protocol/operator_interface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "steadyhand/core/nearest.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/operator/protocol/session_setup.hpp"
#include "steadyhand/session/live/hand_delay.hpp"

namespace steadyhand {

namespace {

constexpr std::uint64_t kCellOfTheBegin = 1;
constexpr Time kServerSilence = std::chrono::seconds(1);       ///< no client could stop a playback after it
constexpr Time kWatched = std::chrono::milliseconds(250);      ///< between two checks that the arm follows it
constexpr Time kHeardWithin = std::chrono::milliseconds(500);  ///< time for the arm to engage

template <typename List, typename NameOf>
Result<int> find_name(const List& list, const std::string& name, const char* what, const NameOf& name_of) {
  std::vector<std::string> known;
  for (const auto& each : list) {
    if (name_of(each) == name) return static_cast<int>(known.size());
    known.emplace_back(name_of(each));
  }
  return Error{fmt::format("there is no {} '{}'; {}", what, name, suggestion(name, known))};
}

}  // namespace

OperatorInterface::OperatorInterface(Session& session, std::vector<Profile> profiles, int profile,
                                     const RetargetSettings& retarget, const GlassSettings& glass,
                                     std::vector<NamedRecording> recordings)
    : session_(&session),
      profiles_(std::move(profiles)),
      planners_(planners_of(profiles_, profile).of_profile),
      retarget_(retarget),
      glass_(glass),
      recordings_(std::move(recordings)) {
  controls_.scale = retarget.scale;
  controls_.fill = glass.fill;
  controls_.yaw = retarget.yaw;
  (void)set_profile(profiles_[profile].name);
}

void OperatorInterface::on_record(std::function<void(bool)> call) {
  const Lock lock(mutex_);
  on_record_ = std::move(call);
}

Status OperatorInterface::apply(const OperatorRequest& request, Time now) {
  using Kind = OperatorRequest::Kind;
  const Lock lock(mutex_);
  const auto bad_value = [&](const char* what, const char* right) {
    return Error{fmt::format("{} is {}; it must be {}", what, request.value, right)};
  };
  switch (request.kind) {
    case Kind::kStop:
      session_->ask_stop();
      if (playback_) end_playback();
      if (controls_.policy_turn) end_turn();
      return Done{};
    case Kind::kReset:
      session_->ask_reset();
      return Done{};
    case Kind::kProfile:
      return set_profile(request.text);
    case Kind::kWeight:
      return set_weight(request.text, request.value);
    case Kind::kScale:
      if (!(request.value > 0.0) || request.value > 10.0) return bad_value("scale", "above 0 and at most 10");
      controls_.scale = request.value;
      send();
      return Done{};
    case Kind::kYaw:
      if (!(std::abs(request.value) <= 7.0)) return bad_value("yaw", "within one turn, in rad");
      controls_.yaw = request.value;
      send();
      return Done{};
    case Kind::kTilt:
      if (!(request.value >= 0.0) || request.value > M_PI + 1e-6) return bad_value("tilt", "from 0 to pi, in rad");
      controls_.tilt = std::min(request.value, M_PI);
      controls_.no_spill = spares_liquid(controls_.profile, controls_.tilt);
      send();
      return Done{};
    case Kind::kFill:
      if (!(request.value > 0.0) || !(request.value < glass_.height)) {
        return Error{fmt::format("fill is {} m; it must be above 0 and below the height of the glass, {} m",
                                 request.value, glass_.height)};
      }
      controls_.fill = request.value;
      send();
      return Done{};
    case Kind::kRefill:
      session_->refill();
      return Done{};
    case Kind::kRate:
      return session_->set_planner_rate(request.value);
    case Kind::kLatency:
      if (!(request.value >= 0.0) || from_seconds(request.value) > HandDelay::kLongest) {
        return bad_value("latency", "from 0 to 1 s");
      }
      controls_.latency = request.value;
      send();
      return Done{};
    case Kind::kPlayback:
      return play(request.text, now);
    case Kind::kPolicy:
      if (request.value != 0.0 && request.value != 1.0) return bad_value("policy", "0 or 1");
      return give_turn(request.value == 1.0, now);
    case Kind::kRecord:
      if (!on_record_) return Error{"this session cannot be recorded"};
      if (request.value != 0.0 && request.value != 1.0) return bad_value("record", "0 or 1");
      on_record_(request.value == 1.0);
      return Done{};
    case Kind::kObject:
      return set_object(request, now);
    case Kind::kAttach:
      return session_->attach(request.text, now, request.tool);
    case Kind::kDetach:
      return session_->detach(request.text, now);
    case Kind::kEpisode:
    case Kind::kSetUp:
      return Error{"this session has neither episodes nor a scene that could be set up"};
    case Kind::kLabel:
    case Kind::kRename:
    case Kind::kDelete:
      return Error{"recorded sessions are not this session's affair"};
  }
  return Error{"unknown request"};
}

Status OperatorInterface::set_profile(const std::string& name) {
  const Result<int> index = find_name(profiles_, name, "profile", [](const Profile& p) { return p.name; });
  if (!index) return index.error();
  Result<std::vector<JointVector>> weights = session_->ocp().weights(profiles_[*index].ocp.weights);
  if (!weights) return weights.error();
  const auto current = static_cast<std::size_t>(std::max(controls_.profile, 0));
  const int planner = planners_[static_cast<std::size_t>(*index)];
  if (planner != planners_[current]) {
    const auto refuse = [&](const char* why) {
      return Error{fmt::format("profile '{}' differs from '{}' in {}: {}", name, profiles_[current].name,
                               planner_differences(profiles_[current], profiles_[*index]), why)};
    };
    if (planner >= session_->planners()) return refuse("this session has no planner for it");
    if (controls_.policy_turn) return refuse("the arm must stop for that; end the policy's turn first");
  }
  weights_ = profile_weights_ = *std::move(weights);
  controls_.profile = *index;
  controls_.tilt = profiles_[*index].tilt_max;
  controls_.no_spill = spares_liquid(*index, controls_.tilt);
  send();
  return Done{};
}

/// False for a tilt limit that permits pouring.
bool OperatorInterface::spares_liquid(int profile, double tilt) const {
  constexpr double kPours = M_PI - 1e-3;
  return profiles_[profile].ocp.liquid && tilt < kPours;
}

/// Adds, moves or removes the object.
Status OperatorInterface::set_object(const OperatorRequest& request, Time now) {
  const auto change = [&](Cell cell) -> Result<Cell> {
    if (!request.object) return without(std::move(cell), request.text);
    const auto found = std::find_if(cell.objects.begin(), cell.objects.end(),
                                    [&](const CellObject& object) { return object.name == request.text; });
    const bool known = found != cell.objects.end();
    if (known && found->attached)
      return Error{fmt::format("object '{}' is carried by the tool; detach it first", request.text)};
    CellObject& object = known ? *found : cell.objects.emplace_back();
    const CellObject before = std::exchange(object, *request.object);
    object.name = request.text;
    object.may_be_touched_by = before.may_be_touched_by;
    object.holds_only_tool = before.holds_only_tool;
    object.color = before.color;
    return cell;
  };
  return session_->change_cell(change, now);
}

/// The weights of one term keep their ratios: moving a slider does not flatten [1, 1, 3].
Status OperatorInterface::set_weight(const std::string& name, double value) {
  const auto& objectives = session_->ocp().objectives();
  const Result<int> index =
      find_name(objectives, name, "term", [](const auto& objective) { return objective->name(); });
  if (!index) return index.error();
  if (!(value >= 0.0) || value > 1e6) {
    return Error{fmt::format("weight '{}' is {}; it must be from 0 to 1e6", name, value)};
  }
  const JointVector& shape = profile_weights_[*index];
  const double largest = shape.maxCoeff();
  weights_[*index] = largest > 0.0 ? JointVector(value / largest * shape) : JointVector::Constant(shape.size(), value);
  send();
  return Done{};
}

Status OperatorInterface::play(const std::string& name, Time now) {
  if (name.empty()) {
    if (playback_) end_playback();
    return Done{};
  }
  const Result<int> index =
      find_name(recordings_, name, "recording", [](const NamedRecording& recording) { return recording.name; });
  if (!index) return index.error();
  halts_ = session_->halts();
  if (session_->is_halted()) return Error{"a playback cannot start while the arm is stopped; reset it first"};
  const Recording& recording = recordings_[*index].recording;
  const int tools = session_->ocp().model().tool_count();
  for (const OperatorSample& sample : recording.samples) {
    if (sample.tool >= 0 && sample.tool < tools) continue;
    return Error{
        fmt::format("recording '{}' moves tool {}; the tools of this robot are 0 to {}", name, sample.tool, tools - 1)};
  }
  if (controls_.policy_turn) end_turn();
  session_->release_hand();
  playback_.emplace(recording, now, ways_home(recording, now));
  controls_.playback = *index;
  return Done{};
}

/// The tools' commanded poses; none before the arm has reported its position.
std::optional<PerTool<Pose>> OperatorInterface::tools(Time now) const {
  const Result<Kinematics> arm = session_->arm_at(now);
  if (!arm) return std::nullopt;
  PerTool<Pose> poses;
  for (int t = 0; t < arm->tool_count(); ++t) poses[t] = {arm->p(t), Quaternion(arm->R(t))};
  return poses;
}

/// Motion of recorded hands before the recording, so that it begins with the tools where the session began.
PerTool<std::vector<Pose>> OperatorInterface::ways_home(const Recording& recording, Time now) const {
  PerTool<std::vector<Pose>> ways;
  const std::optional<PerTool<Pose>> from = tools(now);
  if (!from || !X_base_home_) return ways;
  RetargetSettings retarget = retarget_;
  retarget.scale = controls_.scale;
  retarget.yaw = controls_.yaw;
  for (int t = 0; t < session_->ocp().model().tool_count(); ++t) {
    const auto first = std::find_if(recording.samples.begin(), recording.samples.end(),
                                    [&](const OperatorSample& sample) { return sample.tool == t; });
    std::vector<Pose>& way = ways[t];
    if (first != recording.samples.end()) way = way_around_base((*from)[t], (*X_base_home_)[t]);
    if (way.empty()) continue;
    const Pose& hand = first->X_operator_hand;
    const Pose grip{hand.p, hand_for(retarget, (*from)[t], (*X_base_home_)[t], hand).q};
    for (Pose& at : way) at = hand_for(retarget, at, (*from)[t], grip);
    const Vector3 shift = hand.p - way.back().p;  // which the tool does not see
    for (Pose& at : way) at.p += shift;
  }
  return ways;
}

/// Sends the operator's choices to the planner.
void OperatorInterface::send() {
  OperatorSettings settings;
  settings.objectives = static_cast<int>(weights_.size());
  std::copy(weights_.begin(), weights_.end(), settings.weights.begin());
  settings.scale = controls_.scale;
  settings.yaw = controls_.yaw;
  settings.tilt_max = controls_.tilt;
  settings.no_spill = controls_.no_spill;
  settings.fill = controls_.fill;
  settings.latency = controls_.latency;
  if (controls_.profile >= 0) {
    settings.prediction = profiles_[controls_.profile].prediction;
    settings.planner = planners_[static_cast<std::size_t>(controls_.profile)];
    settings.profile = profiles_[controls_.profile].name;
  }
  session_->set(settings);
  controls_.objectives = settings.objectives;
  for (std::size_t i = 0; i < weights_.size(); ++i) controls_.weights[i] = weights_[i].maxCoeff();
}

void OperatorInterface::hand(const OperatorSample& sample) {
  const Lock lock(mutex_);
  hands_[sample.tool].gripped = sample.clutch ? std::optional(sample.stamp.made) : std::nullopt;
  if (controls_.policy_turn) return hand_in_turn(sample);
  if (playback_ && !sample.clutch) return;
  if (playback_) end_playback();
  session_->feed(sample);
}

/// Engaging takes over, and releasing hands back. The previous source releases, and the next one closes a clutch that
/// was seen open: its motion begins from where the arm is. The policy waits until both hands of a person have released.
void OperatorInterface::hand_in_turn(const OperatorSample& sample) {
  Hand& hand = hands_[sample.tool];
  if (!sample.clutch) {
    hand.may_take_over = true;
    if (!std::exchange(hand.takes_over, false)) return;
    if (takes_over()) return session_->feed(sample);
    session_->release_hand();
    for (PolicyHand& each : policy_) each.begin(sample.stamp.made);
    return;
  }
  if (!hand.may_take_over) return;
  if (!hand.takes_over) {
    if (!takes_over()) session_->release_hand();
    hand.takes_over = true;
    OperatorSample open = sample;
    open.clutch = false;
    open.stamp.hand -= Time(1);
    session_->feed(open);
  }
  OperatorSample closed = sample;
  closed.intervention = true;
  session_->feed(closed);
}

/// In the policy's turn a person controls the arm.
bool OperatorInterface::takes_over() const {
  return std::any_of(hands_.begin(), hands_.end(), [](const Hand& hand) { return hand.takes_over; });
}

Status OperatorInterface::give_turn(bool turn, Time now) {
  if (!turn) {
    if (controls_.policy_turn) end_turn();
    return Done{};
  }
  if (policy_.empty()) return Error{"no policy is connected; start one first (docs/how-to/policies.md)"};
  halts_ = session_->halts();
  if (session_->is_halted()) return Error{"a policy cannot start while the arm is stopped; reset it first"};
  for (const Hand& hand : hands_) {
    if (hand.gripped && to_seconds(now - *hand.gripped) < kSampleTimeout) return Error{"release the arm first"};
  }
  playback_.reset();
  controls_.playback = -1;
  session_->release_hand();
  for (PolicyHand& hand : policy_) hand.begin(now);
  controls_.policy_turn = true;
  for (Hand& hand : hands_) hand.may_take_over = hand.takes_over = false;
  return Done{};
}

/// Releases a person's hand, too: a turn that ends must stop the arm.
void OperatorInterface::end_turn() {
  controls_.policy_turn = false;
  for (Hand& hand : hands_) hand.takes_over = false;
  session_->release_hand();
}

Status OperatorInterface::connect(std::optional<PolicyInfo> policy) {
  const Lock lock(mutex_);
  if (policy && !(policy->period >= PolicyHand::kFastest && policy->period <= PolicyHand::kSlowest)) {
    return Error{fmt::format("the policy's period is {} s; it must be from {} to {} s", policy->period,
                             PolicyHand::kFastest, PolicyHand::kSlowest)};
  }
  if (controls_.policy_turn) end_turn();
  policy_.clear();
  controls_.policy.clear();
  if (!policy) return Done{};
  policy_.assign(static_cast<std::size_t>(session_->ocp().model().tool_count()), PolicyHand(*policy));
  controls_.policy = std::move(policy->name);
  return Done{};
}

void OperatorInterface::target(const PolicyTarget& target, Time now) {
  const Lock lock(mutex_);
  if (target.tool >= 0 && target.tool < std::ssize(policy_)) policy_[target.tool].take(target, now);
}

void OperatorInterface::end_playback() {
  playback_.reset();
  controls_.playback = -1;
  session_->release_hand();
}

void OperatorInterface::change_hands() {
  const Lock lock(mutex_);
  for (Hand& hand : hands_) hand.gripped.reset();
  if (playback_) return end_playback();
  if (controls_.policy_turn) return end_turn();
  session_->release_hand();
}

void OperatorInterface::note_server_alive(Time now) {
  const Lock lock(mutex_);
  server_alive_ = now;
}

/// On a busy machine a recorded hand may time out. Without this it would not engage again before its next round.
void OperatorInterface::watch_playback(Time now) {
  if (!playback_ || now < watched_ + kWatched) return;
  watched_ = now;
  const SessionSnapshot snapshot = session_->snapshot();
  for (int t = 0; t < snapshot.tool_count; ++t) {
    const bool waits = snapshot.tools[t].state == SupervisionState::kReady;
    if (waits && playback_->closed_for(now, t) > kHeardWithin) return playback_->grip_anew(now);
  }
}

Time OperatorInterface::poll(Time now) {
  const Lock lock(mutex_);
  const bool alone = server_alive_ && now - *server_alive_ > kServerSilence;
  if (playback_ && (alone || session_->halts() != halts_)) end_playback();
  if (controls_.policy_turn && (alone || session_->halts() != halts_)) end_turn();
  if (!X_base_home_) X_base_home_ = tools(now);
  OperatorSample sample;
  watch_playback(now);
  while (playback_ && playback_->next(now, sample)) session_->feed(sample);
  Time due = playback_ ? playback_->due() : Time::max();
  if (!controls_.policy_turn || takes_over()) return due;
  for (PolicyHand& hand : policy_) {
    while (hand.next(now, sample)) session_->feed(sample);
    due = std::min(due, hand.due());
  }
  return due;
}

std::shared_ptr<const std::string> OperatorInterface::cell() {
  const Lock lock(mutex_);
  const Session::CellSet set = session_->cell_set();
  if (set.version == cell_version_) return cell_json_;
  const bool first = set.version == kCellOfTheBegin;
  cell_version_ = set.version;
  if (!first) cell_json_ = std::make_shared<const std::string>(cell_json(set.cell, set.at));
  return cell_json_;
}

SessionControls OperatorInterface::controls() const {
  const Lock lock(mutex_);
  return controls_;
}

}  // namespace steadyhand
