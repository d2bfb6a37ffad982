#include "steadyhand/arms/mujoco/scene_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace steadyhand {

namespace {

/// URDFs do not tell what the rotors add behind their gears: this share of a joint's largest torque, kg m^2 for Nm;
/// that of a UR5e's shoulder then is 0.1 kg m^2.
constexpr double kRotor = 0.1 / 150.0;
/// How far a joint may be pressed beyond its limit, rad (m), until a hard stop.
constexpr double kStopMargin = 0.02;

struct FreeSpec {
  void operator()(mjSpec* spec) const { mujoco().mj_deleteSpec(spec); }
};
using Spec = std::unique_ptr<mjSpec, FreeSpec>;

Error failure(const std::filesystem::path& file, const char* reason) {
  std::string line(reason);
  std::replace(line.begin(), line.end(), '\n', ' ');
  return Error{fmt::format("{}: MuJoCo reports: {}", file.string(), line)};
}

Result<Spec> parse(const std::filesystem::path& file) {
  std::array<char, 1000> error{};
  std::error_code code;
  if (!std::filesystem::is_regular_file(file, code)) return Error{fmt::format("{}: no such file", file.string())};
  Spec spec(mujoco().mj_parseXML(file.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
  if (!spec) return failure(file, error.data());
  return spec;
}

template <typename Placed>
void place(Placed& placed, const Eigen::Isometry3d& X) {
  const Quaternion q(X.linear());
  Eigen::Map<Vector3>(placed.pos) = X.translation();
  placed.quat[0] = q.w();
  Eigen::Map<Vector3>(placed.quat + 1) = q.vec();
}

void add_geom(mjsBody* body, const std::string& name, const Shape& shape, const Eigen::Isometry3d& X, int bit) {
  mjsGeom* geom = mujoco().mjs_addGeom(body, nullptr);
  mujoco().mjs_setName(geom->element, name.c_str());
  place(*geom, X);
  geom->contype = bit;
  geom->conaffinity = kSceneBit;
  geom->mass = 0.0;  // a URDF says it of links
  const Vector3 box = shape.core + Vector3::Constant(shape.radius);
  switch (shape.kind) {
    case ShapeKind::kSphere:
      geom->type = mjGEOM_SPHERE;
      geom->size[0] = shape.radius;
      return;
    case ShapeKind::kCapsule:
      geom->type = mjGEOM_CAPSULE;
      geom->size[0] = shape.radius;
      geom->size[1] = shape.core.z();
      return;
    case ShapeKind::kBox:
      geom->type = mjGEOM_BOX;
      std::copy(box.data(), box.data() + 3, geom->size);
      return;
    case ShapeKind::kCylinder:
      geom->type = mjGEOM_CYLINDER;
      geom->size[0] = box.x();
      geom->size[1] = box.z();
      return;
    case ShapeKind::kHalfSpace:
      geom->type = mjGEOM_PLANE;
      geom->size[2] = 1.0;
      return;
  }
}

void set_inertia(mjsBody& body, const Inertia& inertia) {
  body.mass = inertia.mass;
  Eigen::Map<Vector3>(body.ipos) = inertia.center;
  const Matrix3& I = inertia.about;
  const double full[] = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
  std::copy(std::begin(full), std::end(full), body.fullinertia);
  body.explicitinertial = 1;
}

void add_joint(mjSpec& spec, mjsBody& body, const RobotModel& arm, int k, double effort) {
  mjsJoint* joint = mujoco().mjs_addJoint(&body, nullptr);
  const std::string name = "arm/" + arm.joints[k].name;
  mujoco().mjs_setName(joint->element, name.c_str());
  joint->type = arm.joints[k].type == JointType::kRevolute ? mjJNT_HINGE : mjJNT_SLIDE;
  Eigen::Map<Vector3>(joint->axis) = arm.joints[k].axis;
  joint->limited = mjLIMITED_TRUE;
  const double unit = joint->type == mjJNT_HINGE && spec.compiler.degree ? 180.0 / M_PI : 1.0;  // as the file has it
  joint->range[0] = unit * (arm.position_min[k] - kStopMargin);
  joint->range[1] = unit * (arm.position_max[k] + kStopMargin);
  joint->armature = kRotor * effort;

  mjsActuator* servo = mujoco().mjs_addActuator(&spec, nullptr);
  mujoco().mjs_setName(servo->element, name.c_str());
  servo->trntype = mjTRN_JOINT;
  mujoco().mjs_setString(servo->target, name.c_str());
  servo->gaintype = mjGAIN_FIXED;
  servo->gainprm[0] = 1.0;
  servo->biastype = mjBIAS_AFFINE;  // damping: see add_damping
  servo->forcelimited = mjLIMITED_TRUE;
  servo->forcerange[0] = -effort;
  servo->forcerange[1] = effort;
}

/// The tree of joints. Returns the bodies of the links, 0 to n.
std::vector<mjsBody*> add_arm(mjSpec& spec, const RobotModel& arm, const ChainDynamics& dynamics,
                              const std::vector<std::string>& without) {
  mjsBody* at = mujoco().mjs_addBody(mujoco().mjs_findBody(&spec, "world"), nullptr);
  mujoco().mjs_setName(at->element, "arm/base");
  std::vector<mjsBody*> links = {at};
  for (int k = 0; k < arm.dof(); ++k) {
    at = mujoco().mjs_addBody(links[arm.parent(k)], nullptr);
    mujoco().mjs_setName(at->element, fmt::format("arm/link_{}", k + 1).c_str());
    place(*at, arm.joints[k].origin);
    set_inertia(*at, dynamics.links[k + 1]);
    add_joint(spec, *at, arm, k, dynamics.effort_max[k]);
    links.push_back(at);
  }
  for (const Body& body : arm.bodies) {
    if (std::find(without.begin(), without.end(), body.name) != without.end()) continue;
    add_geom(links[body.link], "arm/" + body.name, body.shape, body.origin, kArmBit);
  }
  return links;
}

/// What names of a tool's file begin with in the scene.
std::string prefix_of(const RobotModel& arm, int tool) {
  return arm.tool_count() > 1 ? arm.tools[tool].name + "/" : "";
}

/// The body `tool` of a file at the tool's place, or an empty one.
Status add_tool(mjsBody& link, const Tool& at, const std::string& prefix, const std::filesystem::path& file,
                const mjSpec* read) {
  if (read == nullptr) {
    mjsBody* tool = mujoco().mjs_addBody(&link, nullptr);
    mujoco().mjs_setName(tool->element, (prefix + "tool").c_str());
    place(*tool, at.origin);
    return Done{};
  }
  mjsBody* tool = mujoco().mjs_findBody(read, "tool");
  if (tool == nullptr) return Error{fmt::format("{}: has no body named 'tool'", file.string())};
  mjsFrame* frame = mujoco().mjs_addFrame(&link, nullptr);
  place(*frame, at.origin);
  mjsElement* attached = mujoco().mjs_attach(frame->element, tool->element, prefix.c_str(), "");
  if (attached == nullptr) return failure(file, mujoco().mjs_getError(mujoco().mjs_getSpec(link.element)));
  return Done{};
}

/// Critical damping of each servo at home, and what its motion needs of it.
void add_damping(const RobotModel& arm, const ChainDynamics& dynamics, SceneModel& scene) {
  mjModel* model = scene.model.get();
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mujoco().mj_makeData(model), mujoco().mj_deleteData);
  for (int k = 0; k < arm.dof(); ++k) data->qpos[scene.position[k]] = arm.home[k];
  mujoco().mj_forward(model, data.get());
  std::vector<double> one(model->nv), column(model->nv);
  for (int k = 0; k < arm.dof(); ++k) {
    std::fill(one.begin(), one.end(), 0.0);
    one[scene.velocity[k]] = 1.0;
    mujoco().mj_mulM(model, data.get(), column.data(), one.data());
    const double stiffness = dynamics.effort_max[k] / kErrorAtFullTorque;
    const double damping = 2.0 * std::sqrt(stiffness * column[scene.velocity[k]]);
    model->actuator_biasprm[scene.actuator[k] * mjNBIAS + 2] = -damping;
  }
}

Status find_things(const Task& task, SceneModel& scene) {
  const mjModel* model = scene.model.get();
  for (const std::string& name : task.things) {
    SceneModel::Thing thing;
    thing.site = mujoco().mj_name2id(model, mjOBJ_SITE, name.c_str());
    thing.body =
        thing.site >= 0 ? model->site_bodyid[thing.site] : mujoco().mj_name2id(model, mjOBJ_BODY, name.c_str());
    if (thing.body < 0) {
      return Error{
          fmt::format("task '{}' names '{}'; {} has no site and no body of that name", task.name, name, task.scene)};
    }
    scene.things.push_back(thing);
  }
  for (const Placing& placing : task.placings) {
    const SceneModel::Thing& thing = scene.things[placing.thing];
    const bool is_free =
        model->body_jntnum[thing.body] == 1 && model->jnt_type[model->body_jntadr[thing.body]] == mjJNT_FREE;
    if (thing.site >= 0 || (!is_free && model->body_mocapid[thing.body] < 0)) {
      return Error{
          fmt::format("task '{}' places '{}', which in {} is no body with a free joint, and none with "
                      "mocap=\"true\"",
                      task.name, task.things[placing.thing], task.scene)};
    }
  }
  return Done{};
}

/// The frame of each tool, and its gripper, if it is one.
void find_tools(const RobotModel& arm, SceneModel& scene) {
  const mjModel* model = scene.model.get();
  for (int i = 0; i < arm.tool_count(); ++i) {
    scene.tool[i] = mujoco().mj_name2id(model, mjOBJ_BODY, (prefix_of(arm, i) + "tool").c_str());
    auto& [actuator, closed] = scene.gripper[i];
    actuator = mujoco().mj_name2id(model, mjOBJ_ACTUATOR, (prefix_of(arm, i) + kGripper).c_str());
    if (actuator >= 0) closed = model->actuator_ctrlrange[2 * actuator + 1];
  }
}

/// Whether this geom of the arm may touch the kept-off object: its body or link is named, or a body that the tool's
/// geometry replaces.
bool may_touch(const KeptOff& kept, const RobotModel& arm, const Task& task, const mjModel& model, int geom) {
  const auto named = [&](const std::string& name) {
    return std::count(kept.may_be_touched_by.begin(), kept.may_be_touched_by.end(), name) > 0;
  };
  const std::string name = model.names + model.name_geomadr[geom];
  for (const Body& body : arm.bodies) {
    if (name == "arm/" + body.name) return named(body.name) || named(arm.link_names[body.link]);
  }
  const auto carries = [&](const Tool& tool) { return named(arm.link_names[tool.link]); };
  return std::any_of(task.stands_for.begin(), task.stands_for.end(), named) ||
         std::any_of(arm.tools.begin(), arm.tools.end(), carries);
}

void find_roles(const RobotModel& arm, const Task& task, SceneModel& scene) {
  const mjModel* model = scene.model.get();
  for (int geom = 0; geom < model->ngeom; ++geom) {
    SceneModel::GeomRole& role = scene.roles.emplace_back();
    const int of = model->geom_bodyid[geom];
    for (std::size_t i = 0; i < scene.things.size(); ++i) {
      const SceneModel::Thing& thing = scene.things[i];
      if (thing.site < 0 && model->body_weldid[thing.body] == model->body_weldid[of] &&
          (model->body_weldid[thing.body] != 0 || thing.body == of)) {
        role.things |= 1u << i;
      }
    }
    for (int finger = 0; finger < 2 * arm.tool_count(); ++finger) {
      const std::string name = prefix_of(arm, finger / 2) + kFingers[finger % 2];
      if (of == mujoco().mj_name2id(model, mjOBJ_BODY, name.c_str())) role.finger = finger;
    }
    for (std::size_t k = 0; k < task.keeps_off.size(); ++k) {
      if (geom == mujoco().mj_name2id(model, mjOBJ_GEOM, task.keeps_off[k].geom.c_str()))
        role.kept_off = static_cast<int>(k);
      const bool is_arm = (model->geom_contype[geom] & kArmBit) != 0;
      if (is_arm && !may_touch(task.keeps_off[k], arm, task, *model, geom)) role.not_touch |= std::uint64_t{1} << k;
    }
  }
}

}  // namespace

Result<SceneModel> make_scene_model(const RobotModel& arm, const ChainDynamics& dynamics, const Cell& cell,
                                    const Task& task, double step) {
  if (Status s = load_mujoco(); !s) return s.error();
  Result<Spec> read = task.scene.empty() ? Result<Spec>(Spec(mujoco().mj_makeSpec())) : parse(task.scene);
  if (!read) return read.error();
  PerTool<Spec> tools;  // attaching one takes its spec
  for (int i = 0; i < arm.tool_count() && !task.tool.empty(); ++i) {
    Result<Spec> read_tool = parse(task.tool);
    if (!read_tool) return read_tool.error();
    tools[i] = *std::move(read_tool);
  }
  mjSpec& spec = **read;
  for (const std::string& name : task.stands_for) {
    const bool known = std::any_of(arm.bodies.begin(), arm.bodies.end(), [&](const Body& b) { return b.name == name; });
    if (!known)
      return Error{
          fmt::format("task '{}' uses body '{}' of {} as tool, which has no such body", task.name, name, arm.name)};
  }
  const auto of_scene = [&](const std::string& name) {
    const auto is_placed = [&](const Placing& placing) {
      const std::string& thing = task.things[placing.thing];
      return name == thing || name.starts_with(thing + " ");
    };
    return std::any_of(task.keeps_off.begin(), task.keeps_off.end(),
                       [&](const KeptOff& k) { return k.geom == name; }) ||
           std::any_of(task.placings.begin(), task.placings.end(), is_placed);
  };
  for (const CellObject& object : in_base(cell, arm).objects) {
    if (!object.attached && !of_scene(object.name)) {
      add_geom(mujoco().mjs_findBody(&spec, "world"), "cell/" + object.name, object.shape, object.origin, kSceneBit);
    }
  }
  const std::vector<mjsBody*> links = add_arm(spec, arm, dynamics, task.stands_for);
  for (int i = 0; i < arm.tool_count(); ++i) {
    const Tool& tool = arm.tools[i];
    if (Status s = add_tool(*links[tool.link], tool, prefix_of(arm, i), task.tool, tools[i].get()); !s)
      return s.error();
  }
  spec.option.timestep = step;
  spec.option.integrator = mjINT_IMPLICITFAST;  // servos' damping is stiff
  spec.option.disableflags |= mjDSBL_AUTORESET;
  spec.option.gravity[2] = -kGravity.z();

  SceneModel scene;
  scene.model.reset(mujoco().mj_compile(&spec, nullptr));
  if (!scene.model)
    return failure(task.scene.empty() ? std::string("the arm") : task.scene, mujoco().mjs_getError(&spec));
  const mjModel* model = scene.model.get();
  for (const Joint& joint : arm.joints) {
    const std::string name = "arm/" + joint.name;
    const int id = mujoco().mj_name2id(model, mjOBJ_JOINT, name.c_str());
    scene.position.push_back(model->jnt_qposadr[id]);
    scene.velocity.push_back(model->jnt_dofadr[id]);
    scene.actuator.push_back(mujoco().mj_name2id(model, mjOBJ_ACTUATOR, name.c_str()));
  }
  add_damping(arm, dynamics, scene);
  if (Status s = find_things(task, scene); !s) return s.error();
  find_tools(arm, scene);
  find_roles(arm, task, scene);
  return scene;
}

namespace {

/// A task's scene without an arm.
struct BareScene {
  std::unique_ptr<mjModel, SceneModel::FreeModel> model;
  std::unique_ptr<mjData, void (*)(mjData*)> data{nullptr, mujoco().mj_deleteData};
};

Result<BareScene> bare_scene(const Task& task) {
  if (Status s = load_mujoco(); !s) return s.error();
  Result<Spec> spec = parse(task.scene);
  if (!spec) return spec.error();
  BareScene scene;
  scene.model.reset(mujoco().mj_compile(spec->get(), nullptr));
  if (!scene.model) return failure(task.scene, mujoco().mjs_getError(spec->get()));
  scene.data.reset(mujoco().mj_makeData(scene.model.get()));
  mujoco().mj_kinematics(scene.model.get(), scene.data.get());
  return scene;
}

/// A geom as an object of a cell, at `X`. None: it is of another kind.
std::optional<CellObject> solid(const mjModel& model, int geom, const Eigen::Isometry3d& X) {
  CellObject object;
  object.origin = X;
  const double* size = model.geom_size + 3 * geom;
  switch (model.geom_type[geom]) {
    case mjGEOM_PLANE:
      object.shape = Shape::half_space();
      break;
    case mjGEOM_SPHERE:
      object.shape = Shape::sphere(size[0]);
      break;
    case mjGEOM_CAPSULE:
      object.shape = Shape::capsule(size[1], size[0]);
      break;
    case mjGEOM_CYLINDER:
      object.shape = Shape::cylinder(size[0], size[1]);
      break;
    case mjGEOM_BOX:
      object.shape = Shape::box({size[0], size[1], size[2]});
      break;
    default:
      return std::nullopt;
  }
  const float* rgba = model.geom_rgba + 4 * geom;
  const auto byte = [&](int i) { return static_cast<int>(std::lround(255.0F * std::clamp(rgba[i], 0.0F, 1.0F))); };
  object.color = fmt::format("#{:02x}{:02x}{:02x}", byte(0), byte(1), byte(2));
  return object;
}

Eigen::Isometry3d transform(const double* p, const double* R) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Map<const Vector3>(p);
  X.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R);
  return X;
}

constexpr const char* kKinds = "which is no plane, sphere, capsule, cylinder or box";

}  // namespace

Result<std::vector<CellObject>> kept_off(const Task& task) {
  std::vector<CellObject> objects;
  if (task.keeps_off.empty()) return objects;
  const Result<BareScene> scene = bare_scene(task);
  if (!scene) return scene.error();
  const mjModel& model = *scene->model;
  for (const KeptOff& each : task.keeps_off) {
    const auto refuse = [&](const std::string& reason) {
      return Error{fmt::format("task '{}' forbids contact with geom '{}', {}", task.name, each.geom, reason)};
    };
    const int id = mujoco().mj_name2id(&model, mjOBJ_GEOM, each.geom.c_str());
    if (id < 0) return refuse("which " + task.scene + " does not have");
    if (model.body_weldid[model.geom_bodyid[id]] != 0)
      return refuse("which moves; only stationary geoms can be obstacles");
    auto object = solid(model, id, transform(scene->data->geom_xpos + 3 * id, scene->data->geom_xmat + 9 * id));
    if (!object) return refuse(kKinds);
    object->name = each.geom;
    object->margin = each.margin;
    object->may_be_touched_by = each.may_be_touched_by;
    objects.push_back(*std::move(object));
  }
  return objects;
}

Result<std::vector<std::pair<int, CellObject>>> placed_solids(const Task& task, const RobotModel& arm) {
  std::vector<std::pair<int, CellObject>> solids;
  if (task.placings.empty()) return solids;
  const Result<BareScene> scene = bare_scene(task);
  if (!scene) return scene.error();
  const mjModel& model = *scene->model;
  for (const Placing& placing : task.placings) {
    const std::string& name = task.things[placing.thing];
    const int body = mujoco().mj_name2id(&model, mjOBJ_BODY, name.c_str());
    if (body < 0) continue;  // make_scene_model reports it
    for (int i = 0; i < model.body_geomnum[body]; ++i) {
      const int geom = model.body_geomadr[body] + i;
      double R[9];
      mujoco().mju_quat2Mat(R, model.geom_quat + 4 * geom);
      auto object = solid(model, geom, transform(model.geom_pos + 3 * geom, R));
      if (!object) {
        return Error{fmt::format("task '{}' places '{}' with a geom {}", task.name, name, kKinds)};
      }
      object->name = model.body_geomnum[body] == 1 ? name : fmt::format("{} {}", name, i + 1);
      object->margin = 0.0;
      object->may_be_touched_by.assign(arm.link_names.begin() + 1, arm.link_names.end());
      solids.emplace_back(placing.thing, *std::move(object));
    }
  }
  for (auto& one : solids) {  // while the tool carries it
    for (const auto& other : solids) {
      if (other.first != one.first) one.second.may_be_touched_by.push_back(other.second.name);
    }
  }
  return solids;
}

Status furnish(const Task& task, const std::vector<std::pair<int, CellObject>>& solids, std::uint64_t seed,
               Cell& cell) {
  const Result<std::vector<CellObject>> objects = kept_off(task);
  if (!objects) return objects.error();
  const Result<std::vector<Pose>> places = draw_places(task, seed);
  if (!places) return places.error();
  cell.objects.insert(cell.objects.end(), objects->begin(), objects->end());
  for (const auto& [thing, solid] : solids) {
    for (std::size_t i = 0; i < places->size(); ++i) {
      if (task.placings[i].thing != thing) continue;
      const Pose& at = (*places)[i];
      cell.objects.push_back(solid);
      cell.objects.back().origin = Eigen::Translation3d(at.p) * at.q * solid.origin;
    }
  }
  return Done{};
}

}  // namespace steadyhand
