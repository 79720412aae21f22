#pragma once
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/execution/duration_histogram.h"
#include "daemon/execution/motion_times.h"

/// A job as the daemon keeps and reports it. Plain data; the socket thread owns it.
namespace hilbrush {

using Json = nlohmann::ordered_json;

/// queued -> planning -> ready -> painting <-> paused -> done | failed | cancelled. Dry jobs go from planning
/// to done; a job of several copies goes from painting to ready after each but the last.
enum class JobState { kQueued, kPlanning, kReady, kPainting, kPaused, kDone, kFailed, kCancelled };
const char* job_state_name(JobState state);
std::optional<JobState> job_state_from_name(const std::string& name);
/// Nothing happens to the job any more.
bool is_final(JobState state);
/// It waits to be planned or painted: its place among the others that wait can be changed.
bool is_in_queue(JobState state);

/// ISO 8601, UTC, to the second.
std::string utc_now();

struct JobError {
  std::string at;  ///< file:line, JSON path, device, or empty
  std::string message;
};

struct Job {
  std::int64_t id = 0;
  std::string key;        ///< idempotency key, or empty
  std::uint32_t uid = 0;  ///< of the submitter
  std::uint32_t gid = 0;
  JobState state = JobState::kQueued;
  std::filesystem::path model;       ///< as submitted
  std::filesystem::path model_copy;  ///< in the job's folder; empty until copied
  std::string settings;              ///< canonical JSON
  std::string cell;  ///< for the pipeline: the daemon's cell file, or the name of another cell for a dry run
  bool dry_run = false;
  std::int64_t rank = 0;  ///< jobs that wait are planned, listed and painted in ascending order
  int copies = 1;         ///< parts to paint, one after another
  int copies_done = 0;
  bool is_begun = false;  ///< the journal of the present copy exists: it must never be created again
  std::string created, started, ended;  ///< ISO 8601, UTC; started: first painted; empty: not yet
  std::filesystem::path
      folder;  ///< job.json, model/, program.ply, dots.ply, report.json, journal, emissions.ply

  /// Counts of dots of the present copy; placed = exposed + in doubt + remaining + skipped.
  std::uint64_t placed = 0;
  std::uint64_t exposed = 0;
  std::uint64_t skipped = 0;
  std::vector<std::uint32_t> in_doubt;  ///< dot indices, ascending in the program
  std::string stage;                    ///< what is being done, or empty
  double progress = 0;                  ///< 0..1, of the stage while planning, of the dots while painting
  std::optional<double> eta_s;
  double planned_s = 0;  ///< the time model's total for the whole program
  std::optional<JobError> error;
  std::vector<std::string> warnings;  ///< of the pipeline, the first kWarningsMax
  /// What an operator should see before painting, of the report: a JSON object as text, or empty. See
  /// plan_of_report().
  std::string plan;
  std::string model_sha256;  ///< over the copied files, as programs name it
  std::string settings_sha256;

  /// The wall time that Hilbrush itself adds to each dot, of this daemon's life or the last one known.
  struct OwnTime {
    std::uint64_t dots = 0;
    double median_s = 0;
    double p99_s = 0;
  } own_time;
  DurationHistogram own_times;
  /// What moves were measured to take, as a cell file's `measured`, with `moves` and `is_enough`: a JSON
  /// object as text, or empty.
  std::string measured;
  MotionTimes motion_times;

  /// Not stored: an operator has confirmed that the part is in its place, and nothing has happened since that
  /// could have moved it.
  bool is_part_confirmed = false;
  int position = 0;       ///< in the queue, from 1; 0: not in it. Not kept.
  std::uint64_t seq = 0;  ///< rises with every change that is reported; starts at 0 with the daemon

  static constexpr std::size_t kWarningsMax = 20;

  std::uint64_t exposure_count() const { return placed - skipped; }
  std::uint64_t remaining() const {
    const std::uint64_t used = exposed + in_doubt.size();
    return exposure_count() > used ? exposure_count() - used : 0;
  }
};

/// Everything that is kept of a job, as text, and back. Reading is tolerant: missing values and those of a
/// wrong type keep their defaults; empty if the text is not a job at all.
std::string job_to_record(const Job& job);
std::optional<Job> job_from_record(const std::string& text);

/// The object's size and place, the causes of skipped dots, and the suggestion, of a report of the pipeline:
/// bounded, whatever the report holds.
Json plan_of_report(const Json& report);

/// The job object of the protocol. At most 1000 in-doubt dots are listed; dots.in_doubt counts them all.
Json job_to_json(const Job& job);
/// About what that takes as text.
std::size_t job_json_bytes(const Job& job);

}  // namespace hilbrush
