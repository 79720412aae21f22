#include "daemon/server/job_queue.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "daemon/server/model_copy.h"
#include "sampling/base/input_error.h"
#include "sampling/base/sha256.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

/// Whole or not at all, so that a lost store can be made again from these.
void write_record(const Job& job) {
  std::error_code error;
  fs::create_directories(job.folder, error);
  const fs::path file = job.folder / "job.json", part = job.folder / "job.json.part";
  std::ofstream out(part, std::ios::trunc);
  out << job_to_record(job) << std::endl;
  out.close();
  if (!out) throw std::runtime_error(part.string() + ": can't be written");
  fs::rename(part, file);
}

/// As the pipeline hashes them into a program: where it runs and whether it is a dry run change nothing about a
/// program.
std::string settings_sha256(JobSettings settings) {
  settings.cell = "-";
  settings.dry_run = false;
  return sha256_hex(job_settings_to_json(settings));
}

/// A job's "cell": the daemon's own, or, for a dry run, another shipped one by name.
std::string cell_of(const SubmitOrder& order, const JobSettings& settings, const fs::path& cell_file,
                    const CellDescription& description) {
  if (!order.settings.contains("cell") || settings.cell == description.name) return cell_file.string();
  const auto refuse = [](const std::string& sentence) { throw RpcFault{kRpcBadInput, sentence, "$.settings.cell"}; };
  if (settings.cell.find('/') != std::string::npos || settings.cell.ends_with(".json"))
    refuse("a job names a cell, it does not bring one");
  if (!order.dry_run)
    refuse("this daemon runs cell \"" + description.name + "\"; only a dry run can be for another one");
  return find_cell(settings.cell).string();
}

}  // namespace

void forbid(const Job& job, const std::string& why) {
  throw RpcFault{kRpcWrongState, "job " + std::to_string(job.id) + " is " + job_state_name(job.state) + ": " + why, ""};
}

JobQueue::JobQueue(JobPaths place, JobStore& store, CellController& desk, CellThread& thread,
                   PipelineChildren& children, const CellDescription& description, PostToSocketThread post)
    : place_(std::move(place)),
      store_(store),
      desk_(desk),
      thread_(thread),
      children_(children),
      description_(description),
      post_(std::move(post)) {
  desk_.on_stop = [this] { handle_stop(); };
}

void JobQueue::changed(Job& job, bool is_stored) {
  ++job.seq;
  if (is_stored) {
    if (is_final(job.state) && job.ended.empty()) job.ended = utc_now();
    keep(job);
    update_positions();
    if (is_final(job.state)) forget_oldest(job);
  }
  if (on_change) on_change(job);
}

/// A store that can't be written must not keep a cell from being stopped or a dot from being counted: the journal has
/// what matters, and the next change writes again.
void JobQueue::keep(Job& job) {
  try {
    store_.update(job);
    write_record(job);
    store_fault_.clear();
  } catch (const std::exception& error) {
    store_fault_ = std::string("jobs can't be stored: ") + error.what();
  }
}

std::vector<const Job*> JobQueue::queue() const {
  std::vector<const Job*> waiting;
  for (const auto& [id, job] : jobs_)
    if (is_in_queue(job.state)) waiting.push_back(&job);
  std::sort(waiting.begin(), waiting.end(),
            [](const Job* a, const Job* b) { return std::pair(a->rank, a->id) < std::pair(b->rank, b->id); });
  return waiting;
}

void JobQueue::update_positions() {
  for (auto& [id, job] : jobs_) job.position = 0;
  int position = 0;
  for (const Job* job : queue()) jobs_.at(job->id).position = ++position;
}

void JobQueue::forget_oldest(const Job& spared) {
  const auto count =
      std::count_if(jobs_.begin(), jobs_.end(), [](const auto& entry) { return is_final(entry.second.state); });
  if (static_cast<std::size_t>(count) <= kHistoryMax) return;
  const auto oldest = std::find_if(jobs_.begin(), jobs_.end(), [&](const auto& entry) {
    return is_final(entry.second.state) && &entry.second != &spared;
  });
  jobs_.erase(oldest);
}

/// By the records in the jobs' folders; a folder whose record is lost too keeps its number, so that no new job gets its
/// files.
std::string JobQueue::find_lost_jobs() {
  std::size_t found = 0, lost = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(place_.jobs_folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.empty() || name.size() > 18 || name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream in(entry.path() / "job.json");
    const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    std::optional<Job> job = job_from_record(text);
    if (job && job->id == std::stoll(name)) {
      ++found;
    } else {
      ++lost;
      job.emplace();
      job->id = std::stoll(name);
      job->state = JobState::kFailed;
      job->created = job->ended = utc_now();
      job->error =
          JobError{(entry.path() / "job.json").string(), "the job's record is lost; its files are still there"};
    }
    store_.insert_with_id(*job);
  }
  if (found + lost == 0) return "";
  return std::to_string(found) + " jobs were found again by their folders' records" +
         (lost > 0 ? "; of " + std::to_string(lost) + " only the files are left" : "");
}

std::string JobQueue::restore() {
  std::string notice;
  if (store_.is_new()) notice = find_lost_jobs();
  for (Job& job : store_.load_recent(kHistoryMax)) {
    job.folder = place_.jobs_folder / std::to_string(job.id);
    const JobState before = job.state;
    if (job.state == JobState::kPlanning) job.state = JobState::kQueued;
    if (job.state == JobState::kPainting) {
      job.state = JobState::kPaused;
      job.error = JobError{"", "the daemon ended while this job was painted"};
    }
    // The journal on the disk is newer than what a power cut has left in the store.
    if (!job.dry_run && fs::exists(copy_file(paint_order(job), "journal", ""))) job.is_begun = true;
    if (job.is_begun && job.state == JobState::kReady) job.state = JobState::kPaused;
    const bool has_journal = job.is_begun && !job.dry_run;
    if (has_journal && (job.state == JobState::kPaused || job.state == JobState::kDone)) to_inspect_.push_back(job.id);
    Job& kept = jobs_.emplace(job.id, std::move(job)).first->second;
    if (kept.state != before) keep(kept);
  }
  update_positions();
  inspect_next();
  plan_next();
  return notice;
}

void JobQueue::shut_down() {
  is_ending_ = true;
  if (planning_ && planning_->child) children_.cancel(*planning_->child);
}

Job& JobQueue::get(const std::string& id) {
  const bool is_number =
      !id.empty() && id.size() < 19 && std::all_of(id.begin(), id.end(), [](char c) { return c >= '0' && c <= '9'; });
  const auto found = is_number ? jobs_.find(std::stoll(id)) : jobs_.end();
  if (found != jobs_.end()) return found->second;
  archived_ = is_number ? store_.find(std::stoll(id)) : std::nullopt;
  if (!archived_) throw RpcFault{kRpcNoSuchJob, "there is no job " + id.substr(0, 40), "$.id"};
  archived_->folder = place_.jobs_folder / std::to_string(archived_->id);
  return *archived_;
}

Job& JobQueue::submit(const SubmitOrder& order, const Peer& peer) {
  if (!order.model.is_absolute()) throw RpcFault{kRpcBadParams, "must be an absolute path", "$.model"};
  JobSettings settings;
  try {
    settings = job_settings_from_json(order.settings.dump(), "$.settings");
  } catch (const InputError& error) {
    throw RpcFault{kRpcBadInput, error.sentence(), error.at()};
  }
  Job job;
  job.cell = cell_of(order, settings, place_.cell_file, description_);
  settings.dry_run = order.dry_run;
  job.settings = job_settings_to_json(settings);
  job.settings_sha256 = settings_sha256(settings);
  job.model = order.model;
  job.dry_run = order.dry_run;
  job.key = order.key;
  job.uid = peer.uid;
  job.gid = peer.gid;
  job.copies = order.copies;
  if (job.dry_run && job.copies != 1) throw RpcFault{kRpcBadParams, "a dry run has no copies", "$.copies"};

  if (const auto known = order.key.empty() ? std::nullopt : store_.find_key(order.key)) {
    Job& earlier = get(std::to_string(known->id));
    if (earlier.model == job.model && earlier.settings == job.settings && earlier.dry_run == job.dry_run &&
        earlier.copies == job.copies)
      return earlier;
    throw RpcFault{kRpcBadParams,
                   "belongs to job " + std::to_string(earlier.id) + ", which was submitted with other parameters",
                   "$.key"};
  }
  const auto waiting = std::count_if(jobs_.begin(), jobs_.end(), [](const auto& entry) {
    return entry.second.state == JobState::kQueued || entry.second.state == JobState::kPlanning;
  });
  if (static_cast<std::size_t>(waiting) >= kWaitingMax)
    throw RpcFault{kRpcWrongState, std::to_string(kWaitingMax) + " jobs wait already: cancel one or wait", ""};
  try {
    check_readable(order.model, peer.uid, peer.gid);
  } catch (const InputError& error) {
    throw RpcFault{kRpcBadInput, error.sentence(), error.at()};
  }
  job.created = utc_now();
  try {
    job.rank = store_.last_rank() + 1;
    store_.insert(job);
  } catch (const std::exception& error) {
    throw RpcFault{kRpcInternal, std::string("the job can't be stored: ") + error.what(), ""};
  }
  job.folder = place_.jobs_folder / std::to_string(job.id);
  const auto id = job.id;
  Job& kept = jobs_.emplace(id, std::move(job)).first->second;
  keep(kept);
  update_positions();
  // After the answer, which is to say "queued".
  post_([this] { plan_next(); });
  return kept;
}

Job& JobQueue::start(const std::string& id) {
  Job& job = get(id);
  if (job.state == JobState::kPaused) forbid(job, "it goes on with job.resume");
  if (job.dry_run) forbid(job, "a dry run is never painted");
  if (job.state != JobState::kReady) forbid(job, "only a ready job can be started");
  begin_run(job, false);
  return job;
}

Job& JobQueue::resume(const std::string& id, bool exposes_in_doubt, bool is_part_in_place) {
  Job& job = get(id);
  if (job.state == JobState::kReady) forbid(job, "it begins with job.start");
  if (job.state != JobState::kPaused) forbid(job, "only a paused job can be resumed");
  if (!job.is_part_confirmed && !is_part_in_place)
    throw RpcFault{kRpcWrongState,
                   "job " + std::to_string(job.id) +
                       " is paused, and since its last run the cell was stopped or the daemon began anew: confirm that "
                       "its part is in its place as before (part_in_place)",
                   "$.part_in_place"};
  begin_run(job, exposes_in_doubt);
  return job;
}

Job& JobQueue::move(const std::string& id, int position) {
  Job& job = get(id);
  if (!is_in_queue(job.state)) forbid(job, "only a job that waits has a place in the queue");
  std::vector<const Job*> order = queue();
  std::erase(order, &job);
  const auto place = std::min(order.size(), static_cast<std::size_t>(position - 1));
  order.insert(order.begin() + static_cast<std::ptrdiff_t>(place), &job);
  std::int64_t rank = 0;
  std::vector<std::int64_t> ranks;
  for (const Job* waiting : order) ranks.push_back(waiting->rank);
  std::sort(ranks.begin(), ranks.end());
  for (std::size_t i = 0; i < order.size(); ++i) {
    rank = std::max(rank + 1, ranks[i]);
    Job& moved = jobs_.at(order[i]->id);
    if (moved.rank == rank) continue;
    moved.rank = rank;
    if (&moved != &job) changed(moved);
  }
  changed(job);
  return job;
}

Job& JobQueue::pause(const std::string& id) {
  Job& job = get(id);
  if (job.state != JobState::kPainting) forbid(job, "only a job that is being painted can be paused");
  thread_.pause();
  if (leave_approach(ExecutionOutcome::kPaused, "")) return job;
  job.stage = "pausing";
  changed(job, false);
  return job;
}

Job& JobQueue::cancel(const std::string& id) {
  Job& job = get(id);
  if (is_final(job.state)) forbid(job, "there is nothing to cancel");
  if (job.state == JobState::kPainting) {
    run_->is_cancelled = true;
    thread_.pause();
    if (leave_approach(ExecutionOutcome::kPaused, "")) return job;
    job.stage = "cancelling";
    changed(job, false);
    return job;
  }
  const bool was_planning = job.state == JobState::kPlanning;
  if (was_planning && planning_->child) children_.cancel(*planning_->child);
  job.state = JobState::kCancelled;
  job.stage.clear();
  job.eta_s.reset();
  changed(job);
  if (was_planning) end_planning();
  return job;
}

}  // namespace hilbrush
