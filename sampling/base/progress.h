#pragma once
#include <functional>

namespace hilbrush {

/// Told how far a stage has come, 0..1, from the thread that runs it, at least once a second of work. May throw to end
/// the stage.
using Progress = std::function<void(double fraction)>;

}  // namespace hilbrush
