// The functions that programs may call on the fake controller.
#include <algorithm>
#include <cmath>

#include "support/ur/fake_ur_controller.hpp"

namespace steadyhand {

JointVector FakeUrController::joints(const urscript::Value& value) const {
  const urscript::List& entries = urscript::list(value);
  if (entries.size() != 6) throw urscript::ScriptError("six joints are expected");
  JointVector q(6);
  for (int i = 0; i < 6; ++i) q[i] = urscript::number(entries[i]);
  if (!q.allFinite()) throw urscript::ScriptError("joints must be finite");
  return q;
}

void FakeUrController::make_builtins() {
  using namespace urscript;
  const auto six = [](const JointVector& q) {
    List entries;
    for (const double value : q) entries.push_back(value);
    return Value(entries);
  };
  const auto index = [](const Arguments& a) {
    const double i = number(a.get(0, "address", -1.0));
    if (!(i >= 0.0) || i >= 48.0) throw ScriptError("registers are 0 to 47");
    return static_cast<std::size_t>(i);
  };
  const auto nothing = [](const Arguments&, Waiting&) { return Value(); };
  for (const char* name : {"popup", "set_payload", "rtde_set_watchdog", "zero_ftsensor", "end_force_mode",
                           "end_freedrive_mode", "set_gravity", "set_tcp", "force_mode_set_gain_scaling",
                           "force_mode_set_damping", "teach_mode", "end_teach_mode"}) {
    builtins_[name] = nothing;
  }
  builtins_["get_steptime"] = [this](const Arguments&, Waiting&) { return Value(period()); };
  builtins_["get_target_joint_positions"] = [this, six](const Arguments&, Waiting&) { return six(target_); };
  builtins_["get_target_joint_speeds"] = [this, six](const Arguments&, Waiting&) { return six(target_dq_); };
  builtins_["get_actual_joint_positions"] = [this, six](const Arguments&, Waiting&) { return six(measured_.joints.q); };
  builtins_["get_joint_positions"] = builtins_["get_actual_joint_positions"];
  builtins_["get_actual_joint_speeds"] = [this, six](const Arguments&, Waiting&) { return six(measured_.joints.dq); };
  builtins_["is_steady"] = [this](const Arguments&, Waiting&) { return Value(target_dq_.norm() < 1e-9); };
  builtins_["read_input_float_register"] = [this, index](const Arguments& a, Waiting&) {
    return Value(double_in_[index(a)]);
  };
  builtins_["read_input_integer_register"] = [this, index](const Arguments& a, Waiting&) {
    return Value(static_cast<double>(int_in_[index(a)]));
  };
  builtins_["write_output_float_register"] = [this, index](const Arguments& a, Waiting&) {
    double_out_[index(a)] = number(a.get(1, "value", 0.0));
    return Value();
  };
  builtins_["write_output_integer_register"] = [this, index](const Arguments& a, Waiting&) {
    const double value = number(a.get(1, "value", 0.0));
    int_out_[index(a)] = static_cast<std::int32_t>(std::clamp(value, -2147483648.0, 2147483647.0));
    return Value();
  };
  builtins_["textmsg"] = [this](const Arguments& a, Waiting&) {
    if (log_.size() < 1000) log_.push_back(text(a.get(0, "s1", "")) + text(a.get(1, "s2", "")));
    return Value();
  };
  builtins_["str_cat"] = [](const Arguments& a, Waiting&) {
    return Value(text(a.get(0, "", "")) + text(a.get(1, "", "")));
  };
  builtins_["to_str"] = [](const Arguments& a, Waiting&) { return Value(text(a.get(0, "val", ""))); };
  builtins_["norm"] = [](const Arguments& a, Waiting&) {
    const Value value = a.get(0, "a", 0.0);
    if (!std::holds_alternative<List>(value)) return Value(std::abs(number(value)));
    double sum = 0.0;
    for (const Value& each : list(value)) sum += number(each) * number(each);
    return Value(std::sqrt(sum));
  };
  for (const auto& [name, f] : {std::pair(
                                    "floor", +[](double x) { return std::floor(x); }),
                                std::pair(
                                    "ceil", +[](double x) { return std::ceil(x); }),
                                std::pair("sqrt", +[](double x) { return std::sqrt(x); })}) {
    builtins_[name] = [f = f](const Arguments& a, Waiting&) { return Value(f(number(a.get(0, "f", 0.0)))); };
  }
  builtins_["sync"] = [](const Arguments&, Waiting& thread) {
    thread.next_cycle();
    return Value();
  };
  builtins_["sleep"] = [this](const Arguments& a, Waiting& thread) {
    for (double left = number(a.get(0, "t", 0.0)); left > 0.5 * period(); left -= period()) thread.next_cycle();
    return Value();
  };
  builtins_["servoj"] = [this](const Arguments& a, Waiting& thread) {
    wanted_ = joints(a.get(0, "q", {}));
    const double lookahead = number(a.get(4, "lookahead_time", 0.1)), gain = number(a.get(5, "gain", 300.0));
    if (lookahead < 0.03 || lookahead > 0.2) throw ScriptError("servoj: lookahead_time is 0.03 to 0.2");
    if (gain < 100.0 || gain > 2000.0) throw ScriptError("servoj: gain is 100 to 2000");
    for (double left = number(a.get(3, "t", 0.002)); left > 0.5 * period(); left -= period()) {
      moves_ = true;
      thread.next_cycle();
    }
    return Value();
  };
  builtins_["speedj"] = [this](const Arguments& a, Waiting& thread) {
    const JointVector goal = joints(a.get(0, "qd", {}));
    const double most = number(a.get(1, "a", 1.4)) * period();
    for (double left = std::max(period(), number(a.get(2, "t", 0.0))); left > 0.5 * period(); left -= period()) {
      const JointVector change = (goal - target_dq_).cwiseMax(-most).cwiseMin(most);
      wanted_ = target_ + period() * (target_dq_ + change);
      moves_ = true;
      thread.next_cycle();
    }
    return Value();
  };
  builtins_["stopj"] = [this](const Arguments& a, Waiting& thread) {
    return brake(number(a.get(0, "a", 2.0)), thread);
  };
  builtins_["stopl"] = [this](const Arguments& a, Waiting& thread) {
    return brake(number(a.get(0, "a", 2.0)), thread);
  };
  builtins_["movej"] = [this](const Arguments& a, Waiting& thread) { return move(a, thread); };
}

/// All joints along one trapezoid of speed.
urscript::Value FakeUrController::move(const urscript::Arguments& a, urscript::Waiting& thread) {
  using namespace urscript;
  const JointVector begin = target_, way = joints(a.get(0, "q", {})) - target_;
  const double distance = way.cwiseAbs().maxCoeff();
  const double acceleration = number(a.get(1, "a", 1.4)), limit = number(a.get(2, "v", 1.05));
  if (!(acceleration > 0.0) || !(limit > 0.0)) throw ScriptError("movej: a and v must be above 0");
  if (distance < 1e-9) return Value();
  const double speed = std::min(limit, std::sqrt(distance * acceleration)), ramp = speed / acceleration;
  const double duration = distance / speed + ramp;
  for (double t = period();; t += period()) {
    const double u = std::min(t, duration), left = duration - u;
    double gone = speed * (u - 0.5 * ramp);
    if (u < ramp) gone = 0.5 * acceleration * u * u;
    if (left < ramp) gone = distance - 0.5 * acceleration * left * left;
    wanted_ = begin + gone / distance * way;
    moves_ = true;
    thread.next_cycle();
    if (t >= duration) return Value();
  }
}

urscript::Value FakeUrController::brake(double deceleration, urscript::Waiting& thread) {
  while (target_dq_.norm() > 1e-9) {
    const JointVector change = target_dq_.cwiseAbs().cwiseMin(std::max(0.1, deceleration) * period());
    wanted_ = target_ + period() * (target_dq_ - target_dq_.cwiseSign().cwiseProduct(change));
    progress_ = 1.0;  // independent of the slider
    moves_ = true;
    thread.next_cycle();
  }
  return {};
}

}  // namespace steadyhand
