// What becomes of the liquid when the control loop misses cycles: build/release/bench_stalls [--profile NAME]
// [--rate HZ] [FILE...]
//
// Sessions on a virtual clock, each with a simulated arm and a recorded hand: 10 s out of the npm package super-hands,
// or out of the files. Each row of the table is one kind of disturbance, six times per hand, 1.3 to 1.5 s apart. The
// liquid is that of the monitor, from the arm's motion in every cycle, also in those that were missed.
#include <fmt/format.h>

#include <filesystem>

#include "steadyhand/files/input/recording.hpp"
#include "support/virtual_session.hpp"
#include "support/watched_arm.hpp"

namespace steadyhand {
namespace {

constexpr double kLong = 10.0;  // s of a hand
constexpr int kHands = 20, kDisturbances = 6;

struct Hand {
  std::string name;
  std::vector<OperatorSample> samples;
  double scale = 1.0;

  Pose at(double t) const {
    const double end = to_seconds(samples.back().stamp.hand), at = std::clamp(t, 0.0, end);
    const auto after =
        std::upper_bound(samples.begin() + 1, samples.end() - 1, at,
                         [](double time, const auto& sample) { return time < to_seconds(sample.stamp.hand); });
    const auto before = after - 1;
    const double from = to_seconds(before->stamp.hand), to = to_seconds(after->stamp.hand);
    const double share = std::clamp((at - from) / (to - from), 0.0, 1.0);
    const Pose &a = before->X_operator_hand, &b = after->X_operator_hand;
    return {a.p + share * (b.p - a.p), a.q.slerp(share, b.q)};
  }
};

/// The parts of a file that are long enough and move; facing the arm as bench/carrying.py and the files' README have
/// it.
void add_parts(const std::filesystem::path& path, const std::string& track, std::vector<Hand>& parts) {
  for (double from = 0.0;; from += kLong) {
    RecordingOptions options;
    options.track = track;
    options.from = from;
    options.until = from + kLong;
    const auto recording = load_recording(path, options);
    if (!recording || recording->duration() < 0.5 * kLong) return;
    const bool turned = path.extension() == ".csv";
    const std::string stem = (path.stem() == "demo-recording" ? path.parent_path() : path).stem().string();
    Hand hand{fmt::format("{} {} from {} s", stem, track, from), recording->samples, 1.0};
    double way = 0.0;
    for (OperatorSample& sample : hand.samples) {
      Pose& pose = sample.X_operator_hand;
      if (turned) {
        const Quaternion half(Eigen::AngleAxisd(M_PI, Vector3::UnitZ()));
        pose = {half * pose.p, half * pose.q};
      }
      way = std::max(way, (pose.p - hand.samples.front().X_operator_hand.p).norm());
    }
    if (way < 0.05) continue;
    if (!turned) hand.scale = std::min(0.5, 0.35 / way);
    parts.push_back(std::move(hand));
  }
}

/// Evenly out of all parts.
std::vector<Hand> find_hands(const std::vector<std::filesystem::path>& files) {
  std::vector<Hand> parts;
  for (const auto& path : files) {
    if (path.extension() == ".csv")
      add_parts(path, "", parts);
    else
      for (const char* track : {"lhand", "rhand"}) add_parts(path, track, parts);
  }
  std::vector<Hand> chosen;
  const double step = std::max(1.0, static_cast<double>(parts.size()) / kHands);
  for (double i = 0.0; i < static_cast<double>(parts.size()) && chosen.size() < kHands; i += step)
    chosen.push_back(parts[static_cast<std::size_t>(i)]);
  return chosen;
}

std::vector<std::filesystem::path> bundled() {
  const std::filesystem::path folder = ".deps/node_modules/super-hands";
  std::vector<std::filesystem::path> files;
  for (const char* part : {"machinima_tests/recordings", "examples"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / part))
      if (entry.path().extension() == ".json" && (part[0] == 'm' || entry.path().stem() == "demo-recording"))
        files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

enum class Kind { kNone, kStall, kRefill, kRegrip };

struct Outcome {
  int disturbed = 0, left = 0;  ///< disturbances; after which the hand no longer controlled the arm
  bool spilled = false;
  double share = 0.0, freeboard = 1.0;
  MonitorResult seen;
};

Outcome disturb(const Hand& hand, Kind kind, double seconds, const std::string& profile, double rate) {
  Outcome outcome;
  Monitor truth(ur5e(), GlassSettings{});
  VirtualSession::Options options = VirtualSession::Options::at_rate(rate);
  options.profile = profile;
  options.scale = hand.scale;
  options.make_arm = [&](Clock& clock) {
    return std::make_unique<WatchedArm>(ur5e(), options.arm, clock,
                                        [&](const JointState& state) { truth.update(state); });
  };
  VirtualSession session(options);
  const double begin = session.now();
  session.hand = [&](double t) { return hand.at(t - begin); };
  const auto fresh = [&] {
    outcome.freeboard = std::min(outcome.freeboard, truth.liquid().least_freeboard);
    truth.reset_liquid();
  };
  session.run(0.2);
  if (!session.grip()) return outcome;
  session.run(1.0);
  for (int i = 0; i < kDisturbances && !truth.liquid().spilled; ++i) {
    if (session.state() != SupervisionState::kEngaged) {
      ++outcome.left;
      (void)session.run_until([&] { return session.at_rest(); }, 2.0);
      session.ask_reset();
      (void)session.run_until([&] { return session.state() == SupervisionState::kReady; }, 0.5);
      (void)session.grip();
      fresh();
      session.run(0.3);
    }
    session.run(0.3 + 0.0374 * i);
    ++outcome.disturbed;
    if (kind == Kind::kStall) session.clock().advance(seconds);
    if (kind == Kind::kRefill) {
      session.refill();
      fresh();
    }
    if (kind == Kind::kRegrip) {
      session.clutch = false;
      (void)session.run_until([&] { return session.at_rest(); }, 2.0);
      (void)session.grip();
      fresh();
    }
    session.run(1.0);
  }
  outcome.freeboard = std::min(outcome.freeboard, truth.liquid().least_freeboard);
  outcome.spilled = truth.liquid().spilled;
  outcome.share = truth.liquid().spilled_share;
  outcome.seen = session.monitor().result();
  return outcome;
}

int run(int argc, char** argv) {
  std::string profile = "carry";
  double rate = 50.0;
  bool each = false;
  std::vector<std::filesystem::path> files;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--profile" && i + 1 < argc)
      profile = argv[++i];
    else if (word == "--rate" && i + 1 < argc)
      rate = std::atof(argv[++i]);
    else if (word == "--each")
      each = true;
    else
      files.emplace_back(word);
  }
  const std::vector<Hand> hands = find_hands(files.empty() ? bundled() : files);
  fmt::print("{} hands, profile {}, {} plans a second\n", hands.size(), profile, rate);
  fmt::print("disturbance  hands that spill  largest share  least freeboard  disengaged  beyond a limit  in contact\n");
  const struct {
    const char* name;
    Kind kind;
    double seconds;
  } rows[] = {{"none", Kind::kNone, 0.0},     {"5 ms", Kind::kStall, 0.005},   {"10 ms", Kind::kStall, 0.01},
              {"20 ms", Kind::kStall, 0.02},  {"50 ms", Kind::kStall, 0.05},   {"100 ms", Kind::kStall, 0.1},
              {"refill", Kind::kRefill, 0.0}, {"new grip", Kind::kRegrip, 0.0}};
  for (const auto& row : rows) {
    int spilled = 0, disturbed = 0, left = 0;
    std::uint64_t beyond = 0, contact = 0;
    double share = 0.0, freeboard = 1.0;
    for (const Hand& hand : hands) {
      const Outcome outcome = disturb(hand, row.kind, row.seconds, profile, rate);
      if (each) fmt::print("  {}: {:.1f} %, {:.2f} mm\n", hand.name, 100.0 * outcome.share, 1e3 * outcome.freeboard);
      spilled += outcome.spilled;
      disturbed += outcome.disturbed;
      left += outcome.left;
      beyond += outcome.seen.beyond_limits + outcome.seen.too_fast;
      contact += outcome.seen.in_contact;
      share = std::max(share, outcome.share);
      freeboard = std::min(freeboard, outcome.freeboard);
    }
    fmt::print("{:<11}  {:>8} of {:<5}  {:>11.1f} %  {:>12.2f} mm  {:>4} of {:<3}  {:>14}  {:>10}\n", row.name, spilled,
               hands.size(), 100.0 * share, 1e3 * freeboard, left, disturbed, beyond, contact);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace steadyhand

int main(int argc, char** argv) { return steadyhand::run(argc, argv); }
