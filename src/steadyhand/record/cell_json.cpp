#include "steadyhand/record/cell_json.hpp"

#include "steadyhand/record/shape_json.hpp"

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
    objects.push_back(std::move(json));
  }
  OrderedJson json = {{"name", cell.name}};
  if (at) json["at_s"] = to_seconds(*at);
  json["objects"] = std::move(objects);
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace steadyhand
