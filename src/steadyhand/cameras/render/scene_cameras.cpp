#include "steadyhand/cameras/render/scene_cameras.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "steadyhand/arms/mujoco/scene_model.hpp"
#include "steadyhand/cameras/render/offscreen_context.hpp"

namespace steadyhand {

namespace {

constexpr Time kMostPatience = std::chrono::milliseconds(100);  ///< longest wait in take()
constexpr int kMostGeoms = 2000;                                ///< drawn at most
constexpr int kShadowPixels = 1024;                             ///< a side of the shadows' map

class SceneCameras final : public PictureSource {
 public:
  SceneCameras(MujocoArm& arm, const std::vector<CameraInfo>& cameras, Clock& clock,
               std::unique_ptr<mjModel, SceneModel::FreeModel> model, std::unique_ptr<OffscreenContext> context)
      : arm_(&arm),
        cameras_(cameras),
        next_(cameras.size(), Time(0)),
        clock_(&clock),
        model_(std::move(model)),
        data_(mujoco().mj_makeData(model_.get()), mujoco().mj_deleteData),
        context_(std::move(context)) {
    mujoco().mjr_defaultContext(&drawing_);
    mujoco().mjr_makeContext(model_.get(), &drawing_, mjFONTSCALE_100);
    mujoco().mjr_setBuffer(mjFB_OFFSCREEN, &drawing_);
    mujoco().mjv_defaultScene(&scene_);
    mujoco().mjv_makeScene(model_.get(), &scene_, kMostGeoms);
    mujoco().mjv_defaultOption(&option_);
    for (const CameraInfo& camera : cameras_) {
      mjvCamera& view = views_.emplace_back();
      mujoco().mjv_defaultCamera(&view);
      view.type = mjCAMERA_FIXED;
      view.fixedcamid = mujoco().mj_name2id(model_.get(), mjOBJ_CAMERA, camera.name.c_str());
    }
    context_->release();
  }
  ~SceneCameras() override {
    (void)context_->make_current();
    mujoco().mjv_freeScene(&scene_);
    mujoco().mjr_freeContext(&drawing_);
  }

  const std::vector<CameraInfo>& cameras() const override { return cameras_; }

  Result<bool> take(Picture& picture) override {
    if (!is_current_) {
      if (Status s = context_->make_current(); !s) return s.error();
      is_current_ = true;
    }
    const auto camera = static_cast<std::size_t>(std::min_element(next_.begin(), next_.end()) - next_.begin());
    const Time now = clock_->now();
    if (next_[camera] > now + kMostPatience) {
      clock_->sleep_until(now + kMostPatience);
      return false;
    }
    clock_->sleep_until(next_[camera]);
    const Time period = from_seconds(1.0 / cameras_[camera].rate_hz);
    const Time woken = clock_->now();  // the times of the rate stay; missed pictures are left out
    const auto left_out = next_[camera] == Time(0) ? 0 : std::max(Time(0), woken - next_[camera]) / period;
    next_[camera] = next_[camera] == Time(0) ? woken + period : next_[camera] + (1 + left_out) * period;
    left_out_[camera] += static_cast<int>(left_out);
    is_fresh_ |= arm_->read_view(view_);
    if (!is_fresh_ || view_.at == shown_at_[camera]) return false;  // the simulation is paused
    shown_at_[camera] = view_.at;
    draw(camera, picture);
    picture.left_out = std::exchange(left_out_[camera], 0);
    return true;
  }

 private:
  void draw(std::size_t camera, Picture& picture) {
    mjModel* m = model_.get();
    mjData* d = data_.get();
    const double* at = view_.numbers.data();
    std::copy_n(at, m->nq, d->qpos);
    std::copy_n(at + m->nq, 3 * m->nmocap, d->mocap_pos);
    std::copy_n(at + m->nq + 3 * m->nmocap, 4 * m->nmocap, d->mocap_quat);
    mujoco().mj_kinematics(m, d);
    mujoco().mj_comPos(m, d);
    mujoco().mj_camlight(m, d);
    mujoco().mj_tendon(m, d);
    mujoco().mjv_updateScene(m, d, &option_, nullptr, &views_[camera], mjCAT_ALL, &scene_);
    const int width = cameras_[camera].width, height = cameras_[camera].height;
    const mjrRect all{0, 0, width, height};
    mujoco().mjr_render(all, &scene_, &drawing_);
    const auto row = static_cast<std::size_t>(3 * width);
    rows_.resize(row * height);
    mujoco().mjr_readPixels(rows_.data(), nullptr, all, &drawing_);
    picture.camera = static_cast<int>(camera);
    picture.exposed = view_.at;
    picture.rgb.resize(row * height);
    for (int y = 0; y < height; ++y) {  // OpenGL's rows begin at the bottom
      std::copy_n(rows_.data() + (height - 1 - y) * row, row, picture.rgb.data() + y * row);
    }
  }

  MujocoArm* arm_;
  std::vector<CameraInfo> cameras_;
  std::vector<Time> next_;  ///< when each is due
  std::vector<Time> shown_at_ = std::vector<Time>(cameras_.size(), Time(-1));
  std::vector<int> left_out_ = std::vector<int>(cameras_.size(), 0);  ///< per camera, since its last picture
  Clock* clock_;
  std::unique_ptr<mjModel, SceneModel::FreeModel> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
  std::unique_ptr<OffscreenContext> context_;
  mjrContext drawing_;
  mjvScene scene_;
  mjvOption option_;
  std::vector<mjvCamera> views_;  ///< of cameras_
  std::vector<std::uint8_t> rows_;
  SceneView view_;
  bool is_fresh_ = false, is_current_ = false;
};

}  // namespace

Result<std::unique_ptr<PictureSource>> make_scene_cameras(MujocoArm& arm, const std::vector<CameraInfo>& cameras,
                                                          Clock& clock) {
  const mjModel* of_arm = arm.scene_model().model.get();
  std::vector<std::string> known;
  for (int i = 0; i < of_arm->ncam; ++i) known.emplace_back(mujoco().mj_id2name(of_arm, mjOBJ_CAMERA, i));
  for (const CameraInfo& camera : cameras) {
    if (std::find(known.begin(), known.end(), camera.name) == known.end()) {
      return Error{fmt::format("the scene has no camera '{}'; {}", camera.name,
                               known.empty() ? "it has none" : fmt::format("it has {}", fmt::join(known, ", ")))};
    }
  }
  if (Status s = arm.show_views(); !s) return s.error();
  // llvmpipe, which draws in software, would otherwise use all processors, also the control loop's.
  (void)setenv("LP_NUM_THREADS", "0", 0);
  auto context = OffscreenContext::make();
  if (!context) return context.error();
  std::unique_ptr<mjModel, SceneModel::FreeModel> model(mujoco().mj_copyModel(nullptr, of_arm));
  const auto larger = [](int a, const CameraInfo& camera, int CameraInfo::*side) { return std::max(a, camera.*side); };
  model->vis.global.offwidth = model->vis.global.offheight = 1;
  for (const CameraInfo& camera : cameras) {
    model->vis.global.offwidth = larger(model->vis.global.offwidth, camera, &CameraInfo::width);
    model->vis.global.offheight = larger(model->vis.global.offheight, camera, &CameraInfo::height);
  }
  // Smooth edges take two thirds of the drawing time on a processor: 17 ms for 320 x 240 pixels.
  if ((*context)->draws_in_software()) model->vis.quality.offsamples = 0;
  model->vis.quality.shadowsize = std::min(model->vis.quality.shadowsize, kShadowPixels);
  for (int i = 0; i < 3; ++i) {  // bright, independent of the scene's lights
    model->vis.headlight.ambient[i] = std::max(model->vis.headlight.ambient[i], 0.4F);
    model->vis.headlight.diffuse[i] = std::max(model->vis.headlight.diffuse[i], 0.6F);
  }
  return std::unique_ptr<PictureSource>(new SceneCameras(arm, cameras, clock, std::move(model), *std::move(context)));
}

}  // namespace steadyhand
