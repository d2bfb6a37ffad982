// Files that are generated from the messages' descriptions, compared with those in the repository. To write them again:
// STEADYHAND_WRITE=1 build/release/test_protocol --gtest_filter='ProtocolFiles.*'
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/operator/protocol/page_messages.hpp"
#include "support/reference.hpp"

namespace steadyhand {
namespace {

using namespace std::literals;

using OrderedJson = nlohmann::ordered_json;

template <typename... Messages>
std::vector<DataType> types_of(const std::variant<Messages...>*) {
  const auto with_type = [](DataType message, std::string_view type) {
    DataType name;
    name.kind = DataType::Kind::kEnumerator;
    name.enumerators = {{std::string(type), ""}};
    message.members.insert(message.members.begin(), DataType::Member{"type", "", "", true, {name}});
    return message;
  };
  return {with_type(data_type_of<Messages, BriefStyle>(), Messages::kType)...};
}
const std::vector<DataType>& client_types() {
  static const auto types = types_of(static_cast<const ClientMessage*>(nullptr));
  return types;
}
const std::vector<DataType>& server_types() {
  static const auto types = types_of(static_cast<const ServerMessage*>(nullptr));
  return types;
}
std::string type_name(const DataType& message) { return message.members.front().type.front().enumerators[0].name; }

/// Compares, or writes the file again.
void expect_file(const std::string& path, const std::string& text) {
  const std::string file = STEADYHAND_ROOT "/" + path;
  if (std::getenv("STEADYHAND_WRITE")) std::ofstream(file, std::ios::binary) << text;
  std::ifstream stream(file, std::ios::binary);
  const std::string content{std::istreambuf_iterator<char>(stream), {}};
  const auto at = std::mismatch(content.begin(), content.end(), text.begin(), text.end());
  EXPECT_TRUE(content == text)
      << path << " is not what the descriptions say; first where it has\n"
      << std::string(at.first, content.end()).substr(0, 200) << "\nit must have\n"
      << std::string(at.second, text.end()).substr(0, 200)
      << "\nSTEADYHAND_WRITE=1 build/release/test_protocol --gtest_filter='ProtocolFiles.*' writes it";
}

OperatorView example_view() {
  OperatorView s;
  s.now = from_seconds(81.5);
  s.state = SupervisionState::kHolding;
  s.reason = "hand not tracked";
  s.cause = {ReasonCode::kHandLost, Leader::kPerson};
  s.constraint = {ConstraintKind::kSelfCollision, 4, 27};
  s.measured.q.resize(6);
  s.measured.q << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
  s.measured.dq.setZero(6);
  s.measured.dq[5] = -1.0;
  s.command.q = s.measured.q;
  s.command.q[5] = 0.5;
  ToolSnapshot& tool = s.tools[0];
  tool.state = s.state;
  tool.reason = s.reason;
  tool.cause = s.cause;
  tool.X_base_tool.p = {0.4, 0.0, 0.5};
  tool.target.X_base_tool = {{0.5, 0.0, 0.5}, Quaternion(0.8, 0.0, 0.0, 0.6)};
  tool.target.engaged = true;
  tool.target.leader = Leader::kPolicy;
  tool.local_acceleration = {0.25, 0.0, 9.81};
  tool.tracking_error = 0.1;
  tool.gripper = 0.25;
  tool.gripper_command = 0.5;
  tool.path_nodes = 2;
  tool.path[0].p = tool.X_base_tool.p;
  tool.path[1].p = tool.target.X_base_tool.p;
  tool.predicted = 1;
  tool.prediction.p[0] = {0.5, 0.25, 0.5};
  tool.prediction.spread[0] = {0.03125, 0.015625};
  tool.liquid = {0.125, -0.5, std::numeric_limits<double>::quiet_NaN(), true, 0.125, -0.25, 1.5};
  s.clearance = 0.0625;
  s.nearest = {4, 27};
  s.solve_us = {2000, 4000, 5000, 6000};
  s.latency_us = {12000, 21000, 22000, 23000};
  s.plans = 10;
  s.cycles = 100;
  s.missed_deadlines = 1;
  s.rejected_plans = 2;
  s.samples = 90;
  s.planner_rate_hz = 50;
  s.planner_rate_automatic = true;
  s.recording = true;
  s.task = {12.5, 0b01, 0.125, false};
  s.episode = {true, 3, 4.5, 1, 1, 2, std::nullopt};
  s.scene.things = 1;
  s.scene.thing[0].X_base_thing.p = {0.5, 0.0, 0.25};
  s.controls = {1, {500.0, 3.0}, 2, 0.5, -1.5, 0.5, 0.0625, true, 0.25, -1, "cloned", true};
  return s;
}

/// Messages of the server, as it writes them.
std::vector<std::string> examples() {
  ServerFacts facts;
  facts.version = "0.1.0";
  facts.cell = R"({"name":"table"})";
  facts.robot = R"({"name":"ur5e"})";
  facts.glass = {0.03125, 0.125, 0.0625};
  facts.terms = {{"near", "Near the hand", "1/(m^2 s)", 3, 1.0, 1e4, true, false},
                 {"calm", "Lateral specific force", "s^3/m^2", 1, 0.0, 20.0, false, true}};
  facts.profiles = {{"tracking", "Tracking (P1)", {500.0, 0.0}}, {"waiter", "Waiter (P3)", {500.0, 3.0}, 1}};
  facts.recordings = {"reach"};
  facts.cameras = {{"front", 320, 240, 15.0}};
  facts.task = {"carry", "Carry the glass to the mark.", 30.0, {"glass at mark"}, {"mark", "glass"}};
  OperatorView idle;
  idle.tool_count = 2;
  idle.clearance = std::numeric_limits<double>::quiet_NaN();
  for (ToolSnapshot& tool : idle.tools) {
    tool.local_acceleration = kGravity;
    tool.tracking_error = std::numeric_limits<double>::quiet_NaN();
  }
  ServerFacts bare;
  bare.glass = facts.glass;
  return {to_json(WelcomeMessage{kProtocolVersion, 3, facts}),
          to_json(WelcomeMessage{kProtocolVersion, 1, bare}),
          to_json(example_view()),
          to_json(idle),
          to_json(CellMessage{{R"({"name":"table","objects":[]})"}}),
          to_json(CamerasMessage{{"", "film.mp4: the video ended"}}),
          to_json(StudyMessage{{R"({"text":"Reach each target."})"}}),
          to_json(StudyMessage{{"null"}}),
          to_json(RepliedMessage{3, {R"({"key":"tlx_mental","value":12})"}}),
          to_json(PairedMessage{"k3jqz7wd5nrs9hc2vbx4mtgp6f"}),
          to_json(LeaseMessage{3, true, false, 5, from_seconds(7.5)}),
          to_json(LeaseMessage{0, false, true, 0, std::nullopt}),
          to_json(StoppedMessage{3}),
          to_json(PongMessage{3.25, from_seconds(81.5)}),
          to_json(ErrorMessage{Refusal::kTaken, "client 3 commands the arm now"})};
}

/// A line for each member, where it is not larger than most.
std::string laid_out(const OrderedJson& json, std::size_t depth = 0) {
  std::string line = json.dump();
  if ((!json.is_object() && !json.is_array()) || line.size() <= 300) return line;
  std::vector<std::string> parts;
  for (const auto& [key, value] : json.items()) {
    const std::string name = json.is_object() ? OrderedJson(key).dump() + ": " : "";
    parts.push_back(std::string(depth + 1, ' ') + name + laid_out(value, depth + 1));
  }
  const bool object = json.is_object();
  return (object ? "{\n" : "[\n") + joined(parts, ",\n") + "\n" + std::string(depth, ' ') + (object ? "}" : "]");
}

TEST(ProtocolFiles, SchemaWithTheServersMessagesByteByByte) {
  const std::vector<std::string> written = examples();
  const auto mark = [](std::size_t i) { return fmt::format("example {}.", i); };
  OrderedJson schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                        {"title", fmt::format("steadyhand protocol, version {}", kProtocolVersion)}};
  for (const auto& [side, types] : {std::pair("client", client_types()), std::pair("server", server_types())}) {
    for (const DataType& type : types) {
      std::string text;
      JsonWriter json(text);
      write_schema(json, type, true);
      OrderedJson definition = OrderedJson::parse(text);
      for (std::size_t i = 0; i < written.size(); ++i) {
        const bool is_of_it = side == "server"sv && OrderedJson::parse(written[i])["type"] == type_name(type);
        if (is_of_it) definition["examples"].push_back(mark(i));
      }
      schema["definitions"][side]["anyOf"].push_back(definition);
    }
  }
  std::string text = laid_out(schema) + "\n";
  for (std::size_t i = 0; i < written.size(); ++i) {  // byte by byte
    text.replace(text.find("\"" + mark(i)), mark(i).size() + 2, written[i]);
  }
  expect_file("web/protocol/schema.json", text);
}

TEST(ProtocolFiles, TypeScript) {
  TypeScript out;
  for (const auto& [side, types] : {std::pair("Client", client_types()), std::pair("Server", server_types())}) {
    std::vector<std::string> names;
    for (const DataType& type : types) names.push_back(out.use(type));
    out.line(fmt::format("\nexport type {}Message = {};", side, joined(names, " | ")));
  }
  std::vector<std::string> names;
  for (const DataType& type : server_types()) names.push_back("'" + type_name(type) + "'");
  const std::string known = joined({out.known().begin(), out.known().end()}, ", ");
  expect_file(
      "web/src/protocol.ts",
      fmt::format(
          R"(/** The messages of docs/reference/protocol.md: SI units, radians; poses in robot axes (z up). This file is made of the
 * descriptions in src/steadyhand/operator/protocol/page_messages.hpp by tests/operator/protocol/protocol_files_test.cpp. */
import type {{ {} }} from './descriptions';

export * from './descriptions';

export const PROTOCOL_VERSION = {};
{}
export type RequestKind = RequestMessage['kind'];

const KNOWN: ReadonlySet<string> = new Set([{}]);

/** null: nothing that a server of this version says. */
export function decode(text: string): ServerMessage | null {{
  let message: unknown;
  try {{
    message = JSON.parse(text);
  }} catch {{
    return null;
  }}
  if (typeof message !== 'object' || message === null || !('type' in message)) return null;
  return typeof message.type === 'string' && KNOWN.has(message.type) ? (message as ServerMessage) : null;
}}

export const encode = (message: ClientMessage): string => JSON.stringify(message);
)",
          known + ", Measure, Quat, Vec3", kProtocolVersion, out.text(), joined(names, ", ")));
}

}  // namespace
}  // namespace steadyhand
