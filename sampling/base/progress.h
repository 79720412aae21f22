#pragma once
#include <concepts>
#include <cstdint>
#include <functional>
#include <type_traits>
#include <utility>

namespace hilbrush {

/// Reports how far a stage has come: fractions from 0 to 1, from the thread that runs the stage, at least
/// once a second of work. The listener may throw to end the stage. A default Progress has no listener:
/// calling it does nothing.
class Progress {
 public:
  Progress() = default;
  /// From any function that takes the fraction.
  template <class Listener>
  requires(!std::same_as<std::remove_cvref_t<Listener>, Progress> && std::invocable<Listener&, double>)
      Progress(Listener&& listener)
      : listener_(std::forward<Listener>(listener)) {}  // NOLINT: implicit on purpose

  void operator()(double fraction) const {
    if (listener_) listener_(begin_ + (end_ - begin_) * fraction);
  }

  /// `done` of `total` equal steps; `total` is not 0.
  void step(std::uint64_t done, std::uint64_t total) const {
    (*this)(static_cast<double>(done) / static_cast<double>(total));
  }

  /// The progress of a part of the stage that goes from one fraction of the whole to another.
  Progress part(double begin, double end) const {
    Progress part = *this;
    part.begin_ = begin_ + (end_ - begin_) * begin;
    part.end_ = begin_ + (end_ - begin_) * end;
    return part;
  }

 private:
  std::function<void(double fraction)> listener_;
  double begin_ = 0;  ///< what the stage's own 0 and 1 are to the listener
  double end_ = 1;
};

}  // namespace hilbrush
