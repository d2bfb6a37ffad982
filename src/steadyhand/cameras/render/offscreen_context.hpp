#pragma once

#include <memory>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// OpenGL without a screen or window, by EGL.
class OffscreenContext {
 public:
  /// Current on the calling thread. Fails if EGL has no display without a screen, or no OpenGL.
  static Result<std::unique_ptr<OffscreenContext>> make();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

  /// From here on the calling thread draws in this context. One thread at a time.
  Status make_current();
  /// Releases it for use by another thread.
  void release();
  /// True if Mesa draws on the processor. Call it only while the context is current.
  bool draws_in_software() const;

 private:
  OffscreenContext(void* display, void* context) : display_(display), context_(context) {}

  void* display_;
  void* context_;
};

}  // namespace steadyhand
