#include "steadyhand/files/record/cell_json.hpp"

#include <fmt/format.h>

#include "steadyhand/files/record/shape_json.hpp"

namespace steadyhand {

std::string cell_json(const Cell& cell, std::optional<Time> at) {
  OrderedJson objects = OrderedJson::array();
  for (const CellObject& object : cell.objects) {
    OrderedJson json = {{"name", object.name}};
    json.update(shape_json(object.shape, object.origin));
    json["velocity"] = numbers_json(object.velocity);
    json["margin"] = object.margin;
    json["color"] = object.color;
    json["holds_only_tool"] = object.holds_only_tool;
    json["attached"] = object.attached;
    json["may_be_touched_by"] = object.may_be_touched_by;
    objects.push_back(std::move(json));
  }
  OrderedJson json = {{"name", cell.name}};
  if (at) json["at_s"] = to_seconds(*at);
  json["objects"] = std::move(objects);
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

Cell read_cell_json(const OrderedJson& json, const std::string& key) {
  Cell cell;
  cell.name = json::member(json, key, "name").get<std::string>();
  const OrderedJson& objects = json::array(json::member(json, key, "objects"), key + ".objects", -1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::string entry = fmt::format("{}.objects[{}]", key, i);
    const OrderedJson& told = objects[i];
    CellObject& object = cell.objects.emplace_back();
    object.name = json::member(told, entry, "name").get<std::string>();
    object.origin = read_shape_json(told, entry, object.shape);
    object.velocity = json::vector<Eigen::VectorXd>(json::member(told, entry, "velocity"), entry + ".velocity", 3);
    object.margin = json::number(json::member(told, entry, "margin"), entry + ".margin");
    object.holds_only_tool = json::member(told, entry, "holds_only_tool").get<bool>();
    object.attached = told.value("attached", false);  // none in sessions of before there was that, as the next
    object.may_be_touched_by = told.value("may_be_touched_by", std::vector<std::string>());
    object.color = json::member(told, entry, "color").get<std::string>();
  }
  return cell;
}

}  // namespace steadyhand
