#include "steadyhand/cameras/video/camera_set.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <semaphore>
#include <stdexcept>

#include "support/manual_clock.hpp"

namespace steadyhand {
namespace {

/// Takes pictures as fast as they are asked for, and is unplugged after some.
class Burst final : public PictureSource {
 public:
  Burst(const std::string& name, int pictures) : cameras_{{name, 32, 16, 10.0}}, left_(pictures) {}
  const std::vector<CameraInfo>& cameras() const override { return cameras_; }
  Result<bool> take(Picture& picture) override {
    if (left_ == 0) return Error{"unplugged"};
    --left_;
    picture.camera = 0;
    picture.left_out = left_ == 40 ? 2 : 0;
    picture.rgb.assign(3 * 32 * 16, 100);
    return true;
  }

 private:
  std::vector<CameraInfo> cameras_;
  int left_;
};

/// Encodes nothing, and only when it may.
class Gated final : public VideoEncoder {
 public:
  explicit Gated(std::counting_semaphore<1000>& gate) : gate_(&gate) {}
  Result<VideoPacket> encode(const Picture&) override {
    gate_->acquire();
    return VideoPacket();
  }

 private:
  std::counting_semaphore<1000>* gate_;
};

std::vector<std::unique_ptr<PictureSource>> bursts(const std::vector<std::pair<std::string, int>>& named) {
  std::vector<std::unique_ptr<PictureSource>> sources;
  for (const auto& [name, pictures] : named) sources.push_back(std::make_unique<Burst>(name, pictures));
  return sources;
}

template <typename Condition>
void wait_until(const Condition& holds) {
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!holds()) {
    ASSERT_LT(std::chrono::steady_clock::now(), patience);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(CameraSet, EncoderThatIsBehindDropsPicturesAndCountsThem) {
  std::counting_semaphore<1000> gate(0);
  ManualClock clock;
  auto set = CameraSet::make(bursts({{"slow", 50}}), clock, [&](const CameraInfo&) {
    return Result<std::unique_ptr<VideoEncoder>>(std::make_unique<Gated>(gate));
  });
  ASSERT_TRUE(set);
  std::atomic<int> packets = 0;
  (*set)->start([&](VideoPacket) { ++packets; });
  wait_until([&] { return !(*set)->states()[0].ended.empty(); });  // the source never waited for the encoder
  EXPECT_EQ((*set)->states()[0].ended, "unplugged");
  EXPECT_GE((*set)->states()[0].dropped, 2 + 45U);  // the source left two out; 4 wait, one may be at the encoder
  gate.release(50);
  wait_until([&] { return (*set)->states()[0].pictures + (*set)->states()[0].dropped == 52; });
  (*set)->end();
  EXPECT_EQ(static_cast<std::uint64_t>(packets), (*set)->states()[0].pictures);
}

TEST(CameraSet, OneThatEndsLeavesTheOthers) {
  ManualClock clock;
  std::atomic<int> of_right = 0;  // outlives the threads of the set
  auto set = CameraSet::make(bursts({{"left", 3}, {"right", 1'000'000'000}}), clock);
  ASSERT_TRUE(set) << set.error().message;
  (*set)->start([&](VideoPacket packet) { of_right += packet.camera == 1 ? 1 : 0; });
  wait_until([&] { return !(*set)->states()[0].ended.empty(); });
  const int so_far = of_right;
  wait_until([&] { return of_right > so_far + 5; });
  EXPECT_EQ((*set)->states()[1].ended, "");
}

/// Takes one picture, and then throws.
class Throwing final : public PictureSource {
 public:
  const std::vector<CameraInfo>& cameras() const override { return cameras_; }
  Result<bool> take(Picture& picture) override {
    if (taken_++ > 0) throw std::runtime_error("no memory for a picture");
    picture.rgb.assign(3 * 32 * 16, 100);
    return true;
  }

 private:
  std::vector<CameraInfo> cameras_ = {{"front", 32, 16, 10.0}, {"back", 32, 16, 10.0}};
  int taken_ = 0;
};

TEST(CameraSet, EndsACameraThatThrowsAndNotTheProgram) {
  ManualClock clock;
  std::vector<std::unique_ptr<PictureSource>> sources = bursts({{"well", 1'000'000'000}, {"deaf", 1'000'000'000}});
  sources.push_back(std::make_unique<Throwing>());
  std::atomic<int> of_well = 0;
  auto set = CameraSet::make(std::move(sources), clock);
  ASSERT_TRUE(set) << set.error().message;
  (*set)->start([&](VideoPacket packet) {
    of_well += packet.camera == 0 ? 1 : 0;
    if (packet.camera == 1) throw 7;  // on the thread of its encoder
  });
  for (const int camera : {1, 2, 3}) wait_until([&] { return !(*set)->states()[camera].ended.empty(); });
  EXPECT_EQ((*set)->states()[1].ended, "something of unknown kind was thrown");
  EXPECT_EQ((*set)->states()[2].ended, "no memory for a picture");
  EXPECT_EQ((*set)->states()[3].ended, "no memory for a picture");
  const int so_far = of_well;
  wait_until([&] { return of_well > so_far + 5; });
}

TEST(CameraSet, RefusesNames) {
  ManualClock clock;
  const auto refusal = [&](const std::string& one, const std::string& other) {
    const auto set = CameraSet::make(bursts({{one, 1}, {other, 1}}), clock);
    return set ? "" : set.error().message;
  };
  EXPECT_EQ(refusal("wrist", "wrist"), "two cameras are named 'wrist'");
  EXPECT_EQ(refusal("../up", "wrist"), "a camera is named '../up'; it must be of 1 to 60 letters, digits, _ and -");
  EXPECT_EQ(refusal("", "wrist"), "a camera is named ''; it must be of 1 to 60 letters, digits, _ and -");
}

}  // namespace
}  // namespace steadyhand
