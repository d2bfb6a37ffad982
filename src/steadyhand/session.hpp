#pragma once

/// Session: an operator's hand controls an arm, on threads and under supervision. Links with steadyhand::live.
///
///     auto session = LiveSession::make(model, LiveSettings(profile), arm, clock);
///     (*session)->start();
///     (*session)->feed(sample);                       // nothing moves before the operator grips
///     LiveSummary summary = (*session)->finish();

#include "steadyhand/session/live/live_session.hpp"
