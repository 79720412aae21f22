#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/server/job.h"

/// Jobs on disk: state/jobs.sqlite, schema version in user_version, older versions migrated at opening. What
/// a job painted is the journal's to know; here are its state and its terms, and the history. Methods throw
/// std::runtime_error when the disk is full or broken. Socket thread only.
namespace hilbrush {

class JobStore {
 public:
  /// A file that is not a database, is damaged, or of a newer daemon is set aside under another name, so that
  /// the daemon starts; notice() then says so. @throws std::runtime_error if no database can be made there.
  explicit JobStore(const std::filesystem::path& file);
  ~JobStore();
  JobStore(const JobStore&) = delete;
  JobStore& operator=(const JobStore&) = delete;

  /// True if the file was not there, or could not be used: it is empty now.
  bool is_new() const { return is_new_; }
  /// For the operator: why an earlier file was set aside; or empty.
  const std::string& notice() const { return notice_; }
  /// Gives the job its id. What is stored survives the daemon's death; a power cut may take the last moments.
  void insert(Job& job);
  /// Under the id it has; nothing happens if that, or its key, is taken.
  void insert_with_id(const Job& job);
  void update(const Job& job);
  /// Places in the queue, and nothing else, all at once.
  void set_ranks(const std::vector<std::pair<std::int64_t, std::int64_t>>& job_ranks);
  /// All that are not final, and the latest `final_count` that are; ascending ids.
  std::vector<Job> load_recent(std::size_t final_count);
  std::optional<Job> find(std::int64_t id);
  std::optional<Job> find_key(const std::string& key);
  std::int64_t last_rank();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
  bool is_new_ = false;
  std::string notice_;
};

}  // namespace hilbrush
