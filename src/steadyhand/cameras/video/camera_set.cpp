#include "steadyhand/cameras/video/camera_set.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>

#include "steadyhand/core/attempt.hpp"

namespace steadyhand {

namespace {

/// Lower priority than the threads that move the arm or serve the page. Threads that this thread starts inherit it.
constexpr int kNice = 10;

void become_camera_thread(const std::string& name) {
  pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
  (void)setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNice);  // always allowed
}

bool is_name(const std::string& name) {
  return !name.empty() && name.size() <= 60 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
}

}  // namespace

Result<std::unique_ptr<CameraSet>> CameraSet::make(std::vector<std::unique_ptr<PictureSource>> sources, Clock& clock,
                                                   const MakeEncoder& make_encoder) {
  std::unique_ptr<CameraSet> set(new CameraSet(clock));
  for (const std::unique_ptr<PictureSource>& source : sources) {
    for (const CameraInfo& camera : source->cameras()) {
      if (!is_name(camera.name)) {
        return Error{
            fmt::format("a camera is named '{}'; it must be of 1 to 60 letters, digits, _ and -", camera.name)};
      }
      if (std::any_of(set->cameras_.begin(), set->cameras_.end(),
                      [&](const CameraInfo& other) { return other.name == camera.name; })) {
        return Error{fmt::format("two cameras are named '{}'", camera.name)};
      }
      auto encoder = make_encoder(camera);
      if (!encoder) return encoder.error();
      set->cameras_.push_back(camera);
      set->at_work_.push_back(std::make_unique<Camera>());
      set->at_work_.back()->encoder = *std::move(encoder);
    }
  }
  set->sources_ = std::move(sources);
  return set;
}

CameraSet::~CameraSet() { end(); }

void CameraSet::start(TakePacket take) {
  std::size_t first = 0;
  for (const std::unique_ptr<PictureSource>& source : sources_) {
    threads_.emplace_back([this, &source = *source, first](const std::stop_token& stop) {
      const Status filmed = attempt([&] { film(stop, source, first); });
      for (std::size_t i = first; !filmed && i < first + source.cameras().size(); ++i)
        fail(*at_work_[i], filmed.error().message);
    });
    first += source->cameras().size();
  }
  for (std::size_t i = 0; i < at_work_.size(); ++i) {
    threads_.emplace_back([this, i, take](const std::stop_token& stop) {
      become_camera_thread("enc " + cameras_[i].name);
      const Status encoded = attempt([&] { encode(stop, *at_work_[i], static_cast<int>(i), take); });
      if (!encoded) fail(*at_work_[i], encoded.error().message);
    });
  }
}

void CameraSet::end() {
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();
}

std::vector<CameraState> CameraSet::states() const {
  std::vector<CameraState> states;
  for (const std::unique_ptr<Camera>& camera : at_work_) {
    const std::lock_guard lock(camera->mutex);
    states.push_back(camera->state);
  }
  return states;
}

void CameraSet::film(const std::stop_token& stop, PictureSource& source, std::size_t first) {
  become_camera_thread("cam " + source.cameras().front().name);
  Picture picture;
  while (!stop.stop_requested()) {
    const Result<bool> taken = source.take(picture);
    if (!taken) {
      for (std::size_t i = 0; i < source.cameras().size(); ++i) fail(*at_work_[first + i], taken.error().message);
      return;
    }
    if (*taken) offer(*at_work_[first + static_cast<std::size_t>(picture.camera)], picture);
  }
}

/// Passes its pixels on and returns others for reuse.
void CameraSet::offer(Camera& camera, Picture& picture) {
  {
    const std::lock_guard lock(camera.mutex);
    camera.state.dropped += static_cast<std::uint64_t>(picture.left_out);
    if (camera.waiting.size() == kMostWaiting) {
      ++camera.state.dropped;
      return;
    }
    std::vector<std::uint8_t> other;
    if (!camera.spare.empty()) {
      other = std::move(camera.spare.back());
      camera.spare.pop_back();
    }
    camera.waiting.push_back({picture.camera, picture.exposed, 0, std::exchange(picture.rgb, std::move(other))});
  }
  camera.changed.notify_one();
}

void CameraSet::encode(const std::stop_token& stop, Camera& camera, int index, const TakePacket& take) {
  while (true) {
    Picture picture;
    {
      std::unique_lock lock(camera.mutex);
      if (!camera.changed.wait(lock, stop, [&] { return !camera.waiting.empty(); })) return;
      picture = std::move(camera.waiting.front());
      camera.waiting.pop_front();
    }
    Result<VideoPacket> packet = camera.encoder->encode(picture);
    if (!packet) return fail(camera, packet.error().message);
    packet->camera = index;
    packet->stamp.made = clock_->now();
    {
      const std::lock_guard lock(camera.mutex);
      ++camera.state.pictures;
      camera.state.latency = to_seconds(packet->stamp.made - packet->stamp.hand);
      camera.spare.push_back(std::move(picture.rgb));
    }
    take(*std::move(packet));
  }
}

void CameraSet::fail(Camera& camera, const std::string& why) {
  const std::lock_guard lock(camera.mutex);
  if (camera.state.ended.empty()) camera.state.ended = why;
}

}  // namespace steadyhand
