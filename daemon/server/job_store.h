#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/server/job.h"

/// Jobs on disk: state/jobs.sqlite, schema version in user_version, older versions migrated at opening. What a job
/// painted is the journal's to know; here are its state and its terms. Socket thread only.
namespace hilbrush {

class JobStore {
 public:
  /// A file that is no database, damaged, or of a newer daemon is set aside under another name, so that the daemon
  /// starts; `set_aside` then says so. @throws std::runtime_error if no database can be made there.
  JobStore(const std::filesystem::path& file, std::string* set_aside);
  ~JobStore();
  JobStore(const JobStore&) = delete;
  JobStore& operator=(const JobStore&) = delete;

  /// Gives the job its id. What is stored survives the daemon's death; a power cut may take the last moments.
  void insert(Job& job);
  void update(const Job& job);
  std::vector<Job> load_all();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
