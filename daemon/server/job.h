#pragma once
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

/// A job as the daemon remembers and tells it. Plain data; the socket thread owns it.
namespace hilbrush {

using Json = nlohmann::ordered_json;

/// queued -> planning -> ready -> painting <-> paused -> done | failed | cancelled. Dry jobs go from planning to done.
enum class JobState { kQueued, kPlanning, kReady, kPainting, kPaused, kDone, kFailed, kCancelled };
const char* job_state_name(JobState state);
std::optional<JobState> job_state_from_name(const std::string& name);
/// Nothing happens to the job any more.
bool is_final(JobState state);

struct JobError {
  std::string at;  ///< file:line, JSON path, device, or empty
  std::string message;
};

struct Job {
  std::int64_t id = 0;
  std::string key;                 ///< idempotency key, or empty
  std::uint32_t uid = 0, gid = 0;  ///< whoever submitted it
  JobState state = JobState::kQueued;
  std::filesystem::path model;       ///< as submitted
  std::filesystem::path model_copy;  ///< in the job's folder; empty until copied
  std::string settings;              ///< canonical JSON
  std::string cell;  ///< what the pipeline is told: the daemon's cell file, or another's name for a dry run
  bool dry_run = false;
  std::string created;           ///< ISO 8601, UTC
  std::filesystem::path folder;  ///< model/, program.ply, dots.ply, report.json, journal, emissions.ply

  /// Counts of dots; placed = exposed + in doubt + remaining + skipped.
  std::uint64_t placed = 0, exposed = 0, skipped = 0;
  std::vector<std::uint32_t> in_doubt;  ///< dot indices, ascending in the program
  std::string stage;                    ///< what is being done, or empty
  double progress = 0;                  ///< 0..1, of the stage while planning, of the dots while painting
  std::optional<double> eta_s;
  double planned_s = 0;  ///< the time model's total for the whole program
  std::optional<JobError> error;
  std::vector<std::string> warnings;  ///< of the pipeline, the first kWarningsMax
  std::string model_sha256;           ///< over the copied files, as programs name it
  std::string settings_sha256;

  std::uint64_t seq = 0;  ///< rises with every change that is told; begins anew with the daemon

  static constexpr std::size_t kWarningsMax = 20;

  std::uint64_t exposure_count() const { return placed - skipped; }
  std::uint64_t remaining() const {
    const std::uint64_t used = exposed + in_doubt.size();
    return exposure_count() > used ? exposure_count() - used : 0;
  }
};

/// The job object of the protocol. At most 1000 in-doubt dots are listed; dots.in_doubt counts them all.
Json job_to_json(const Job& job);

}  // namespace hilbrush
