#include "steadyhand/files/record/schemas.hpp"

#include <nlohmann/json.hpp>

namespace steadyhand {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson described(OrderedJson schema, const std::string& description) {
  schema["description"] = description;
  return schema;
}
OrderedJson number(const std::string& description) { return described({{"type", "number"}}, description); }
OrderedJson flag(const std::string& description) { return described({{"type", "boolean"}}, description); }
OrderedJson text(const std::string& description) { return described({{"type", "string"}}, description); }
OrderedJson array(const OrderedJson& items, const std::string& description) {
  return described({{"type", "array"}, {"items", items}}, description);
}
OrderedJson joints(const std::string& description) { return array({{"type", "number"}}, description); }
OrderedJson object(const std::string& title, const OrderedJson& properties) {
  return {{"title", title}, {"type", "object"}, {"properties", properties}};
}

OrderedJson time(const std::string& description) {
  return described(object("time", {{"sec", {{"type", "integer"}}},
                                   {"nsec", {{"type", "integer"}, {"minimum", 0}, {"maximum", 999'999'999}}}}),
                   description);
}

OrderedJson vector3(const std::string& description) {
  return described(
      object("foxglove.Vector3",
             {{"x", number("x coordinate")}, {"y", number("y coordinate")}, {"z", number("z coordinate")}}),
      description);
}

OrderedJson pose(const std::string& description) {
  const OrderedJson quaternion =
      object("foxglove.Quaternion",
             {{"x", number("x value")}, {"y", number("y value")}, {"z", number("z value")}, {"w", number("w value")}});
  return described(object("foxglove.Pose", {{"position", vector3("Point denoting position in 3D space, m")},
                                            {"orientation", described(quaternion, "Quaternion denoting orientation")}}),
                   description);
}

Schema finish(const std::string& name, const std::string& description, const OrderedJson& properties) {
  return {name, described(object(name, properties), description).dump(1)};
}

OrderedJson header() {
  return {{"timestamp", time("Timestamp of pose")},
          {"frame_id", text("Frame of reference for pose position and orientation")}};
}

/// foxglove.PoseInFrame and what we add to it. Channels that share a schema name share its text in MCAP, so the
/// properties of operator sample and target are listed together.
Schema pose_in_frame() {
  OrderedJson properties = header();
  properties["pose"] = pose("Pose in 3D space");
  properties["clutch"] = flag("/operator_sample: the operator holds the arm engaged");
  properties["tracked"] = flag("/operator_sample: the device has a valid pose");
  properties["emulated"] = flag("/operator_sample: the device guesses its position");
  properties["lead_s"] = number("/operator_sample: s, by which the device predicted the pose");
  properties["gripper"] = number("/operator_sample: 0 open to 1 closed, where the operator says it");
  properties["intervention"] = flag("/operator_sample: a person leads in the turn of a policy, which waits");
  properties["engaged"] = flag("/target: the arm is to follow");
  properties["leader"] =
      text("whose hand it is: person, recording (that plays) or policy, whose poses are in the base");
  return finish("foxglove.PoseInFrame", "A timestamped pose for an object or reference frame in 3D space", properties);
}

Schema poses_in_frame() {
  const OrderedJson node =
      object("node", {{"q", joints("rad (m)")},
                      {"dq", joints("rad/s (m/s)")},
                      {"ddq", joints("rad/s^2 (m/s^2), until the next node; the last node has none")}});
  OrderedJson properties = header();
  properties["poses"] = array(pose("Pose in 3D space"), "Poses in 3D space");
  properties["dt_s"] = number(
      "time from one pose to the next, s; the first pose of /plan is at timestamp, that of /reference dt_s later");
  properties["along_m"] = joints(
      "/reference: standard deviations of the poses' positions along the way that the hand goes, m; 0: not known");
  properties["across_m"] = joints("/reference: likewise, in each direction across it");
  properties["origin"] = text("/plan: solved, feasible or previous");
  properties["nodes"] = array(node, "/plan: the joints at the poses");
  return finish("foxglove.PosesInFrame", "An array of timestamped poses for an object or reference frame in 3D space",
                properties);
}

}  // namespace

Schema operator_sample_schema() { return pose_in_frame(); }
Schema target_schema() { return pose_in_frame(); }
Schema reference_schema() { return poses_in_frame(); }
Schema plan_schema() { return poses_in_frame(); }

Schema joint_command_schema() {
  return finish("steadyhand.JointCommand", "What the arm is told to do",
                {{"timestamp", time("when the arm is to be there")},
                 {"q", joints("rad (m)")},
                 {"dq", joints("rad/s (m/s)")},
                 {"ddq", joints("rad/s^2 (m/s^2)")},
                 {"gripper", number("0 open to 1 closed; arms that have none have none")}});
}

Schema joint_state_schema() {
  return finish("steadyhand.JointState", "What the arm says it does",
                {{"timestamp", time("when it was measured")},
                 {"q", joints("rad (m)")},
                 {"dq", joints("rad/s (m/s)")},
                 {"gripper", number("0 open to 1 closed; arms that have none have none")}});
}

Schema plan_step_schema() {
  return finish("steadyhand.PlanStep", "What one planning step did",
                {{"timestamp", time("start of the plan")},
                 {"target", pose("newest target, controlled frame in base")},
                 {"planned", pose("controlled frame in base at the start of the plan")},
                 {"q", joints("rad (m)")},
                 {"dq", joints("rad/s (m/s)")},
                 {"ddq", joints("rad/s^2 (m/s^2)")},
                 {"local_acceleration", vector3("specific force, tool frame, m/s^2; [0, 0, 9.81] at rest and upright")},
                 {"objective", number("value of the objective")},
                 {"shares", described({{"type", "object"}, {"additionalProperties", {{"type", "number"}}}},
                                      "what each term adds to the objective")},
                 {"iterations", {{"type", "integer"}}},
                 {"status", text("solved, feasible or previous")},
                 {"solve_time_us", number("wall clock, us")},
                 {"smallest_sphere_distance_m", number("surface to surface, over all pairs and nodes, m")},
                 {"engaged", flag("the arm followed the hand")},
                 {"object_distances_m",
                  described({{"type", "object"}, {"additionalProperties", {{"type", "number"}}}},
                            "of each object around the arm, without its margin, to the bodies that must not touch it; "
                            "null: all may")}});
}

Schema supervision_schema() {
  return finish("steadyhand.Supervision", "What the arm is allowed to do changed",
                {{"timestamp", time("when")},
                 {"from", text("idle, ready, engaged, holding, stopping or fault")},
                 {"to", text("idle, ready, engaged, holding, stopping or fault")},
                 {"reason", text("why, for people")},
                 {"is_failure", flag("the arm stops, and nobody asked for it")}});
}

Schema operator_settings_schema() {
  return finish("steadyhand.OperatorSettings", "What the operator has set, in force from here on",
                {{"timestamp", time("since when")},
                 {"weights", described({{"type", "object"}, {"additionalProperties", joints("weights")}},
                                       "of each term of the objective")},
                 {"scale", number("metres of the tool for each metre of the hand")},
                 {"yaw", number("turn of the operator's axes about the base's z, rad")},
                 {"tilt", number("how far the glass may lean with the hand, rad")},
                 {"no_spill", flag("plans spill nothing")},
                 {"fill", number("of liquid in the glass, m")},
                 {"latency", number("added on purpose between the hand's gate and the planner, s")},
                 {"prediction", text("how the hand goes on, for the planner")},
                 {"profile", text("that these began with")}});
}

Schema liquid_schema() {
  return finish("steadyhand.Liquid", "The liquid's surface in the glass, simulated from the measured motion",
                {{"timestamp", time("when")},
                 {"tilt_x", number("of the surface's normal about the glass's x axis, rad")},
                 {"tilt_y", number("about its y axis, rad")},
                 {"freeboard", number("from the surface's highest point to the rim, m; negative: over the rim")},
                 {"spilled", flag("has gone over the rim")},
                 {"spilled_share", number("of the liquid, so far")},
                 {"lateral", number("sideways force on it, m/s^2, the largest of the last 20 ms")}});
}

Schema active_constraint_schema() {
  return finish("steadyhand.ActiveConstraint", "Which constraint holds the arm back, from here on",
                {{"timestamp", time("since when")},
                 {"kind", text("none, position, velocity, acceleration, self_collision or reach")},
                 {"first", {{"type", "integer"}}},
                 {"second", {{"type", "integer"}}}});
}

Schema cell_schema() {
  const OrderedJson any = {{"type", "object"}, {"additionalProperties", true}};
  const OrderedJson cell = object("cell", {{"name", text("for people")}, {"objects", array(any, "see docs/cells.md")}});
  return finish("steadyhand.Cell", "What stands around the arm, from here on",
                {{"timestamp", time("since when; what moves is there then")}, {"cell", cell}});
}

Schema statistics_schema() {
  const auto timing = [](const char* description) {
    return described(
        object("timing",
               {{"p50", number("median, us")}, {"p99", number("us")}, {"p999", number("us")}, {"max", number("us")}}),
        description);
  };
  const auto count = [](const char* description) { return described({{"type", "integer"}}, description); };
  return finish("steadyhand.Statistics", "Counted since the session began",
                {{"timestamp", time("when")},
                 {"latency", timing("hand to the first command made from it")},
                 {"solve", timing("a solve with its check")},
                 {"wake", timing("how late control cycles began")},
                 {"samples", count("of the hand")},
                 {"plans", count("followed")},
                 {"rejected_plans", count("late, or failed their check")},
                 {"cycles", count("of control")},
                 {"missed_deadlines", count("of control")},
                 {"planner_rate_hz", number("planning steps a second")}});
}

Schema episode_schema() {
  return finish("steadyhand.Episode", "Something was said of an episode; the last that says it counts",
                {{"timestamp", time("when")},
                 {"episode", described({{"type", "integer"}}, "its number in the session, from 1")},
                 {"kind", text("begin, keep, discard or mark")},
                 {"success", flag("whether it did what it was to do; absent: as before, or not known")},
                 {"task", text("what is to be done, in words; absent: as before")},
                 {"notes", text("for people; absent: as before")}});
}

Schema scene_schema() {
  const auto count = [](const char* description) { return described({{"type", "integer"}}, description); };
  const OrderedJson thing = object("thing", {{"pose", pose("in the base's frame")},
                                             {"velocity", joints("m/s, base frame")},
                                             {"turning", joints("rad/s, base frame")},
                                             {"touches", count("a bit for each thing that it is in contact with")}});
  return finish("steadyhand.Scene", "A simulated scene, and how its task goes",
                {{"timestamp", time("when")},
                 {"reset", count("how often the scene was set up before")},
                 {"things", array(thing, "those that metadata 'task' names, in that order")},
                 {"time_s", number("since the scene was set up, or until the task was decided, s")},
                 {"held", count("a bit for each condition of the task that holds")},
                 {"spilled_share", number("of the liquid, since the scene was set up")},
                 {"success", flag("once it is decided")}});
}

Schema video_schema() {
  OrderedJson data = text("H.264 as an Annex B byte stream, one picture, none of which waits for later ones");
  data["contentEncoding"] = "base64";
  return finish("foxglove.CompressedVideo", "A picture of a camera",
                {{"timestamp", time("when it was exposed")},
                 {"frame_id", text("the camera's name")},
                 {"data", data},
                 {"format", text("h264")}});
}

}  // namespace steadyhand
