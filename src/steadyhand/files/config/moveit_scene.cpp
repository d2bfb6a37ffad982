#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "steadyhand/files/config/cell_formats.hpp"

namespace steadyhand {

namespace {

constexpr int kMostShapes = 1000;

/// The lines of a scene, one after another; the first thing that is wrong stays.
class SceneReader {
 public:
  explicit SceneReader(const std::filesystem::path& file) : name_(file.string()), in_(file) {
    if (!in_) fail("cannot be read");
  }

  /// The next line that is not empty, without spaces around it.
  std::string line(const char* what) {
    while (!error_ && std::getline(in_, text_)) {
      ++number_;
      const auto begin = text_.find_first_not_of(" \t\r"), end = text_.find_last_not_of(" \t\r");
      if (begin != std::string::npos) return text_ = text_.substr(begin, end - begin + 1);
    }
    fail(fmt::format("the file ends where {} should be", what));
    return {};
  }
  std::vector<double> numbers(const char* what, std::size_t count) {
    std::istringstream words(line(what));
    std::vector<double> result;
    for (std::string word; words >> word;) {
      const Result<double> number = parse_number(word);
      if (!number) fail(fmt::format("{}: '{}' {}", what, word, number.error().message));
      result.push_back(number ? *number : 0.0);
    }
    if (result.size() != count) fail(fmt::format("{} are {} numbers; here are {}", what, count, result.size()));
    result.resize(count);
    return result;
  }
  int count(const char* what) {
    const double number = numbers(what, 1)[0];
    if (!(number >= 0.0 && number <= kMostShapes) || number != std::floor(number)) {
      fail(fmt::format("{} is {}; it must be a whole number from 0 to {}", what, number, kMostShapes));
      return 0;
    }
    return static_cast<int>(number);
  }
  /// A line of the position, and one of the quaternion x, y, z, w.
  Eigen::Isometry3d pose(const char* what) {
    const std::vector<double> p = numbers(what, 3), xyzw = numbers("the quaternion x, y, z, w", 4);
    const Quaternion q(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
    if (std::abs(q.norm() - 1.0) > kQuaternionTolerance) {
      fail(fmt::format("the quaternion x, y, z, w is of norm {:.6g}; it must be 1", q.norm()));
      return Eigen::Isometry3d::Identity();
    }
    return Eigen::Translation3d(p[0], p[1], p[2]) * q.normalized();
  }
  void fail(const std::string& reason) {
    if (error_) return;
    error_ =
        Error{number_ > 0 ? fmt::format("{}:{}: {}", name_, number_, reason) : fmt::format("{}: {}", name_, reason)};
  }
  const std::optional<Error>& error() const { return error_; }

  /// As in MoveIt: objects have poses if the line after the first one's name has several words.
  bool objects_have_poses() {
    const auto here = in_.tellg();
    const int number = number_;
    while (!error_ && line("'*', an object, or '.', the end") != "." && text_[0] != '*') {
    }
    const bool have =
        !error_ && text_[0] == '*' && line("the object's pose or number of shapes").find(' ') != std::string::npos;
    in_.clear();
    in_.seekg(here);
    number_ = number;
    return have;
  }

 private:
  std::string name_, text_;
  std::ifstream in_;
  int number_ = 0;
  std::optional<Error> error_;
};

/// A cone is taken for the cylinder around it.
Shape read_shape(SceneReader& scene) {
  const std::string kind = scene.line("a shape");
  if (kind == "box") {
    const std::vector<double> size = scene.numbers("the box's sizes", 3);
    return Shape::box(0.5 * Vector3(size[0], size[1], size[2]));
  }
  if (kind == "sphere") return Shape::sphere(scene.numbers("the sphere's radius", 1)[0]);
  if (kind == "cylinder" || kind == "cone") {
    const std::vector<double> size = scene.numbers("radius and length", 2);
    return Shape::cylinder(size[0], 0.5 * size[1]);
  }
  scene.fail(fmt::format("shape '{}' is not read; box, sphere, cylinder and cone are", kind));
  return Shape::sphere(1.0);
}

void read_object(SceneReader& scene, const std::string& name, bool has_pose, Cell& cell) {
  const Eigen::Isometry3d X_base_object =
      has_pose ? scene.pose("the object's position") : Eigen::Isometry3d::Identity();
  const int shapes = scene.count("the number of shapes");
  for (int i = 0; i < shapes && !scene.error(); ++i) {
    CellObject object;
    object.name = name;
    object.shape = read_shape(scene);
    object.origin = X_base_object * scene.pose("the shape's position");
    const std::vector<double> rgba = scene.numbers("red, green, blue and opacity", 4);
    if (rgba != std::vector<double>(4, 0.0)) object.color = hex_color(rgba);  // all 0: none
    cell.objects.push_back(object);
  }
  if (!has_pose) return;
  const int frames = scene.count("the number of subframes");
  for (int i = 0; i < frames && !scene.error(); ++i) {
    (void)scene.line("a subframe's name");
    (void)scene.pose("the subframe's position");
  }
}

}  // namespace

Result<Cell> load_moveit_scene(const std::filesystem::path& file) {
  SceneReader scene(file);
  Cell cell;
  cell.name = scene.line("the scene's name");
  const bool objects_have_poses = scene.objects_have_poses();
  while (!scene.error()) {
    const std::string line = scene.line("'*', an object, or '.', the end");
    if (scene.error() || line == ".") break;
    const auto name = line.find_first_not_of(" \t", 1);
    if (line[0] != '*' || name == std::string::npos) {
      scene.fail(fmt::format("'{}' is not valid; expected '* NAME' (an object) or '.' (the end)", line));
      break;
    }
    read_object(scene, line.substr(name), objects_have_poses, cell);
  }
  if (scene.error()) return *scene.error();
  return cell;
}

}  // namespace steadyhand
