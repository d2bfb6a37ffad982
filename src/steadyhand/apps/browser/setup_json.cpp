#include "steadyhand/apps/browser/setup_json.hpp"

#include <array>
#include <optional>

#include "steadyhand/files/record/document_style.hpp"
#include "steadyhand/files/record/model_json.hpp"

namespace steadyhand {

struct LiquidNote {
  LiquidSettings liquid;
};
template <typename V>
void describe(V& v, LiquidNote& note) {
  LiquidSettings& liquid = note.liquid;
  v.add("radius", "m", "", liquid.glass.radius);
  v.add("height", "m", "", liquid.glass.height);
  v.add("fill", "m", "", liquid.glass.fill);
  v.add("viscosity", "m^2/s", "", liquid.glass.viscosity);
  v.add("margin", "m", "", liquid.margin);
  v.add("frequencies", "", "", liquid.frequencies);
  v.add("price", "1/m", "", liquid.price);
  v.add("least_weight", "g", "", liquid.least_weight);
  v.add("lean_max", "rad", "", liquid.lean_max);
}

struct ProfileNote {
  Profile profile;
};
template <typename V>
void describe(V& v, ProfileNote& note) {
  Profile& profile = note.profile;
  OcpSettings& ocp = profile.ocp;
  std::string prediction(to_string(profile.prediction));
  std::optional<LiquidNote> liquid;
  if (ocp.liquid) liquid = LiquidNote{*ocp.liquid};
  v.add("name", "", "", profile.name);
  v.add("label", "", "", profile.label);
  v.add("horizon", "", "", ocp.horizon);
  v.add("dt", "s", "", ocp.dt);
  v.add("weights", "", "", ocp.weights);
  v.add("velocity_scale", "", "", ocp.velocity_scale);
  v.add("acceleration_scale", "", "", ocp.acceleration_scale);
  v.add("position_margin", "rad (m)", "", ocp.position_margin);
  v.add("obstacle_rows", "", "", ocp.obstacle_rows);
  v.add("prediction", "", "", prediction);
  v.add("tilt_max", "rad", "", profile.tilt_max);
  v.add("solver", "", "", profile.solver);
  v.add("tolerance", "", "", profile.tolerance);
  v.add("liquid", "", "", liquid);
  if constexpr (kReads<V>) {
    const std::optional<Prediction> known = prediction_of(prediction);
    v.check(known.has_value(), "'prediction' is '" + prediction + "'; there is no such prediction");
    if (v.error()) return;
    profile.prediction = *known;
    if (liquid) ocp.liquid = liquid->liquid;
    add_optional_objectives(ocp);
  }
}

struct RecordingNote {
  NamedRecording named;
};
template <typename V>
void describe(V& v, RecordingNote& note) {
  auto& [name, recording] = note.named;
  std::vector<std::array<double, 10>> rows;
  for (const OperatorSample& sample : recording.samples) {
    const Pose& X = sample.X_operator_hand;
    rows.push_back({static_cast<double>(sample.stamp.hand.count()), X.p.x(), X.p.y(), X.p.z(), X.q.x(), X.q.y(),
                    X.q.z(), X.q.w(), sample.clutch ? 1.0 : 0.0, static_cast<double>(sample.tool)});
  }
  v.add("name", "", "", name);
  v.add("samples", "", "t (ns), position, rotation (x, y, z, w), clutch: 1 or 0, index of the tool", rows,
        sized(2, std::string::npos));
  if constexpr (kReads<V>) {
    recording.name = name;
    for (const auto& row : rows) {
      v.check(row[9] >= 0.0 && row[9] < kMaxTools, fmt::format("'samples' must be of tools 0 to {}", kMaxTools - 1));
      if (v.error()) return;
      OperatorSample& sample = recording.samples.emplace_back();
      sample.stamp.hand = sample.stamp.made = Time(static_cast<std::int64_t>(row[0]));
      sample.X_operator_hand = {{row[1], row[2], row[3]}, {row[7], row[4], row[5], row[6]}};
      sample.clutch = row[8] != 0.0;
      sample.tool = static_cast<int>(row[9]);
    }
  }
}

template <typename V>
void describe(V& v, BrowserSetup& setup) {
  RawJson<> robot, cell;
  if constexpr (!kReads<V>) robot.text = robot_json(setup.robot), cell.text = cell_json(setup.cell);
  std::vector<std::string> links = setup.robot.link_names;
  std::vector<ProfileNote> profiles;
  for (const Profile& profile : setup.profiles) profiles.push_back({profile});
  std::vector<RecordingNote> recordings;
  for (const NamedRecording& recording : setup.recordings) recordings.push_back({recording});
  v.add("robot", "", "", robot);
  v.add("link_names", "", "", links);
  v.add("cell", "", "", cell);
  v.add("profiles", "", "", profiles, sized(1, std::string::npos));
  v.add("profile", "", "", setup.profile, at_least(0));
  v.add("recordings", "", "", recordings);
  if constexpr (kReads<V>) {
    v.check(setup.profile < std::ssize(profiles),
            fmt::format("'profile' is {}; there are {} profiles", setup.profile, profiles.size()));
    if (v.error()) return;
    setup.robot = read_robot_json(OrderedJson::parse(robot.text), "robot");
    setup.cell = read_cell_json(OrderedJson::parse(cell.text), "cell");
    v.check(links.size() == setup.robot.joints.size() + 1, "'link_names' must be one more than there are joints");
    setup.robot.link_names = links;
    for (ProfileNote& note : profiles) setup.profiles.push_back(std::move(note.profile));
    for (RecordingNote& note : recordings) setup.recordings.push_back(std::move(note.named));
  }
}

std::string setup_json(const BrowserSetup& setup) { return document<PlainStyle>(setup); }

Result<BrowserSetup> read_setup_json(std::string_view text) {
  const OrderedJson json = OrderedJson::parse(text.begin(), text.end(), nullptr, false);
  if (json.is_discarded() || !json.is_object())
    return Error{"the session's data is no JSON object: cut short, perhaps"};
  try {
    BrowserSetup setup;
    JsonIn<OrderedJson, FileStyle> in(json, true);
    in.members(setup);
    if (in.error()) return *in.error();
    return setup;
  } catch (const json::Wrong& wrong) {
    return Error{wrong.message};
  } catch (const OrderedJson::exception& error) {
    return Error{error.what()};
  }
}

}  // namespace steadyhand
