#pragma once

#include <string>
#include <utility>
#include <variant>

namespace steadyhand {

/// An error. The message has the file, key, line or column, the invalid value, and the valid values.
struct Error {
  std::string message;  ///< for people
};

/// A value or an error.
template <typename T>
class [[nodiscard]] Result {
 public:
  /// @{ Where a function returns one or the other.
  Result(T value) : content_(std::move(value)) {}  // NOLINT(google-explicit-constructor): `return value;` reads best
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)
  /// @}

  /// Whether there is a value.
  explicit operator bool() const { return std::holds_alternative<T>(content_); }
  /// @{ The value. @pre bool(*this)
  const T& operator*() const& { return std::get<T>(content_); }
  T& operator*() & { return std::get<T>(content_); }
  T&& operator*() && { return std::get<T>(std::move(content_)); }
  const T* operator->() const { return &std::get<T>(content_); }
  T* operator->() { return &std::get<T>(content_); }
  /// @}
  /// Why there is none. @pre !bool(*this)
  const Error& error() const { return std::get<Error>(content_); }

 private:
  std::variant<T, Error> content_;
};

/// Success without a value.
struct Done {};
using Status = Result<Done>;  ///< success, or the reason why not

}  // namespace steadyhand
