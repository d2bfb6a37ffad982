// Solves of two arms next to those of one, on two recorded hands: build/release/bench_two_arms [--help]
//
// The whole pipeline plans at 500 Hz, in simulated time. The same run is repeated; of each solve the least time counts,
// which other work on the machine disturbs little. The first tool follows the right hand of one bundled recording, the
// second that of another, forth and back, each scaled so that it stays in reach.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/places.hpp"
#include "steadyhand/files/input/recording.hpp"
#include "steadyhand/planning/pipeline/pipeline.hpp"

namespace steadyhand::bench {
namespace {

struct Options {
  std::vector<std::string> robots{"ur5e", "two_ur5e"}, profiles{"tracking", "carry"};
  int solves = 5000, repetitions = 3;
  double rate_hz = 500.0;
};

constexpr const char* kHands[kMaxTools] = {"physics", "events"};
constexpr double kReach = 0.35, kScale = 0.5;  // m, of a tool around its start; at most

struct Hand {
  std::vector<OperatorSample> samples;
  double scale = kScale;

  Pose at(double t) const {
    const double length = to_seconds(samples.back().stamp.hand - samples.front().stamp.hand);
    const double way = std::fmod(t, 2.0 * length);
    const Time time = samples.front().stamp.hand + from_seconds(std::min(way, 2.0 * length - way));
    const auto after = std::find_if(samples.begin() + 1, samples.end() - 1,
                                    [&](const OperatorSample& sample) { return sample.stamp.hand >= time; });
    const OperatorSample &a = *(after - 1), &b = *after;
    const double share = to_seconds(time - a.stamp.hand) / to_seconds(b.stamp.hand - a.stamp.hand);
    const Pose &first = a.X_operator_hand, &second = b.X_operator_hand;
    return {first.p + share * (second.p - first.p), first.q.slerp(share, second.q)};
  }
};

Result<Hand> read_hand(const std::string& name) {
  RecordingOptions options;
  options.track = "rhand";
  const auto recording = load_recording(Places::standard().data / "recordings" / name / "demo-recording.json", options);
  if (!recording) return recording.error();
  Hand hand{recording->samples};
  const Vector3 begin = hand.samples.front().X_operator_hand.p;
  for (const OperatorSample& sample : hand.samples)
    hand.scale = std::min(hand.scale, kReach / (sample.X_operator_hand.p - begin).norm());
  return hand;
}

struct Figures {
  std::vector<double> us, iterations;  ///< of each solve
  int unsolved = 0, refused = 0;
};

Status run(const Options& options, const RobotModel& model, const Profile& profile, const std::vector<Hand>& hands,
           Figures& figures) {
  auto made = Pipeline::make(model, PipelineSettings(profile));
  if (!made) return made.error();
  Pipeline& pipeline = **made;
  const bool first = figures.us.empty();
  if (first) figures.us.assign(options.solves, 1e9);
  int sample = 0;
  for (int i = 0; i < options.solves; ++i) {
    const double now = i / options.rate_hz;
    for (; sample / 90.0 <= now; ++sample) {
      for (int t = 0; t < model.tool_count(); ++t) {
        pipeline.retargeter(t).set_scale(hands[t].scale);
        OperatorSample next;
        next.stamp = {from_seconds(sample / 90.0), from_seconds(sample / 90.0)};
        next.X_operator_hand = hands[t].at(sample / 90.0);
        next.clutch = true;
        next.tool = t;
        if (Status s = pipeline.feed(next); !s) return s;
      }
    }
    pipeline.plan(from_seconds(now));
    const Solution& solution = pipeline.planner().solution();
    figures.us[i] = std::min(figures.us[i], solution.time_us);
    if (!first) continue;
    figures.iterations.push_back(solution.iterations);
    figures.unsolved += solution.status != SolveStatus::kSolved;
    figures.refused += pipeline.planner().fault() != PlanFault::kNone;
  }
  return Done{};
}

double percentile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The model without the pairs between its arms.
RobotModel apart(RobotModel model) {
  const auto is_own = [&](int body, int tool) {
    const std::vector<int> joints = model.chain(model.bodies[body].link);
    const std::vector<int> others = model.chain(model.tools[1 - tool].link);
    return std::ranges::any_of(joints, [&](int k) { return !std::ranges::binary_search(others, k); });
  };
  std::erase_if(model.pairs, [&](const BodyPair& pair) {
    return (is_own(pair.first, 0) && is_own(pair.second, 1)) || (is_own(pair.first, 1) && is_own(pair.second, 0));
  });
  model.name += " apart";
  return model;
}

int main_with(const Options& options) {
  const auto fail = [](const Error& error) {
    std::cerr << error.message << "\n";
    return 2;
  };
  std::vector<Hand> hands;
  for (const char* name : kHands) {
    auto hand = read_hand(name);
    if (!hand) return fail(hand.error());
    hands.push_back(*std::move(hand));
  }
  std::vector<RobotModel> models;
  for (const std::string& name : options.robots) {
    auto model = open_robot(name);
    if (!model) return fail(model.error());
    if (model->tool_count() > 1) models.push_back(apart(*model));
    models.push_back(*std::move(model));
  }
  fmt::print("{:18} {:9} {:>6} {:>5} {:>8} {:>7} {:>8} {:>7} {:>8} {:>5} {:>7} {:>8} {:>8} {:>7}\n", "robot", "profile",
             "joints", "pairs", "p50 us", "/ first", "p99", "/ p50", "us / it", "it.", "it. p99", "most", "unsolved",
             "refused");
  for (const std::string& name : options.profiles) {
    const auto profile = load_profile(name);
    if (!profile) return fail(profile.error());
    std::vector<Figures> all(models.size());
    for (int repetition = 0; repetition < options.repetitions; ++repetition) {
      for (std::size_t m = 0; m < models.size(); ++m)
        if (Status s = run(options, models[m], *profile, hands, all[m]); !s) return fail(s.error());
    }
    for (std::size_t m = 0; m < models.size(); ++m) {
      const Figures& f = all[m];
      std::vector<double> each;
      double mean = 0.0;
      for (std::size_t i = 0; i < f.us.size(); ++i) {
        each.push_back(f.us[i] / std::max(1.0, f.iterations[i]));
        mean += f.iterations[i] / static_cast<double>(f.us.size());
      }
      const double p50 = percentile(f.us, 0.5), p99 = percentile(f.us, 0.99);
      fmt::print("{:18} {:9} {:6} {:5} {:8.1f} {:7.2f} {:8.1f} {:7.2f} {:8.1f} {:5.2f} {:7} {:8} {:8} {:7}\n",
                 models[m].name, name, models[m].dof(), models[m].pairs.size(), p50, p50 / percentile(all[0].us, 0.5),
                 p99, p99 / p50, percentile(each, 0.5), mean, percentile(f.iterations, 0.99),
                 percentile(f.iterations, 1.0), f.unsolved, f.refused);
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace
}  // namespace steadyhand::bench

int main(int argc, char** argv) {
  steadyhand::bench::Options options;
  steadyhand::CommandLine app("bench_two_arms", "Solves of two arms next to those of one, on recorded hands");
  app.add_option("--robot", options.robots, "Robots; of two arms also without the pairs between them")
      ->capture_default_str();
  app.add_option("--profile", options.profiles, "Profiles")->capture_default_str();
  app.add_option("--solves", options.solves, "Of each robot and profile")->capture_default_str();
  app.add_option("--repetitions", options.repetitions, "Of which the least time of each solve counts")
      ->capture_default_str();
  app.add_option("--rate", options.rate_hz, "Plans per second, Hz")->capture_default_str();
  const steadyhand::Result<bool> parsed = app.parse(argc, argv);
  if (!parsed) std::cerr << parsed.error().message << "\n";
  if (!parsed || !*parsed) return parsed ? 0 : 2;
  if (options.solves < 1 || options.repetitions < 1 || !(options.rate_hz > 0.0)) {
    std::cerr << fmt::format("--solves is {}, --repetitions {} and --rate {}; each must be above 0\n", options.solves,
                             options.repetitions, options.rate_hz);
    return 2;
  }
  return steadyhand::bench::main_with(options);
}
