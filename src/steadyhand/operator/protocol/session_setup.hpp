#pragma once

#include <map>
#include <string>
#include <vector>

#include "steadyhand/operator/protocol/facts.hpp"
#include "steadyhand/planning/pipeline/profile.hpp"
#include "steadyhand/session/live/live_session.hpp"

namespace steadyhand {

/// Defaults of every session with an operator.
LiveSettings operator_defaults();

/// Planners for the profiles that the operator may choose.
struct ProfilePlanners {
  std::vector<int> of_profile;  ///< for each profile OperatorSettings::planner
  std::vector<Profile> kinds;   ///< for each planner a profile that has its settings; the first: that of the session
};
/// One planner for all profiles that have no planner_differences(). @param profile index of the first; @pre there is
/// one
ProfilePlanners planners_of(const std::vector<Profile>& profiles, int profile);

/// The session becomes that of a profile, with a planner for each that the operator may choose instead. All problems
/// know the terms of all profiles, and a liquid where one of them does.
/// @param profile index of the first; @pre there is one
void take_profiles(const std::vector<Profile>& profiles, int profile, LiveSettings& settings);

/// Facts about the session that clients get when they connect.
ServerFacts describe_session(const RobotModel& model, const Ocp& ocp, const LiveSettings& settings,
                             const std::vector<Profile>& profiles, std::vector<std::string> recordings);

/// Description of the session for its recording: tables by name, of text.
/// @param profile of `profiles`, with which it begins @param rate_hz planning steps a second
std::map<std::string, std::map<std::string, std::string>> describe_run(const RobotModel& model,
                                                                       const LiveSettings& settings,
                                                                       const std::vector<Profile>& profiles,
                                                                       int profile, double rate_hz);

}  // namespace steadyhand
