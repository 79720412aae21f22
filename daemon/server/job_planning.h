#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/server/cell_controller.h"
#include "daemon/server/cell_thread.h"
#include "daemon/server/file_thread.h"
#include "daemon/server/job_queue.h"
#include "daemon/server/peer.h"
#include "daemon/server/pipeline_child.h"

/// From a submitted model to a planned job: a model's files are listed by a child of the pipeline, copied
/// into the job's folder, and planned by another child, one job at a time. Socket thread only; what children
/// report is posted there.
namespace hilbrush {

struct SubmitOrder {
  std::filesystem::path model;
  Json settings = Json::object();
  bool dry_run = false;
  std::string key;
  int copies = 1;
};

class JobPlanning {
 public:
  static constexpr std::size_t kUnplannedMax = 100;  ///< jobs queued or being planned; more are refused
  static constexpr int kCopiesMax = 1000;            ///< of one job

  /// What opens and copies the models of clients: a copy may take minutes, and must not delay an answer.
  struct Threads {
    PipelineChildren& children;
    FileThread& checks;
    FileThread& copies;
  };

  /// `queue`, `threads` and `description` outlive it.
  JobPlanning(JobQueue& queue, const Threads& threads, const CellDescription& description,
              std::filesystem::path cell_file, PostToSocketThread post);

  /// Queues a job once its model was found readable, and answers with it; the same key answers the same job.
  /// @throws RpcFault for what is wrong with the order itself; what is wrong with the model is answered.
  void submit(const SubmitOrder& order, const Peer& peer, const Reply& reply);
  /// Cancels a job that is not being painted; if it is being planned, its child is killed.
  void cancel(Job& job);
  /// Begins with the first queued job, unless one is being planned.
  void plan_next();
  /// The daemon ends: the child is killed, and no further job is planned.
  void shut_down();

 private:
  /// The job that is being planned.
  struct Current {
    std::int64_t job = 0;
    std::optional<PipelineChildren::ChildId> child;
    std::optional<FileThread::TaskId> copy;
  };
  Job requested_job(const SubmitOrder& order, const Peer& peer) const;
  Job* earlier_job(const Job& job);
  Job& add_checked(const Job& job, const JobError& refusal);
  Job* current_job(std::int64_t id);
  void list_files(Job& job);
  void copy_files(Job& job, const ChildOutcome& outcome);
  void run_pipeline(Job& job);
  void finish(Job& job, const ChildOutcome& outcome);
  void fail(Job& job, JobError error);
  void stop_current();
  void end_current();
  ChildOrder watched_order(const Job& job, std::vector<std::string> arguments,
                           std::function<void(Job&, ChildOutcome)> on_end);

  JobQueue& queue_;
  PipelineChildren& children_;
  FileThread& checks_;
  FileThread& copies_;
  const CellDescription& description_;
  const std::filesystem::path cell_file_;
  const PostToSocketThread post_;
  std::optional<Current> current_;
  bool is_ending_ = false;
};

}  // namespace hilbrush
