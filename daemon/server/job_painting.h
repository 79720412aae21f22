#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/server/cell_controller.h"
#include "daemon/server/cell_thread.h"
#include "daemon/server/job_queue.h"
#include "daemon/server/pipeline_child.h"

/// From a planned job to a painted one, one job at a time. A run prepares (the executor's thread reads
/// program and journal), approaches (a child plans the path from where the axes are) and paints. Socket
/// thread only; what the executor and the child report is posted there.
namespace hilbrush {

class JobPainting {
 public:
  /// Takes over the controller's on_stop. All outlive it.
  JobPainting(JobQueue& queue, CellController& controller, CellThread& thread, PipelineChildren& children,
              const CellDescription& description, PostToSocketThread post);

  /// After JobQueue::restore(): jobs with a journal on the disk have been begun, and their counts of dots are
  /// read from it. Call once.
  void restore();
  /// The daemon ends: no further journal is read. The cell has been stopped before, which ends a run.
  void shut_down() { is_ending_ = true; }

  /// All throw RpcFault.
  /// The operator confirms that the part is in its place.
  Job& start(const std::string& id);
  Job& pause(const std::string& id);
  /// The part must be confirmed again if the cell was stopped, or the daemon was restarted, since the last
  /// run.
  Job& resume(const std::string& id, bool exposes_in_doubt, bool is_part_in_place);

  /// The job that is being painted ends as cancelled, at once or after the present dot.
  void cancel(Job& job);
  bool is_painting() const { return run_.has_value(); }

 private:
  struct Run {
    std::int64_t job = 0;
    std::uint64_t number = 0;  ///< tells answers of this run from those of an earlier one
    enum class Phase { kPreparing, kApproaching, kPainting } phase = Phase::kPreparing;
    std::optional<PipelineChildren::ChildId> child;
    bool is_cancelled = false;
    std::size_t exposed_before = 0;  ///< dots, when the run began
    std::chrono::steady_clock::time_point begin;
  };

  void begin_run(Job& job, bool exposes_in_doubt);
  void approach(const Prepared& prepared);
  void plan_approach(Job& job, std::size_t next, const Joints& from);
  void finish_approach(const ChildOutcome& outcome);
  void paint(std::vector<Joints> approach);
  void note_progress(std::size_t exposed);
  void finish_run(const ExecutionResult& result, const PaintTally& tally);
  void keep_for_its_cell(Job& job, const CellFault& why);
  void end_run_before_painting(ExecutionOutcome outcome, const CellFault& why);
  bool leave_approach(ExecutionOutcome outcome, const std::string& reason);
  void note_own_time(Job& job, const DurationHistogram& own_time) const;
  void finish_copy(Job& job) const;
  void handle_stop();
  void inspect_next();

  JobQueue& queue_;
  CellController& controller_;
  CellThread& thread_;
  PipelineChildren& children_;
  const CellDescription& description_;
  const PostToSocketThread post_;
  std::optional<Run> run_;
  std::uint64_t runs_ = 0;
  std::vector<std::int64_t> to_inspect_;  ///< jobs whose journals are still to be read
  bool is_ending_ = false;
};

}  // namespace hilbrush
