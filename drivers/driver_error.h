#pragma once
#include <stdexcept>

namespace hilbrush {

/// The only exception drivers throw: a device that refuses, is late, is lost or contradicts itself. what() is
/// a sentence for the operator.
struct DriverError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace hilbrush
