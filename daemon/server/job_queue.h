#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/server/job.h"
#include "daemon/server/job_store.h"
#include "daemon/server/json_rpc.h"

/// All jobs: their records, their order, and the store that keeps them. What is done to a job is decided by
/// JobPlanning and JobPainting; they change its fields and report it here. Socket thread only; it never waits
/// for more than the disk.
namespace hilbrush {

/// @throws RpcFault that says which state of the job forbids what.
[[noreturn]] void forbid(const Job& job, const std::string& why);

class JobQueue {
 public:
  /// Jobs that wait; further ones are refused, because every change of the order touches all of them.
  static constexpr std::size_t kWaitingMax = 1000;
  /// Final jobs in memory; older ones are read from the store when asked for.
  static constexpr std::size_t kHistoryMax = 1000;

  /// `store` outlives it.
  JobQueue(std::filesystem::path jobs_folder, JobStore& store);

  /// Loads the jobs of the daemon's previous run: painting ones are paused, those that were being planned are
  /// queued again. If the store is new, jobs are found again by the records in their folders. Call once,
  /// before the first request. @return a sentence for the operator, or nothing.
  std::string restore();

  /// Gives the job its id, folder and place at the end of the queue, and stores it. @throws RpcFault
  Job& add(Job job);
  /// By the id of a request. The reference to a job that is no longer in memory lasts until the next call.
  /// @throws RpcFault if there is none.
  Job& get(const std::string& id);
  /// The job that was submitted with this key; nullptr if there is none, or the key is empty.
  Job* find_key(const std::string& key);
  /// Only jobs in memory; nullptr if there is none.
  Job* find(std::int64_t id);
  /// To the given place in the queue, from 1; beyond its end: to the end. @throws RpcFault
  Job& move(const std::string& id, int position);
  /// The jobs that wait, in the order in which they are planned and to be painted.
  std::vector<const Job*> waiting() const;
  const std::map<std::int64_t, Job>& jobs() const { return jobs_; }
  std::map<std::int64_t, Job>& jobs() { return jobs_; }

  /// The job was changed: it is stored, positions follow, watchers are notified.
  void changed(Job& job);
  /// Only what is not stored was changed, such as progress: watchers are notified.
  void progressed(Job& job);
  /// Stores the job and nothing else. If that fails, keep_unkept() tries again.
  void keep(const Job& job);
  /// Stores what could not be stored before. Call now and then.
  void keep_unkept();
  /// Why the store cannot be written, or empty: jobs go on, and are stored when it works again.
  const std::string& store_fault() const { return store_fault_; }

  /// Called after every change of a job; set once.
  std::function<void(const Job&)> on_change;

 private:
  void keep_ranks(const std::vector<std::pair<std::int64_t, std::int64_t>>& job_ranks);
  void update_positions();
  void forget_oldest(const Job& spared);
  std::string find_lost_jobs();

  const std::filesystem::path jobs_folder_;
  JobStore& store_;
  std::map<std::int64_t, Job> jobs_;
  std::optional<Job> archived_;    ///< the last job that was asked for and is no longer in jobs_
  std::set<std::int64_t> unkept_;  ///< jobs that the store does not have as they are
  std::string store_fault_;
};

}  // namespace hilbrush
