#pragma once

#include <algorithm>
#include <filesystem>
#include <memory>
#include <vector>

#include "steadyhand/files/archive/recording_folder.hpp"
#include "steadyhand/files/archive/session_recorder.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "support/temporary_folder.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

/// Messages as a session's writer thread hands them over: states at 500 Hz, a hand at 100 Hz, a look each 10 ms.
struct Recorded : testing::Test {
  Recorded() : ocp(ur5e(), load_profile("waiter")->ocp) { place.path = folder.path() / "sessions"; }

  SessionRecorder make() {
    return SessionRecorder(ocp, settings, {{"robot", {{"json", robot_json(ur5e())}}}, {"run", {{"profile", "waiter"}}}},
                           begin, std::make_unique<RecordingFolder>(place));
  }
  void run(LiveTaps& taps, double seconds) {
    for (const Time end = now + from_seconds(seconds); now < end; now += std::chrono::milliseconds(2)) {
      const JointVector q = ur5e().home, zero = JointVector::Zero(6);
      taps.state({{now, now}, q, zero});
      taps.command({{now, now}, q, zero, zero});
      if (now.count() % 10'000'000 != 0) continue;
      OperatorSample sample;
      sample.stamp = {now, now};
      sample.clutch = true;
      taps.sample(sample);
      SessionSnapshot snapshot;
      snapshot.now = now;
      taps.look(snapshot);
    }
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> paths;
    if (!fs::exists(place.path)) return paths;
    for (const auto& entry : fs::directory_iterator(place.path)) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    return paths;
  }
  static SessionFile read(const fs::path& path) {
    SessionParts parts;
    parts.samples = parts.commands = parts.states = parts.changes = parts.settings = parts.cells = true;
    auto session = load_session(path, parts);
    EXPECT_TRUE(session) << session.error().message;
    return *std::move(session);
  }

  TemporaryFolder folder;
  Ocp ocp;
  RecordingSettings settings;
  RecordingFolderSettings place;
  const Time begin = std::chrono::seconds(5000);
  Time now = begin;
};

}  // namespace steadyhand
