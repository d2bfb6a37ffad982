#include "steadyhand/operator/server/picture_inlet.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "steadyhand/operator/protocol/page_messages.hpp"

namespace steadyhand {

Result<std::shared_ptr<PictureInlet>> PictureInlet::make(std::size_t cameras) {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0) return Error{std::string("cannot show cameras at the page: ") + std::strerror(errno)};
  std::shared_ptr<PictureInlet> inlet(new PictureInlet(descriptor));
  for (std::size_t i = 0; i < cameras; ++i) inlet->cameras_.emplace_back();
  return inlet;
}

PictureInlet::~PictureInlet() { ::close(descriptor_); }

void PictureInlet::put(const VideoPacket& packet) {
  Camera& camera = cameras_[static_cast<std::size_t>(packet.camera)];
  if (camera.needs_key && !packet.is_key) return;
  const auto text = std::make_shared<const std::string>(picture_message(packet));
  camera.needs_key = !camera.ring.push({packet.camera, packet.is_key, text});
  const std::uint64_t one = 1;
  (void)!::write(descriptor_, &one, sizeof(one));  // fails only where it can be read already
}

void PictureInlet::hear() {
  std::uint64_t told = 0;
  (void)!::read(descriptor_, &told, sizeof(told));  // fails only where nothing was put
}

bool PictureInlet::take(Message& message) {
  for (Camera& camera : cameras_) {
    if (camera.ring.pop(message)) return true;
  }
  return false;
}

}  // namespace steadyhand
