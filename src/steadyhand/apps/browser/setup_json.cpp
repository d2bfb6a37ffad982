#include "steadyhand/apps/browser/setup_json.hpp"

#include "steadyhand/files/record/model_json.hpp"

namespace steadyhand {

namespace {

OrderedJson to_json(const LiquidSettings& liquid) {
  const GlassSettings& glass = liquid.glass;
  return {{"radius", glass.radius},     {"height", glass.height},
          {"fill", glass.fill},         {"viscosity", glass.viscosity},
          {"margin", liquid.margin},    {"frequencies", liquid.frequencies},
          {"price", liquid.price},      {"least_weight", liquid.least_weight},
          {"lean_max", liquid.lean_max}};
}

OrderedJson to_json(const Profile& profile) {
  const OcpSettings& ocp = profile.ocp;
  OrderedJson json = {{"name", profile.name},
                      {"label", profile.label},
                      {"horizon", ocp.horizon},
                      {"dt", ocp.dt},
                      {"weights", ocp.weights},
                      {"velocity_scale", ocp.velocity_scale},
                      {"acceleration_scale", ocp.acceleration_scale},
                      {"position_margin", numbers_json(ocp.position_margin)},
                      {"obstacle_rows", ocp.obstacle_rows},
                      {"prediction", to_string(profile.prediction)},
                      {"tilt_max", profile.tilt_max},
                      {"solver", profile.solver},
                      {"tolerance", profile.tolerance}};
  if (ocp.liquid) json["liquid"] = to_json(*ocp.liquid);
  return json;
}

/// Samples as lists of t, position, rotation (x, y, z, w), clutch: 1 or 0.
OrderedJson to_json(const NamedRecording& recording) {
  OrderedJson samples = OrderedJson::array();
  for (const OperatorSample& sample : recording.recording.samples) {
    const Pose& X = sample.X_operator_hand;
    samples.push_back({sample.stamp.hand.count(), X.p.x(), X.p.y(), X.p.z(), X.q.x(), X.q.y(), X.q.z(), X.q.w(),
                       sample.clutch ? 1 : 0});
  }
  return {{"name", recording.name}, {"samples", std::move(samples)}};
}

/// An object whose numbers are asked for by name.
struct Numbers {
  const OrderedJson& json;
  const std::string key;
  double operator()(const char* name) const { return json::number(json::member(json, key, name), key + "." + name); }
};

LiquidSettings read_liquid(const OrderedJson& json, const std::string& key) {
  const Numbers number{json, key};
  LiquidSettings liquid;
  liquid.glass = {number("radius"), number("height"), number("fill"), number("viscosity")};
  liquid.margin = number("margin");
  const auto frequencies = json::vector<Eigen::VectorXd>(json::member(json, key, "frequencies"), key + ".frequencies",
                                                         std::ssize(liquid.frequencies));
  std::copy(frequencies.begin(), frequencies.end(), liquid.frequencies.begin());
  liquid.price = number("price");
  liquid.least_weight = number("least_weight");
  liquid.lean_max = number("lean_max");
  return liquid;
}

Profile read_profile(const OrderedJson& json, const std::string& key) {
  const Numbers number{json, key};
  const auto text = [&](const char* name) { return json::text(json::member(json, key, name), key + "." + name); };
  Profile profile;
  profile.name = text("name");
  profile.label = text("label");
  OcpSettings& ocp = profile.ocp;
  ocp.horizon = static_cast<int>(number("horizon"));
  ocp.dt = number("dt");
  const OrderedJson& weights = json::member(json, key, "weights");
  if (!weights.is_object()) json::fail(key + ".weights", "must be an object");
  for (const auto& [term, values] : weights.items()) {
    const std::string entry = key + ".weights." + term;
    json::array(values, entry, -1);
    for (const OrderedJson& value : values) ocp.weights[term].push_back(json::number(value, entry));
  }
  ocp.velocity_scale = number("velocity_scale");
  ocp.acceleration_scale = number("acceleration_scale");
  const OrderedJson& margin = json::array(json::member(json, key, "position_margin"), key + ".position_margin", -1);
  if (margin.size() > kMaxJoints) json::fail(key + ".position_margin", "has more entries than an arm has joints");
  ocp.position_margin = json::vector<Eigen::VectorXd>(margin, key + ".position_margin", -1);
  ocp.obstacle_rows = static_cast<int>(number("obstacle_rows"));
  const std::string prediction = text("prediction");
  const std::optional<Prediction> known = prediction_of(prediction);
  if (!known) json::fail(key + ".prediction", "is '" + prediction + "'; there is no such prediction");
  profile.prediction = *known;
  profile.tilt_max = number("tilt_max");
  profile.solver = text("solver");
  profile.tolerance = number("tolerance");
  if (json.contains("liquid")) ocp.liquid = read_liquid(json["liquid"], key + ".liquid");
  add_optional_objectives(ocp);
  return profile;
}

NamedRecording read_recording(const OrderedJson& json, const std::string& key) {
  NamedRecording recording;
  recording.name = json::text(json::member(json, key, "name"), key + ".name");
  recording.recording.name = recording.name;
  const OrderedJson& rows = json::array(json::member(json, key, "samples"), key + ".samples", -1);
  if (rows.size() < 2) json::fail(key + ".samples", "must be two at least");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string entry = fmt::format("{}.samples[{}]", key, i);
    const auto row = json::vector<Eigen::VectorXd>(rows[i], entry, 9);
    OperatorSample& sample = recording.recording.samples.emplace_back();
    sample.stamp.hand = sample.stamp.made = Time(static_cast<std::int64_t>(row[0]));
    sample.X_operator_hand.p = row.segment<3>(1);
    sample.X_operator_hand.q = Quaternion(row[7], row[4], row[5], row[6]);
    sample.clutch = row[8] != 0.0;
  }
  return recording;
}

BrowserSetup read(const OrderedJson& json) {
  BrowserSetup setup;
  setup.robot = read_robot_json(json::member(json, "setup", "robot"), "robot");
  setup.robot.link_names.clear();
  const OrderedJson& links =
      json::array(json::member(json, "setup", "link_names"), "link_names", std::ssize(setup.robot.joints) + 1);
  for (const OrderedJson& link : links) setup.robot.link_names.push_back(json::text(link, "link_names"));
  setup.cell = read_cell_json(json::member(json, "setup", "cell"), "cell");
  const OrderedJson& profiles = json::array(json::member(json, "setup", "profiles"), "profiles", -1);
  for (std::size_t i = 0; i < profiles.size(); ++i)
    setup.profiles.push_back(read_profile(profiles[i], fmt::format("profiles[{}]", i)));
  const double first = json::number(json::member(json, "setup", "profile"), "profile");
  if (!(first >= 0.0) || !(first < static_cast<double>(profiles.size())))
    json::fail("profile", fmt::format("is {}; there are {} profiles", first, profiles.size()));
  setup.profile = static_cast<int>(first);
  const OrderedJson& recordings = json::array(json::member(json, "setup", "recordings"), "recordings", -1);
  for (std::size_t i = 0; i < recordings.size(); ++i)
    setup.recordings.push_back(read_recording(recordings[i], fmt::format("recordings[{}]", i)));
  return setup;
}

}  // namespace

std::string setup_json(const BrowserSetup& setup) {
  OrderedJson profiles = OrderedJson::array(), recordings = OrderedJson::array();
  for (const Profile& profile : setup.profiles) profiles.push_back(to_json(profile));
  for (const NamedRecording& recording : setup.recordings) recordings.push_back(to_json(recording));
  const OrderedJson json = {{"robot", OrderedJson::parse(robot_json(setup.robot))},
                            {"link_names", setup.robot.link_names},
                            {"cell", OrderedJson::parse(cell_json(setup.cell))},
                            {"profiles", std::move(profiles)},
                            {"profile", setup.profile},
                            {"recordings", std::move(recordings)}};
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

Result<BrowserSetup> read_setup_json(std::string_view text) {
  const OrderedJson json = OrderedJson::parse(text.begin(), text.end(), nullptr, false);
  if (json.is_discarded() || !json.is_object())
    return Error{"the session's data is no JSON object: cut short, perhaps"};
  try {
    return read(json);
  } catch (const json::Wrong& wrong) {
    return Error{wrong.message};
  } catch (const OrderedJson::exception& error) {
    return Error{error.what()};
  }
}

}  // namespace steadyhand
