#include "steadyhand/files/config/cell_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>

#include "steadyhand/core/turn.hpp"
#include "steadyhand/files/config/cell_formats.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/shape_reader.hpp"

namespace steadyhand {

namespace {

constexpr Interval kMargins{0.0, 1.0};  // m

std::string read_color(YamlMap& object) {
  const std::string color = object.text("color", "");
  const auto is_hex = [](unsigned char c) { return std::isxdigit(c) != 0; };
  if (!color.empty() && color != "none" &&
      (color.size() != 7 || color[0] != '#' || !std::all_of(color.begin() + 1, color.end(), is_hex))) {
    object.fail("color", "must be \"#rrggbb\", six digits from 0 to f in quotes, or none: not drawn");
  }
  return color;
}

CellObject read_object(YamlMap& map, double margin) {
  CellObject object;
  object.name = map.text("name");
  const ShapeEntry read = read_shape(map, ShapesFor::kWorld);
  object.shape = read.shape;
  object.origin = read.origin;
  object.margin = map.number("margin", kMargins, margin);
  if (map.has("may_be_touched_by")) object.may_be_touched_by = map.texts("may_be_touched_by");
  object.attached = map.boolean("attached", false);
  object.color = read_color(map);
  return object;
}

/// The outside of a box, for the tool: a half-space beyond each of its faces.
void add_keep_in(YamlMap map, double margin, Cell& cell) {
  margin = map.number("margin", kMargins, margin);
  const ShapeEntry read = read_shape(map, ShapesFor::kWorld);
  if (read.shape.kind != ShapeKind::kBox || read.shape.radius > 0.0) {
    map.fail("box", "must be there, without 'rounding': the tool is kept in a box");
    return;
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const char side : {'-', '+'}) {
      const Vector3 out = (side == '-' ? -1.0 : 1.0) * Vector3::Unit(axis);
      CellObject object;
      object.name = fmt::format("keep_in {}{}", side, "xyz"[axis]);
      object.shape = Shape::half_space();
      object.origin =
          read.origin * Eigen::Translation3d(read.shape.core[axis] * out) * turn_between(Vector3::UnitZ(), -out);
      object.margin = margin;
      object.holds_only_tool = true;
      cell.objects.push_back(object);
    }
  }
}

/// Whether the file's poses are in the frame of the URDF's root.
bool read_frame(YamlMap& map) {
  const std::string frame = map.text("frame", "base");
  if (frame != "base" && frame != "root") map.fail("frame", fmt::format("is '{}'; it must be base or root", frame));
  return frame == "root";
}

/// Objects of these formats may have several solids, which all have the object's name: the second becomes "NAME 2",
/// etc. Names that other objects have are skipped.
Result<Cell> with_own_names(Result<Cell> cell) {
  if (!cell) return cell;
  std::map<std::string, int> solids;
  for (const CellObject& object : cell->objects) solids.emplace(object.name, 0);
  std::set<std::string> invented;
  for (CellObject& object : cell->objects) {
    int& number = solids[object.name];
    if (++number == 1) continue;
    std::string name;
    do name = fmt::format("{} {}", object.name, number++);
    while (solids.contains(name) || !invented.insert(name).second);
    --number;
    object.name = name;
  }
  return cell;
}

Result<Cell> in_root(Result<Cell> cell) {
  if (!cell) return cell;
  for (CellObject& object : cell->objects) object.in_root = true;
  return cell;
}

}  // namespace

std::string hex_color(const std::vector<double>& rgb) {
  const auto byte = [&](int i) { return static_cast<int>(std::lround(255.0 * std::clamp(rgb.at(i), 0.0, 1.0))); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(0), byte(1), byte(2));
}

Result<Cell> load_cell(const std::filesystem::path& file) {
  if (file.extension() == ".scene") return in_root(with_own_names(load_moveit_scene(file)));
  if (file.extension() == ".urdf" || file.extension() == ".xacro") return in_root(with_own_names(load_urdf_cell(file)));
  Result<YamlMap> opened = YamlMap::open(file);
  if (!opened) return opened.error();
  YamlMap& map = *opened;
  Cell cell;
  bool of_root = false;
  if (is_curobo_world(map)) {
    cell.name = file.stem().string();
    read_curobo_world(map, cell);
    of_root = true;
  } else {
    cell.name = map.text("name", file.stem().string());
    of_root = read_frame(map);
    const double margin = map.number("margin", kMargins, CellObject().margin);
    if (map.has("objects")) {
      for (YamlMap& object : map.maps("objects")) cell.objects.push_back(read_object(object, margin));
    }
    if (map.has("keep_in")) add_keep_in(map.map("keep_in"), margin, cell);
  }
  if (Status status = map.finish(); !status) return status.error();
  return of_root ? in_root(std::move(cell)) : cell;
}

Result<Cell> open_cell(const std::string& name, const Places& places) {
  if (name == "none") return Cell{"none", {}};
  const Result<std::filesystem::path> file = find_named_file(places, "cells", name);
  if (!file) return Error{"cell " + file.error().message};
  return load_cell(*file);
}

}  // namespace steadyhand
