#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "daemon/server/cell_controller.h"
#include "daemon/server/cell_thread.h"
#include "daemon/server/job.h"
#include "daemon/server/job_store.h"
#include "daemon/server/peer.h"
#include "daemon/server/pipeline_child.h"

/// All jobs and what becomes of them: files listed and copied, planned (one at a time) in a child, painted (one at a
/// time) by the executor's thread. Socket thread only; it never waits.
namespace hilbrush {

struct SubmitOrder {
  std::filesystem::path model;
  Json settings = Json::object();
  bool dry_run = false;
  std::string key;
  int copies = 1;
};

/// @throws RpcFault that says which state of the job forbids what.
[[noreturn]] void forbid(const Job& job, const std::string& why);

class JobQueue {
 public:
  static constexpr std::size_t kWaitingMax = 100;  ///< jobs queued or being planned
  static constexpr std::size_t kHistoryMax =
      1000;  ///< final jobs kept in memory; older ones are looked up when asked for
  static constexpr int kCopiesMax = 1000;

  struct JobPaths {
    std::filesystem::path jobs_folder;
    std::filesystem::path cell_file;
  };

  JobQueue(JobPaths place, JobStore& store, CellController& desk, CellThread& thread, PipelineChildren& children,
           const CellDescription& description, PostToSocketThread post);

  /// Jobs of an earlier life: what was painting is paused, what was planning is queued again. If the store is new, jobs
  /// are found again by the records in their folders. Call once, before the first request. @return a sentence for the
  /// operator, or nothing.
  std::string restore();
  /// The daemon ends: the pipeline is cancelled and no job is begun any more. The cell has been stopped before.
  void shut_down();

  /// All throw RpcFault.
  Job& submit(const SubmitOrder& order, const Peer& peer);
  Job& get(const std::string& id);
  /// The operator confirms that the part is in its place.
  Job& start(const std::string& id);
  Job& pause(const std::string& id);
  /// The part must be confirmed again if the cell was stopped, or the daemon began anew, since it last was.
  Job& resume(const std::string& id, bool exposes_in_doubt, bool is_part_in_place);
  Job& cancel(const std::string& id);
  /// To the given place in the queue, from 1; beyond its end: to the end.
  Job& move(const std::string& id, int position);
  /// What waits, in the order in which it is planned and to be painted.
  std::vector<const Job*> queue() const;
  const std::map<std::int64_t, Job>& jobs() const { return jobs_; }
  bool is_painting() const { return run_.has_value(); }
  /// Why the store can't be written, or empty: jobs go on, and are stored when it works again.
  const std::string& store_fault() const { return store_fault_; }

  /// Told of every change of a job; set once.
  std::function<void(const Job&)> on_change;

 private:
  /// What is being planned.
  struct Planning {
    std::int64_t job = 0;
    std::optional<PipelineChildren::ChildId> child;
  };
  /// What is being painted.
  struct PaintRun {
    std::int64_t job = 0;
    std::uint64_t number = 0;  ///< an answer that belongs to an earlier run is not taken for this one's
    enum class Phase { kPreparing, kApproaching, kPainting } phase = Phase::kPreparing;
    std::optional<PipelineChildren::ChildId> child;
    bool is_cancelled = false;
    std::size_t exposed_before = 0;
    std::chrono::steady_clock::time_point begin;
  };

  void changed(Job& job, bool is_stored = true);
  void keep(Job& job);
  void update_positions();
  void forget_oldest(const Job& spared);
  std::string find_lost_jobs();
  Job* planned_job(std::int64_t id);
  void plan_next();
  void list_files(Job& job);
  void copy_files(Job& job, const ChildOutcome& outcome);
  void run_pipeline(Job& job);
  void finish_pipeline(Job& job, const ChildOutcome& outcome);
  void fail_planning(Job& job, JobError error);
  void end_planning();
  ChildOrder watched_order(const Job& job, std::vector<std::string> arguments,
                           std::function<void(Job&, ChildOutcome)> on_end);

  PaintOrder paint_order(const Job& job) const;
  void begin_run(Job& job, bool exposes_in_doubt);
  void approach(const Prepared& prepared);
  void paint(std::vector<Joints> way);
  void note_progress(std::size_t exposed);
  void finish_run(const ExecutionResult& result, const PaintTally& tally);
  void note_own_time(Job& job, const DurationHistogram& own_time);
  void note_motion(Job& job, const MotionTimes& motion);
  void finish_copy(Job& job);
  void take_tally(Job& job, const PaintTally& tally);
  void handle_stop();
  bool leave_approach(ExecutionOutcome outcome, const std::string& reason);
  void inspect_next();

  JobPaths place_;
  JobStore& store_;
  CellController& desk_;
  CellThread& thread_;
  PipelineChildren& children_;
  const CellDescription& description_;
  PostToSocketThread post_;
  std::map<std::int64_t, Job> jobs_;
  std::optional<Job> archived_;  ///< the last one that was asked for and is no longer in jobs_
  std::string store_fault_;
  std::optional<Planning> planning_;
  std::optional<PaintRun> run_;
  std::uint64_t runs_ = 0;
  std::vector<std::int64_t> to_inspect_;
  bool is_ending_ = false;
};

}  // namespace hilbrush
