#include "steadyhand/arms/mujoco/mujoco_arm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "steadyhand/arms/driver/arm_kinds.hpp"
#include "steadyhand/arms/mujoco/scene_model.hpp"

namespace steadyhand {

namespace {

constexpr double kLongestStep = 0.001;  // s, of the simulation: a grasp is stiff
/// How fast an arm that lags behind its command catches up, as a share of its speed limit.
constexpr double kCatchUp = 0.25;
/// Closing time of a gripper if the robot's file does not give it.
constexpr double kClosesIn = 0.6;  // s
constexpr Time kShowPeriod = std::chrono::milliseconds(10);

}  // namespace

/// What MuJoCo simulates with. Allocated once.
struct MujocoArm::Simulation {
  std::unique_ptr<SceneModel> scene;
  std::unique_ptr<mjData, void (*)(mjData*)> data;
  int steps = 1;                                 ///< a cycle
  JointVector stiffness, damping, effort, most;  ///< Nm/rad, Nms/rad, Nm, and Nm against an error
  std::vector<double> acceleration, inertial;    ///< nv
  PerTool<double> closes_in{}, gripper_wish{};   ///< s; where the gripper is to be by now, 0 to 1
  bool touches_forbidden = false;

  Simulation(std::unique_ptr<SceneModel> made, const ChainDynamics& dynamics, const MujocoSettings& settings)
      : scene(std::move(made)),
        data(mujoco().mj_makeData(scene->model.get()), mujoco().mj_deleteData),
        effort(dynamics.effort_max) {
    const mjModel* m = scene->model.get();
    steps = static_cast<int>(std::ceil(1.0 / (settings.rate_hz * kLongestStep) - 1e-9));
    acceleration.resize(m->nv);
    inertial.resize(m->nv);
    const int n = static_cast<int>(effort.size());
    damping.resize(n);
    for (int k = 0; k < n; ++k) damping[k] = -m->actuator_biasprm[scene->actuator[k] * mjNBIAS + 2];
    stiffness = effort / kErrorAtFullTorque;
    most = (settings.contact == ContactPolicy::kYield ? settings.yield : 1.0) * effort;
  }
};

Result<std::unique_ptr<MujocoArm>> MujocoArm::make(const RobotModel& model, const ChainDynamics& dynamics,
                                                   const Cell& cell, const Task& task, const MujocoSettings& settings,
                                                   Clock& clock) {
  const double period = 1.0 / settings.rate_hz;
  Result<SceneModel> scene =
      make_scene_model(model, dynamics, cell, task, period / std::ceil(period / kLongestStep - 1e-9));
  if (!scene) return scene.error();
  std::unique_ptr<MujocoArm> arm(
      new MujocoArm(model, std::make_unique<SceneModel>(*std::move(scene)), dynamics, task, settings, clock));
  if (Status s = arm->set_up(settings.seed); !s) return s.error();
  arm->place_things();
  return arm;
}

MujocoArm::MujocoArm(const RobotModel& model, std::unique_ptr<SceneModel> scene, const ChainDynamics& dynamics,
                     const Task& task, const MujocoSettings& settings, Clock& clock)
    : ClockedArm(model, model.home,
                 {model.name + " (MuJoCo)",
                  model.dof(),
                  settings.rate_hz,
                  settings.latency,
                  kMujoco.hardware,
                  {scene->gripper[0].actuator >= 0, scene->gripper[1].actuator >= 0}},
                 {.command_timeout = settings.command_timeout, .start_time = settings.start_time}, clock),
      task_(task),
      settings_(settings),
      simulation_(std::make_unique<Simulation>(std::move(scene), dynamics, settings)),
      held_{{now_, now_}, q_, dq_, dq_} {
  for (int i = 0; i < model.tool_count(); ++i)
    simulation_->closes_in[i] = model.tools[i].gripper_time.value_or(kClosesIn);
  for (int k = 0; k < model.dof(); ++k) simulation_->data->qpos[simulation_->scene->position[k]] = q_[k];
  mujoco().mj_forward(simulation_->scene->model.get(), simulation_->data.get());
}

MujocoArm::~MujocoArm() = default;

Status MujocoArm::set_up(std::uint64_t seed) {
  Result<std::vector<Pose>> drawn = draw_places(task_, seed);
  if (!drawn) return drawn.error();
  Places places;
  places.count = static_cast<int>(drawn->size());
  std::copy(drawn->begin(), drawn->end(), places.at.begin());
  asked_.write(places);
  return Done{};
}

void MujocoArm::advance(Time end) {
  place_things();
  const double dt = to_seconds(period_);
  if (interface_.moves()) {
    held_ = interface_.at(end - from_seconds(settings_.latency));
    led_ = true;
  } else {  // brakes, from where it is: what held it off its commands is not pressed on
    if (std::exchange(led_, false)) held_ = {{now_, now_}, q_, dq_, 0.0 * q_};
    const JointVector change = (dt * model_->acceleration_max).cwiseMin(held_.dq.cwiseAbs());
    held_.ddq = -held_.dq.cwiseSign().cwiseProduct(change) / dt;
    held_.dq += dt * held_.ddq;
    held_.q += dt * held_.dq;
  }
  JointCommand set_point = held_;
  for (int i = 1; i <= simulation_->steps; ++i) {  // held_ is for the cycle's end
    const double before = dt * (simulation_->steps - i) / simulation_->steps;
    set_point.q = held_.q - before * held_.dq;
    step(set_point);
  }
  if ((cycle_ + 1) % static_cast<std::uint64_t>(std::max<Time::rep>(1, kShowPeriod / period_)) == 0) show(end);
  if (shows_views_) show_view(end);
}

void MujocoArm::step(const JointCommand& set_point) {
  Simulation& s = *simulation_;
  mjModel* m = s.scene->model.get();
  mjData* d = s.data.get();
  mujoco().mj_step1(m, d);
  const int n = model_->dof();
  for (int k = 0; k < n; ++k) s.acceleration[s.scene->velocity[k]] = set_point.ddq[k];
  mujoco().mj_mulM(m, d, s.inertial.data(), s.acceleration.data());
  for (int k = 0; k < n; ++k) {
    const int at = s.scene->velocity[k], servo = s.scene->actuator[k];
    const double catch_up = s.damping[k] * kCatchUp * model_->velocity_max[k];
    const double error = s.stiffness[k] * (set_point.q[k] - d->qpos[s.scene->position[k]]);
    const double motion = std::clamp(s.inertial[at] + d->qfrc_bias[at], -s.effort[k], s.effort[k]);
    d->ctrl[servo] = motion + std::clamp(error, -catch_up, catch_up) + s.damping[k] * set_point.dq[k];
    m->actuator_forcerange[2 * servo] = std::max(-s.effort[k], motion - s.most[k]);
    m->actuator_forcerange[2 * servo + 1] = std::min(s.effort[k], motion + s.most[k]);
  }
  for (int i = 0; i < kMaxTools; ++i) {
    if (!gripper_[i]) continue;
    const double most = m->opt.timestep / s.closes_in[i];
    s.gripper_wish[i] += std::clamp(*gripper_command_[i] - s.gripper_wish[i], -most, most);
    d->ctrl[s.scene->gripper[i].actuator] = s.scene->gripper[i].closed * s.gripper_wish[i];
  }
  mujoco().mj_step2(m, d);
  for (int i = 0; i < kMaxTools; ++i) {
    const auto& [actuator, closed] = s.scene->gripper[i];
    if (gripper_[i]) gripper_[i] = std::clamp(d->actuator_length[actuator] / closed, 0.0, 1.0);
  }
  const bool touched = std::exchange(s.touches_forbidden, touches_forbidden());
  state_.forbidden += !touched && s.touches_forbidden;
  for (int k = 0; k < n; ++k) {
    q_[k] = d->qpos[s.scene->position[k]];
    dq_[k] = d->qvel[s.scene->velocity[k]];
  }
  if (d->warning[mjWARN_BADQPOS].number + d->warning[mjWARN_BADQVEL].number + d->warning[mjWARN_BADQACC].number > 0) {
    interface_.stop("the simulation diverged");
  }
}

bool MujocoArm::touches_forbidden() const {
  const SceneModel& scene = *simulation_->scene;
  const mjData* d = simulation_->data.get();
  const auto forbids = [](const SceneModel::GeomRole& one, const SceneModel::GeomRole& other) {
    return one.kept_off >= 0 && (other.not_touch >> one.kept_off & 1u) != 0;
  };
  for (int c = 0; c < d->ncon; ++c) {
    const mjContact& contact = d->contact[c];
    if (contact.exclude != 0 || contact.geom[0] < 0 || contact.geom[1] < 0) continue;
    const SceneModel::GeomRole &one = scene.roles[contact.geom[0]], &other = scene.roles[contact.geom[1]];
    if (forbids(one, other) || forbids(other, one)) return true;
  }
  return false;
}

/// Places things at the poses that set_up() asked for.
void MujocoArm::place_things() {
  Places places;
  if (!asked_.read(places)) return;
  const mjModel* m = simulation_->scene->model.get();
  mjData* d = simulation_->data.get();
  const auto put = [](const Pose& pose, double* p, double* q) {
    Eigen::Map<Vector3>{p} = pose.p;
    q[0] = pose.q.w();
    Eigen::Map<Vector3>{q + 1} = pose.q.vec();
  };
  for (int i = 0; i < places.count; ++i) {
    const int body = simulation_->scene->things[task_.placings[i].thing].body;
    if (const int mocap = m->body_mocapid[body]; mocap >= 0) {
      put(places.at[i], d->mocap_pos + 3 * mocap, d->mocap_quat + 4 * mocap);
    } else {
      double* at = d->qpos + m->jnt_qposadr[m->body_jntadr[body]];
      put(places.at[i], at, at + 3);
      std::fill_n(d->qvel + m->body_dofadr[body], 6, 0.0);
    }
  }
  mujoco().mj_forward(m, d);
  ++state_.reset;
  state_.forbidden = 0;
  show(now_);
}

void MujocoArm::show(Time now) {
  const Simulation& s = *simulation_;
  const mjModel* m = s.scene->model.get();
  const mjData* d = s.data.get();
  state_.at = now;
  state_.things = static_cast<int>(s.scene->things.size());
  for (int i = 0; i < state_.things; ++i) {
    const SceneModel::Thing& thing = s.scene->things[i];
    const bool is_site = thing.site >= 0;
    const int id = is_site ? thing.site : thing.body;
    ThingState& shown = state_.thing[i];
    shown.X_base_thing.p = Eigen::Map<const Vector3>((is_site ? d->site_xpos : d->xpos) + 3 * id);
    const double* R = (is_site ? d->site_xmat : d->xmat) + 9 * id;
    shown.X_base_thing.q = Quaternion(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R));
    double velocity[6];
    mujoco().mj_objectVelocity(m, d, is_site ? mjOBJ_SITE : mjOBJ_BODY, id, velocity, 0);
    shown.turning = Eigen::Map<const Vector3>(velocity);
    shown.velocity = Eigen::Map<const Vector3>(velocity + 3);
    shown.touches = 0;
  }
  std::array<std::uint32_t, 2 * kMaxTools> on_finger{};  // things that each finger touches
  for (int c = 0; c < d->ncon; ++c) {
    const mjContact& contact = d->contact[c];
    if (contact.exclude != 0 || contact.geom[0] < 0 || contact.geom[1] < 0) continue;
    const SceneModel::GeomRole &one = s.scene->roles[contact.geom[0]], &other = s.scene->roles[contact.geom[1]];
    for (int i = 0; i < state_.things; ++i) {
      if ((one.things >> i & 1u) != 0) state_.thing[i].touches |= other.things;
      if ((other.things >> i & 1u) != 0) state_.thing[i].touches |= one.things;
    }
    if (one.finger >= 0) on_finger[one.finger] |= other.things;
    if (other.finger >= 0) on_finger[other.finger] |= one.things;
  }
  for (int i = 0; i < state_.things; ++i) {
    ThingState& shown = state_.thing[i];
    const auto grasps = [&](int tool) { return ((on_finger[2 * tool] & on_finger[2 * tool + 1]) >> i & 1u) != 0; };
    // The gripper that grasped it first has it until it releases it.
    if (!grasps(shown.grasped_by)) shown.grasped_by = grasps(1) ? 1 : 0;
    shown.grasped = grasps(shown.grasped_by);
  }
  shown_.write(state_);
}

const SceneModel& MujocoArm::scene_model() const { return *simulation_->scene; }

Status MujocoArm::show_views() {
  const mjModel* m = simulation_->scene->model.get();
  if (const int numbers = m->nq + 7 * m->nmocap; numbers > SceneView::kMaxNumbers) {
    return Error{fmt::format("{} has {} numbers for the poses of its things; cameras allow at most {}",
                             task_.scene.empty() ? "the arm" : task_.scene, numbers, SceneView::kMaxNumbers)};
  }
  shows_views_ = true;
  return Done{};
}

void MujocoArm::show_view(Time now) {
  const mjModel* m = simulation_->scene->model.get();
  const mjData* d = simulation_->data.get();
  view_.at = now;
  double* at = std::copy_n(d->qpos, m->nq, view_.numbers.data());
  at = std::copy_n(d->mocap_pos, 3 * m->nmocap, at);
  std::copy_n(d->mocap_quat, 4 * m->nmocap, at);
  views_.write(view_);
}

double MujocoArm::contact_force() const {
  const mjModel* m = simulation_->scene->model.get();
  double sum = 0.0;
  for (int c = 0; c < simulation_->data->ncon; ++c) {
    const mjContact& contact = simulation_->data->contact[c];
    if (contact.geom[0] < 0 || contact.geom[1] < 0) continue;
    if (((m->geom_contype[contact.geom[0]] | m->geom_contype[contact.geom[1]]) & kArmBit) == 0) continue;
    double force[6];
    mujoco().mj_contactForce(m, simulation_->data.get(), c, force);
    sum += force[0];
  }
  return sum;
}

}  // namespace steadyhand
