#pragma once

#include "steadyhand/files/record/json_reader.hpp"
#include "steadyhand/geometry/collision/shape.hpp"

namespace steadyhand {

template <typename Vector>
OrderedJson numbers_json(const Vector& vector) {
  OrderedJson values = OrderedJson::array();
  for (const double value : vector) values.push_back(value);
  return values;
}

/// Four rows of four numbers.
OrderedJson rows_json(const Eigen::Isometry3d& T);

/// The pose again. Throws json::Wrong, also for what is none.
/// @param key of the rows, for messages
Eigen::Isometry3d read_rows_json(const OrderedJson& json, const std::string& key);

/// "shape", "origin" and the shape's sizes, as docs/formulation.md has them for bodies.
OrderedJson shape_json(const Shape& shape, const Eigen::Isometry3d& origin);

/// The origin, and the shape, as shape_json() writes them, of an object that may have more keys. Throws json::Wrong.
/// @param key of the object, for messages
Eigen::Isometry3d read_shape_json(const OrderedJson& object, const std::string& key, Shape& shape);

}  // namespace steadyhand
