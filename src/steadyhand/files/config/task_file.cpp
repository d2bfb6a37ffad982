#include "steadyhand/files/config/task_file.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "steadyhand/files/config/shape_reader.hpp"
#include "steadyhand/files/config/yaml_reader.hpp"

namespace steadyhand {

namespace {

constexpr Interval kLengths{-10.0, 10.0}, kTurns{-2.0 * M_PI, 2.0 * M_PI}, kTimes{0.0, 86400.0, true},
    kSymmetries{0.0, 2.0 * M_PI, true};

/// Reads into a task; things get their indices as they are first named.
class TaskReader {
 public:
  explicit TaskReader(Task& task) : task_(task) {}

  int thing(YamlMap& map, const std::string& key, const std::string& name) {
    if (const auto known = task_.find(name)) return *known;
    if (std::ssize(task_.things) == kMaxThings) {
      map.fail(key, fmt::format("is thing number {}; a task names {} at most", kMaxThings + 1, kMaxThings));
      return 0;
    }
    task_.things.push_back(name);
    return static_cast<int>(task_.things.size()) - 1;
  }

  Placing placing(YamlMap& map) {
    Placing placing;
    placing.thing = thing(map, "thing", map.text("thing"));
    placing.x = range(map, "x", kLengths);
    placing.y = range(map, "y", kLengths);
    if (map.has("yaw")) placing.yaw = range(map, "yaw", kTurns);
    placing.z = map.number("z", kLengths);
    return placing;
  }

  Condition condition(YamlMap& map) {
    Condition c;
    const auto one = [&](const char* key) {
      const std::string name = map.text(key);
      c.thing = thing(map, key, name);
      return name;
    };
    const auto two = [&](const char* key) {
      const std::vector<std::string> names = map.texts(key);
      if (names.size() != 2) {
        map.fail(key, fmt::format("names {} things; it must be two", names.size()));
        return names;
      }
      c.thing = thing(map, key, names[0]);
      c.other = thing(map, key, names[1]);
      return names;
    };
    const auto say = [&](const std::vector<std::string>& names, const char* words) {
      if (names.size() == 2) c.text = fmt::format("{} {} {}", names[0], words, names[1]);
    };
    if (map.has("near")) {
      c.kind = Condition::Kind::kNear;
      say(two("near"), "at");
      c.most = map.number("within", Interval::positive());
      c.height = map.number("height", Interval::positive());
    } else if (map.has("upright")) {
      c.kind = Condition::Kind::kUpright;
      c.text = one("upright") + " upright";
      c.most = map.number("within", {0.0, M_PI, true});
    } else if (map.has("still")) {
      c.kind = Condition::Kind::kStill;
      c.text = one("still") + " at rest";
      c.most = map.number("speed", Interval::positive());
    } else if (map.has("touches")) {
      c.kind = Condition::Kind::kTouches;
      say(two("touches"), "on");
    } else if (map.has("apart")) {
      c.kind = Condition::Kind::kApart;
      say(two("apart"), "off");
    } else if (map.has("released")) {
      c.kind = Condition::Kind::kReleased;
      c.text = one("released") + " released";
    } else if (map.has("aligned")) {
      c.kind = Condition::Kind::kAligned;
      say(two("aligned"), "turned as");
      c.most = map.number("within", {0.0, M_PI, true});
      c.symmetry = map.number("symmetry", kSymmetries, c.symmetry);
    } else if (map.has("spilled")) {
      c.kind = Condition::Kind::kSpilled;
      c.most = map.number("spilled", {0.0, 1.0});
      c.text = "nothing spilled";
    } else {
      map.fail("near",
               "must be there, or upright, still, touches, apart, released, aligned or spilled: what has to hold");
    }
    return c;
  }

  Move move(YamlMap& map) {
    Move move;
    if (map.has("tool")) move.tool_name = map.text("tool");
    if (map.has("gripper")) {
      move.gripper = map.number("gripper", {0.0, 1.0});
      return move;
    }
    move.to = thing(map, "to", map.text("to"));
    if (map.has("lead")) move.lead = thing(map, "lead", map.text("lead"));
    if (map.has("offset")) move.offset = read_vector(map, "offset");
    if (map.has("turn")) move.turn = thing(map, "turn", map.text("turn"));
    move.by = map.number("by", kTurns, move.by);
    move.symmetry = map.number("symmetry", kSymmetries, move.symmetry);
    move.speed = map.number("speed", Interval::positive(), move.speed);
    if (map.has("keep")) {
      for (const std::string& axis : map.texts("keep")) {
        if (axis != "x" && axis != "y") map.fail("keep", fmt::format("names '{}'; it must be x or y", axis));
        move.keep[axis == "y"] = true;
      }
    }
    return move;
  }

 private:
  static std::array<double, 2> range(YamlMap& map, const char* key, const Interval& within) {
    const std::vector<double> read = map.numbers(key, within, 2);
    if (read.size() != 2) return {};
    if (read[0] > read[1]) map.fail(key, fmt::format("is [{}, {}]; the first must not be larger", read[0], read[1]));
    return {read[0], read[1]};
  }

  Task& task_;
};

}  // namespace

Result<Task> load_task(const std::filesystem::path& file) {
  Result<YamlMap> opened = YamlMap::open(file);
  if (!opened) return opened.error();
  YamlMap& map = *opened;
  Task task;
  TaskReader reader(task);
  task.name = file.stem().string();
  task.instruction = map.text("instruction");
  task.robot = map.text("robot", "");
  task.scene = (file.parent_path() / map.text("scene")).string();
  if (map.has("tool")) {
    YamlMap tool = map.map("tool");
    task.tool = (file.parent_path() / tool.text("file")).string();
    task.stands_for = tool.texts("stands_for");
  }
  if (map.has("place")) {
    for (YamlMap& each : map.maps("place")) task.placings.push_back(reader.placing(each));
  }
  task.apart = map.number("apart", Interval::not_negative(), 0.0);
  if (map.has("keeps_off")) {
    for (YamlMap& each : map.maps("keeps_off")) {
      KeptOff& kept = task.keeps_off.emplace_back();
      kept.geom = each.text("geom");
      kept.margin = each.number("margin", {0.0, 1.0}, kept.margin);
      if (each.has("may_be_touched_by")) kept.may_be_touched_by = each.texts("may_be_touched_by");
    }
  }
  if (map.has("cameras")) task.cameras = map.texts("cameras");
  for (YamlMap& each : map.maps("success")) task.success.push_back(reader.condition(each));
  if (task.success.empty() || task.success.size() > 31) {
    map.fail("success", fmt::format("has {} conditions; it must be 1 to 31", task.success.size()));
  }
  if (map.has("moves")) {
    for (YamlMap& each : map.maps("moves")) task.moves.push_back(reader.move(each));
  }
  task.hold = map.number("hold", Interval::not_negative(), task.hold);
  task.time_limit = map.number("time_limit", kTimes, task.time_limit);
  if (Status status = map.finish(); !status) return status.error();
  return task;
}

Result<Task> open_task(const std::string& name, const Places& places) {
  if (name == "none") return Task();
  const Result<std::filesystem::path> file = find_named_file(places, "tasks", name);
  if (!file) return Error{"task " + file.error().message};
  return load_task(*file);
}

}  // namespace steadyhand
