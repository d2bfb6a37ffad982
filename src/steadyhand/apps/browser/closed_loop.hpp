#pragma once

#include <functional>
#include <string>

#include "steadyhand/apps/browser/setup_json.hpp"

/// A check that a build plans as another one does.
namespace steadyhand {

/// Plans that follow each other along made-up hands, of which a new one begins every 20 plans: JSON with "plans", of
/// each its solution's numbers, in a row, and "times_us". Fails as Planner::make.
/// @param profile index of the setup's; @param wall what plans are timed with
Result<std::string> closed_loop(const BrowserSetup& setup, int profile, int problems,
                                const std::function<Time()>& wall);

/// The commands of a session that plays its first recording, on a separate clock, at 50 plans a second: JSON with
/// "commands", of each q and dq in a row. Fails as BrowserSession::make.
Result<std::string> commands_of(BrowserSetup setup, double seconds);

}  // namespace steadyhand
