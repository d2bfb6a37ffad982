#include "steadyhand/record/cell_json.hpp"

#include "steadyhand/record/shape_json.hpp"

namespace steadyhand {

std::string cell_json(const Cell& cell) {
  OrderedJson objects = OrderedJson::array();
  for (const CellObject& object : cell.objects) {
    OrderedJson json = {{"name", object.name}};
    json.update(shape_json(object.shape, object.origin));
    json["velocity"] = numbers_json(object.velocity);
    json["margin"] = object.margin;
    json["color"] = object.color;
    json["holds_only_tool"] = object.holds_only_tool;
    objects.push_back(std::move(json));
  }
  return OrderedJson{{"name", cell.name}, {"objects", objects}}.dump(-1, ' ', false,
                                                                     OrderedJson::error_handler_t::replace);
}

}  // namespace steadyhand
