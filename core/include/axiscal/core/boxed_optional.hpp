// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

namespace axiscal {

/// An optional value on the heap, for a member that is empty in most objects. It has the size of a
/// pointer and the interface of std::optional.
template <typename T>
class BoxedOptional {
 public:
  BoxedOptional() = default;
  BoxedOptional(std::nullopt_t) {}  // NOLINT(google-explicit-constructor)
  BoxedOptional(T value)
      : value_(std::make_unique<T>(std::move(value))) {}  // NOLINT(google-explicit-constructor)

  /// Constructs a T from a value of another type.
  template <typename From>
  requires(std::constructible_from<T, From> && !std::same_as<std::remove_cvref_t<From>, T> &&
           !std::same_as<std::remove_cvref_t<From>, BoxedOptional>)
      BoxedOptional(From&& from)  // NOLINT(google-explicit-constructor)
      : value_(std::make_unique<T>(std::forward<From>(from))) {}

  BoxedOptional(const BoxedOptional& other)
      : value_(other ? std::make_unique<T>(*other) : nullptr) {}
  BoxedOptional(BoxedOptional&&) noexcept = default;
  BoxedOptional& operator=(BoxedOptional other) noexcept {
    value_ = std::move(other.value_);
    return *this;
  }
  ~BoxedOptional() = default;

  [[nodiscard]] bool has_value() const { return value_ != nullptr; }
  explicit operator bool() const { return has_value(); }

  /// The operators * and -> require that has_value() is true.

  [[nodiscard]] T& operator*() { return *value_; }
  [[nodiscard]] const T& operator*() const { return *value_; }
  [[nodiscard]] T* operator->() { return value_.get(); }
  [[nodiscard]] const T* operator->() const { return value_.get(); }

  void reset() { value_.reset(); }

 private:
  std::unique_ptr<T> value_;
};

}  // namespace axiscal
