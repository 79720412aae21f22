#pragma once
#include "planner/reach/clearance.h"
#include "planner/reach/skipped_dot.h"

/// Why a dot is out of reach: of all candidate poses, the failure of the one that passed the most checks,
/// with the amount.
namespace hilbrush {

class FailureTally {
 public:
  /// The beam, blocked `free_m` from the dot.
  void beam(Obstruction what, double free_m);
  void lens(const Shortfall& shortfall);
  /// No tilt within its limits turns the dot to the beam; the nearest one is `excess` (rad) past them.
  void no_tilt(double excess);
  void limit(const LimitExcess& excess);
  void workspace_boundary(double excess_m);
  void quill(const Shortfall& shortfall);
  void links(const Shortfall& shortfall);

  SkippedDot describe() const;
  /// Whether the best failure is a near miss: finer directions and tilts might find a pose.
  bool is_nearly_reached() const;

 private:
  /// The checks in their order.
  enum Stage { kNone, kBeam, kLens, kTable, kLimit, kQuill, kLinks };
  /// Whether this failure replaces the one that is kept: it is of a later check, or of the same one with a
  /// smaller shortfall. Then it does.
  bool replaces(Stage stage, double shortfall);
  void body(Stage stage, const Shortfall& shortfall);
  SkippedDot past_limit(SkipReason reason, std::size_t axis) const;

  Stage stage_ = kNone;
  double shortfall_ = 0;
  Obstruction what_ = Obstruction::kNone;
  std::size_t axis_ = 0;  ///< kAxisCount: the workspace boundary
  double amount_ = 0;     ///< rad or m
};

}  // namespace hilbrush
