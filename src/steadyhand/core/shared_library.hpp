#pragma once

#include <dlfcn.h>
#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// A library that is loaded when it is first needed. It stays loaded until the program ends.
class SharedLibrary {
 public:
  /// Loads the first of these that can be loaded: paths, or names that the dynamic loader looks for. Fails with the
  /// loader's reason for each.
  /// @param flags RTLD_GLOBAL: other libraries that look for its functions by name find them
  static Result<SharedLibrary> load(const std::vector<std::string>& names, int flags = RTLD_LOCAL) {
    std::string reasons;
    for (const std::string& name : names) {
      if (void* handle = dlopen(name.c_str(), RTLD_NOW | flags)) return SharedLibrary(handle, name);
      reasons += (reasons.empty() ? "" : "; ") + std::string(dlerror());
    }
    return Error{reasons};
  }

  /// Converts to a pointer to a function or variable of the type that its header declares.
  struct Symbol {
    void* address;
    template <typename T>
    operator T*() const {  // NOLINT(google-explicit-constructor)
      return reinterpret_cast<T*>(address);
    }
  };
  /// The function or variable of this name, also of a library that this one needs. Null if there is none.
  Symbol operator()(const char* name) {
    void* address = dlsym(handle_, name);
    if (address == nullptr) missing_ += (missing_.empty() ? "" : ", ") + std::string(name);
    return {address};
  }
  /// Fails with the names that were looked for in vain.
  Status complete() const {
    if (missing_.empty()) return Done{};
    return Error{fmt::format("{} does not have {}", name_, missing_)};
  }
  /// The one of the names that was loaded.
  const std::string& name() const { return name_; }

 private:
  SharedLibrary(void* handle, std::string name) : handle_(handle), name_(std::move(name)) {}

  void* handle_;
  std::string name_, missing_;
};

}  // namespace steadyhand
