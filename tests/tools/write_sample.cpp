// write_sample FOLDER: sample.mcap and report.html, made by formulas (report/sample_run.hpp).
#include <fmt/format.h>

#include <filesystem>

#include "report/figures/sample_run.hpp"
#include "steadyhand/files/record/recorder.hpp"

namespace steadyhand {
namespace {

/// Operator samples at 90 Hz, target, reference, plan and step at 20 Hz, command and state at 500 Hz, in order of time.
Status write_recording(const ReportInput& input, const std::filesystem::path& path) {
  const ProfileResult& profile = input.profiles.front();
  Result<Recorder> recorder = Recorder::create(path, {{}, profile.names, false, {{"recording", input.recording}}});
  if (!recorder) return recorder.error();

  std::size_t step = 0, sample = 0;
  for (const JointCommand& command : profile.commands) {
    const Time now = command.stamp.made;
    for (; from_seconds(static_cast<double>(sample) / 90) <= now; ++sample) {
      OperatorSample hand;
      hand.stamp.hand = hand.stamp.made = from_seconds(static_cast<double>(sample) / 90);
      if (Status status = recorder->write(hand); !status) return status;
    }
    for (; step < profile.steps.size() && from_seconds(profile.steps[step].t_s) <= now; ++step) {
      const PlanStep& made = profile.steps[step];
      const Stamp stamp = {from_seconds(made.t_s), now};
      Reference reference;
      reference.stamp = stamp;
      reference.nodes = 8;
      Plan plan;
      plan.stamp = stamp;
      plan.start = now;
      plan.joints = 6;
      plan.intervals = 8;
      for (int k = 0; k <= 8; ++k) {
        if (k < 8)
          reference.tools[0].p[k] = made.tools[0].X_base_target.p,
          reference.tools[0].R[k] = made.tools[0].X_base_target.q.toRotationMatrix();
        plan.x[k].resize(12);
        plan.x[k] << made.q, made.dq;
        if (k < 8) plan.u[k] = made.ddq;
      }
      const ToolPaths paths{std::vector<Pose>(9, made.tools[0].X_base_planned)};
      for (const Status& status : {recorder->write(Target{stamp, made.tools[0].X_base_target, true}),
                                   recorder->write(reference), recorder->write(plan, paths), recorder->write(made)}) {
        if (!status) return status;
      }
    }
    if (Status status = recorder->write(command); !status) return status;
    if (Status status = recorder->write(JointState{command.stamp, command.q, command.dq}); !status) return status;
  }
  return recorder->close();
}

}  // namespace
}  // namespace steadyhand

int main(int argc, char** argv) {
  using namespace steadyhand;
  if (argc != 2) {
    fmt::print(stderr, "usage: write_sample FOLDER\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  const ReportInput input = test::sample_input();
  for (const Status& status :
       {write_recording(input, folder / "sample.mcap"), write_report(input, folder / "report.html")}) {
    if (!status) {
      fmt::print(stderr, "{}\n", status.error().message);
      return 1;
    }
  }
  fmt::print("{}", format_table(input.profiles));
  return 0;
}
