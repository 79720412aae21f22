#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "daemon/server/cell_desk.h"
#include "daemon/server/cell_thread.h"
#include "daemon/server/job.h"
#include "daemon/server/job_store.h"
#include "daemon/server/pipeline_child.h"

/// All jobs and what becomes of them: files listed and copied, planned (one at a time) in a child, painted (one at a
/// time) by the executor's thread. Socket thread only; it never waits.
namespace hilbrush {

/// Who asks.
struct Peer {
  std::uint32_t uid = 0, gid = 0;
  std::int32_t pid = 0;
};

struct SubmitOrder {
  std::filesystem::path model;
  Json settings = Json::object();
  bool dry_run = false;
  std::string key;
};

class JobBook {
 public:
  static constexpr std::size_t kWaitingMax = 100;  ///< jobs queued or being planned

  struct Place {
    std::filesystem::path jobs_folder;
    std::filesystem::path cell_file;
  };

  JobBook(Place place, JobStore& store, CellDesk& desk, CellThread& thread, PipelineChildren& children,
          const CellDescription& description, Post post);

  /// Jobs of an earlier life: what was painting is paused, what was planning is queued again. Call once, before the
  /// first request.
  void restore();
  /// The daemon ends: the pipeline is cancelled and no job is begun any more. The cell has been stopped before.
  void shut_down();

  /// All throw RpcFault.
  Job& submit(const SubmitOrder& order, const Peer& peer);
  Job& get(const std::string& id);
  Job& start(const std::string& id);
  Job& pause(const std::string& id);
  Job& resume(const std::string& id, bool exposes_in_doubt);
  Job& cancel(const std::string& id);
  const std::map<std::int64_t, Job>& jobs() const { return jobs_; }
  bool is_painting() const { return run_.has_value(); }

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
  void take_tally(Job& job, const PaintTally& tally);
  void handle_stop();
  bool leave_approach(ExecutionOutcome outcome, const std::string& reason);
  void inspect_next();

  Place place_;
  JobStore& store_;
  CellDesk& desk_;
  CellThread& thread_;
  PipelineChildren& children_;
  const CellDescription& description_;
  Post post_;
  std::map<std::int64_t, Job> jobs_;
  std::map<std::string, std::int64_t> by_key_;
  std::optional<Planning> planning_;
  std::optional<PaintRun> run_;
  std::uint64_t runs_ = 0;
  std::vector<std::int64_t> to_inspect_;
  bool is_ending_ = false;
};

}  // namespace hilbrush
