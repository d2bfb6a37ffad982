#pragma once

#include <map>
#include <string>
#include <vector>

#include "steadyhand/config/profile.hpp"
#include "steadyhand/desk/facts.hpp"
#include "steadyhand/live/session.hpp"

namespace steadyhand {

/// As every session with an operator begins, before anybody sets something else.
LiveSettings operator_defaults();

/// The session's problem, solver and tolerance become those of a profile, and the problem knows the terms and the
/// liquid of all of them: the operator may choose each.
/// @param profile index of the first; @pre there is one
void take_profiles(const std::vector<Profile>& profiles, int profile, LiveSettings& settings);

/// What clients are told of the session when they connect.
ServerFacts describe_session(const RobotModel& model, const Ocp& ocp, const LiveSettings& settings,
                             const std::vector<Profile>& profiles, std::vector<std::string> recordings);

/// What a recording tells of its session: tables by name, of text.
/// @param profile of `profiles`, with which it begins @param rate_hz planning steps a second
std::map<std::string, std::map<std::string, std::string>> describe_run(const RobotModel& model,
                                                                       const LiveSettings& settings,
                                                                       const std::vector<Profile>& profiles,
                                                                       int profile, double rate_hz);

}  // namespace steadyhand
