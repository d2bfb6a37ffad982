#include "steadyhand/session/supervise/hand_gate.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

std::string_view to_string(HandVerdict verdict, Leader leader) {
  using enum HandVerdict;
  struct Text {
    HandVerdict verdict;
    std::string_view hand, policy;
  };
  static constexpr Text kTexts[] = {
      {kGood, "the hand is tracked", "the policy's targets are received"},
      {kUntracked, "the device does not see the hand", "no target of the policy was received for a while"},
      {kEmulated, "the device guesses the hand's position", "the policy guesses"},
      {kNotFinite, "the hand's pose is not a number", "the policy's target is not a number"},
      {kJump, "the hand's pose jumped", "the policy's target jumped"},
      {kFarAway, "the hand returned at another place: release and engage again",
       "the policy's target returned at another place: start its turn again"},
      {kUnsettled, "the hand has just returned", "the policy's targets have just returned"},
      {kOutOfOrder, "the hand's poses are out of order", "the policy's targets are out of order"},
      {kStale, "the hand's poses are too late", "the policy's targets are too late"},
      {kClockStepped, "the device's clock was set", "the policy's clock was set"},
  };
  const auto text =
      std::find_if(std::begin(kTexts), std::end(kTexts), [&](const Text& t) { return t.verdict == verdict; });
  if (text == std::end(kTexts)) return "unknown";
  return leader == Leader::kPolicy ? text->policy : text->hand;
}

namespace {

bool is_finite(const Pose& pose) {
  return pose.p.allFinite() && std::abs(pose.q.squaredNorm() - 1.0) < 1e-3;  // false for NaN
}

}  // namespace

void HandGate::forget() {
  any_ = opened_ = gripped_ = lost_ = false;
  report_.clutch = report_.trusted = false;
}

HandVerdict HandGate::update(const OperatorSample& sample, Time now) {
  report_.received = now;
  if (any_ && sample.leader != last_.leader) forget();
  report_.leader = sample.leader;
  if (!sample.clutch) gripped_ = report_.clutch = false;  // a release counts, even if it is late or out of order
  if (any_) {
    const double newer = to_seconds(sample.stamp.hand - last_.stamp.hand);
    if (newer <= 0.0 && newer > -settings_.clock_step) {
      ++dropped_;
      return HandVerdict::kOutOfOrder;
    }
  }
  const double age = to_seconds(now - sample.stamp.hand);
  const bool set_back = any_ && sample.stamp.hand <= last_.stamp.hand;
  if (set_back || age < -settings_.ahead_max) {
    ++dropped_;
    forget();
    any_ = set_back && age >= -settings_.ahead_max;  // in order from here on
    last_ = sample;
    return report_.verdict = HandVerdict::kClockStepped;
  }
  if (age > settings_.age_max) {
    ++dropped_;
    opened_ = opened_ || !sample.clutch;
    return report_.verdict = HandVerdict::kStale;
  }

  HandVerdict verdict = judge_pose(sample);
  if (!sample.clutch) {
    opened_ = true;
    gripped_ = lost_ = false;
  } else if (opened_ && is_finite(sample.X_operator_hand)) {
    opened_ = false;
    gripped_ = true;
    ++report_.grips;
  }
  if (verdict != HandVerdict::kGood) {
    lost_ = lost_ || sample.clutch;
    settled_ = 0;
  } else if (lost_) {
    if (++settled_ < settings_.resume_samples) {
      verdict = HandVerdict::kUnsettled;
    } else {
      lost_ = false;
    }
  }
  if (verdict == HandVerdict::kGood) {
    trusted_ = sample;
    report_.good = now;
    if (sample.gripper && *sample.gripper >= 0.0 && *sample.gripper <= 1.0) {
      report_.gripper = sample.gripper;
      report_.gripper_said = now;
    }
  }
  last_ = sample;
  any_ = true;
  report_.clutch = gripped_;
  report_.trusted = verdict == HandVerdict::kGood;
  return report_.verdict = verdict;
}

HandVerdict HandGate::judge_pose(const OperatorSample& sample) {
  if (!is_finite(sample.X_operator_hand)) return HandVerdict::kNotFinite;
  if (!sample.tracked) return HandVerdict::kUntracked;
  if (sample.emulated && !settings_.accept_emulated) return HandVerdict::kEmulated;
  if (!any_ || !last_.clutch || !sample.clutch) return HandVerdict::kGood;
  const double moved = (sample.X_operator_hand.p - trusted_.X_operator_hand.p).norm();
  const double turned = sample.X_operator_hand.q.angularDistance(trusted_.X_operator_hand.q);
  const double gap = to_seconds(sample.stamp.hand - trusted_.stamp.hand);
  if (lost_ || gap > settings_.gap_max) {
    lost_ = true;
    const bool near = moved <= settings_.resume_distance && turned <= settings_.resume_angle;
    return near ? HandVerdict::kGood : HandVerdict::kFarAway;
  }
  const HandGateSettings& s = settings_;
  const bool policy = sample.leader == Leader::kPolicy;
  const double farthest =
      policy ? s.policy_jump_allowance + s.policy_speed_max * gap : s.jump_allowance + s.speed_max * gap;
  const double most_turned =
      policy ? s.policy_turn_allowance + s.policy_turn_rate_max * gap : s.turn_allowance + s.turn_rate_max * gap;
  const bool jumped = moved > farthest || turned > most_turned;
  return jumped ? HandVerdict::kJump : HandVerdict::kGood;
}

}  // namespace steadyhand
