#pragma once
#include <optional>
#include <string>
#include <utility>

#include "sampling/base/check.h"

namespace hilbrush {

/// Why something could not be done, as a sentence for a message: "it is not a regular file".
struct Failure {
  std::string reason;
};

/// A value, or the reason why there is none.
template <class Value>
class Result {
 public:
  Result(Value value) : value_(std::move(value)) {}                // NOLINT: implicit on purpose
  Result(Failure failure) : reason_(std::move(failure.reason)) {}  // NOLINT: implicit on purpose

  explicit operator bool() const { return value_.has_value(); }
  /// @pre there is a value
  Value& operator*() {
    CHECK(value_.has_value());
    return *value_;
  }
  const Value& operator*() const {
    CHECK(value_.has_value());
    return *value_;
  }
  Value* operator->() { return &**this; }
  const Value* operator->() const { return &**this; }
  /// Empty if there is a value.
  const std::string& reason() const { return reason_; }

 private:
  std::optional<Value> value_;
  std::string reason_;
};

}  // namespace hilbrush
