#include "steadyhand/cameras/render/offscreen_context.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <fmt/format.h>

#include <string_view>

#include "steadyhand/core/shared_library.hpp"

namespace steadyhand {

namespace {

/// What is used of EGL, with the names of its headers.
struct EglLibrary {
  SharedLibrary in;
  decltype(&::eglBindAPI) eglBindAPI = in("eglBindAPI");
  decltype(&::eglChooseConfig) eglChooseConfig = in("eglChooseConfig");
  decltype(&::eglCreateContext) eglCreateContext = in("eglCreateContext");
  decltype(&::eglDestroyContext) eglDestroyContext = in("eglDestroyContext");
  decltype(&::eglGetError) eglGetError = in("eglGetError");
  decltype(&::eglGetProcAddress) eglGetProcAddress = in("eglGetProcAddress");
  decltype(&::eglInitialize) eglInitialize = in("eglInitialize");
  decltype(&::eglMakeCurrent) eglMakeCurrent = in("eglMakeCurrent");
};

Result<EglLibrary> load_egl() {
  const auto found = SharedLibrary::load({"libEGL.so.1"}, RTLD_GLOBAL);  // MuJoCo looks for its functions by name
  if (!found) return found.error();
  const EglLibrary egl{*found};
  if (Status s = egl.in.complete(); !s) return s.error();
  return egl;
}

const Result<EglLibrary>& loaded() {
  static const Result<EglLibrary> library = load_egl();
  return library;
}

const EglLibrary& egl() { return *loaded(); }

Error refused(const char* what) {
  return Error{
      fmt::format("{} (EGL says 0x{:x}); Debian's libegl-mesa0 and libgl1-mesa-dri draw without a graphics card", what,
                  egl().eglGetError())};
}

}  // namespace

Result<std::unique_ptr<OffscreenContext>> OffscreenContext::make() {
  if (!loaded()) {
    return Error{
        fmt::format("cameras of a simulated scene need EGL: {}; install it, on Debian with 'apt install libegl1'",
                    loaded().error().message)};
  }
  const auto get_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(egl().eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display == nullptr) return refused("EGL has no platforms");
  const EGLDisplay display = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (display == EGL_NO_DISPLAY || egl().eglInitialize(display, nullptr, nullptr) == EGL_FALSE) {
    return refused("EGL has no display without a screen");
  }
  constexpr EGLint kWanted[] = {EGL_RED_SIZE,
                                8,
                                EGL_GREEN_SIZE,
                                8,
                                EGL_BLUE_SIZE,
                                8,
                                EGL_DEPTH_SIZE,
                                24,
                                EGL_STENCIL_SIZE,
                                8,
                                EGL_SURFACE_TYPE,
                                EGL_PBUFFER_BIT,
                                EGL_RENDERABLE_TYPE,
                                EGL_OPENGL_BIT,
                                EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  if (egl().eglChooseConfig(display, kWanted, &config, 1, &configs) == EGL_FALSE || configs == 0) {
    return refused("EGL has no OpenGL with colours and depth");
  }
  if (egl().eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) return refused("EGL has no OpenGL");
  const EGLContext context = egl().eglCreateContext(display, config, EGL_NO_CONTEXT, nullptr);
  if (context == EGL_NO_CONTEXT) return refused("EGL makes no OpenGL context");
  std::unique_ptr<OffscreenContext> made(new OffscreenContext(display, context));
  if (Status s = made->make_current(); !s) return s.error();
  return made;
}

Status OffscreenContext::make_current() {
  egl().eglBindAPI(EGL_OPENGL_API);  // for this thread
  if (egl().eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE) {
    return refused("the OpenGL context cannot be used");
  }
  return Done{};
}

bool OffscreenContext::draws_in_software() const {
  constexpr unsigned kRenderer = 0x1F01;  // GL_RENDERER
  const auto get = reinterpret_cast<const unsigned char* (*)(unsigned)>(egl().eglGetProcAddress("glGetString"));
  const unsigned char* name = get == nullptr ? nullptr : get(kRenderer);
  const std::string_view said = name == nullptr ? "" : reinterpret_cast<const char*>(name);
  return said.find("llvmpipe") != said.npos || said.find("softpipe") != said.npos;
}

void OffscreenContext::release() { egl().eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

OffscreenContext::~OffscreenContext() {
  release();
  egl().eglDestroyContext(display_, context_);
}

}  // namespace steadyhand
