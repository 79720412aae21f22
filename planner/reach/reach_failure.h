#pragma once
#include "planner/plan.h"
#include "planner/reach/clearance.h"

/// Inside planner/: why a dot is out of reach, as it is told: of all candidates, the excuse of the one that came
/// farthest, with the amount.
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

  void tell(SkippedDot& skipped) const;
  /// Whether so little is missing that finer directions and tilts might find it.
  bool is_nearly_reached() const;

 private:
  /// The checks in their order: who fails a later one came farther.
  enum Stage { kNone, kBeam, kLens, kTable, kLimit, kQuill, kLinks };
  /// Whether this excuse becomes the one that is told; of one stage the smallest shortfall does.
  bool is_better(Stage stage, double shortfall);
  void body(Stage stage, const Shortfall& shortfall);

  Stage stage_ = kNone;
  double shortfall_ = 0;
  Obstruction what_ = Obstruction::kNone;
  int axis_ = 0;
  double amount_ = 0;  ///< rad or m
};

}  // namespace hilbrush
