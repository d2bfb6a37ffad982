#pragma once

#include <memory>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// OpenGL without a screen or window, by EGL.
class OffscreenContext {
 public:
  /// Current on the calling thread. Fails where EGL has no display without a screen, or no OpenGL.
  static Result<std::unique_ptr<OffscreenContext>> make();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

  /// One thread at a time: what is drawn from here on by the calling thread is drawn in it.
  Status make_current();
  /// Another thread may take it.
  void release();
  /// Whether Mesa draws on the processor. Only while it is current.
  bool draws_in_software() const;

 private:
  OffscreenContext(void* display, void* context) : display_(display), context_(context) {}

  void* display_;
  void* context_;
};

}  // namespace steadyhand
