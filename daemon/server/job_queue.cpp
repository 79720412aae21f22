#include "daemon/server/job_queue.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

/// Whole or not at all, so that a lost store can be rebuilt from these.
void write_record(const Job& job) {
  std::error_code error;
  fs::create_directories(job.folder, error);
  const fs::path file = job.folder / "job.json";
  const fs::path part = job.folder / "job.json.part";
  std::ofstream out(part, std::ios::trunc);
  out << job_to_record(job) << std::endl;
  out.close();
  if (!out) throw std::runtime_error(part.string() + ": cannot be written");
  fs::rename(part, file);
}

/// Empty if it cannot be read, or is not a file: a pipe would be waited for.
std::string record_text(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return {};
  std::ifstream in(file);
  return std::string((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
}

bool is_job_number(const std::string& text) {
  constexpr std::size_t kDigitsMax = 18;  // of an int64_t
  return !text.empty() && text.size() <= kDigitsMax &&
         text.find_first_not_of("0123456789") == std::string::npos;
}

/// A job whose record is lost: its number is taken, so that no new job gets its files.
Job lost_job(const fs::path& folder) {
  Job job;
  job.id = std::stoll(folder.filename().string());
  job.state = JobState::kFailed;
  job.created = job.ended = utc_now();
  job.error = JobError{(folder / "job.json").string(), "the job's record is lost; its files are still there"};
  return job;
}

}  // namespace

void forbid(const Job& job, const std::string& why) {
  throw RpcFault{kRpcWrongState,
                 "job " + std::to_string(job.id) + " is " + job_state_name(job.state) + ": " + why, ""};
}

JobQueue::JobQueue(fs::path jobs_folder, JobStore& store)
    : jobs_folder_(std::move(jobs_folder)), store_(store) {}

void JobQueue::changed(Job& job) {
  if (is_final(job.state) && job.ended.empty()) job.ended = utc_now();
  keep(job);
  update_positions();
  if (is_final(job.state)) forget_oldest(job);
  progressed(job);
}

void JobQueue::progressed(Job& job) {
  ++job.seq;
  if (on_change) on_change(job);
}

/// A store that cannot be written must not keep a cell from being stopped or a dot from being counted: the
/// journal has what matters, and what could not be written is written later.
void JobQueue::keep(const Job& job) {
  try {
    store_.update(job);
    write_record(job);
    unkept_.erase(job.id);
    if (unkept_.empty()) store_fault_.clear();
  } catch (const std::exception& error) {
    unkept_.insert(job.id);
    store_fault_ = std::string("jobs cannot be stored: ") + error.what();
  }
}

void JobQueue::keep_unkept() {
  const std::vector<std::int64_t> ids(unkept_.begin(), unkept_.end());
  for (const std::int64_t id : ids) {
    if (const Job* job = find(id))
      keep(*job);
    else
      unkept_.erase(id);
    if (unkept_.contains(id)) return;  // still not: no use in trying the others
  }
  if (unkept_.empty()) store_fault_.clear();
}

void JobQueue::keep_ranks(const std::vector<std::pair<std::int64_t, std::int64_t>>& job_ranks) {
  try {
    store_.set_ranks(job_ranks);
  } catch (const std::exception& error) {
    for (const auto& [id, rank] : job_ranks) unkept_.insert(id);
    store_fault_ = std::string("jobs cannot be stored: ") + error.what();
  }
}

std::vector<const Job*> JobQueue::waiting() const {
  std::vector<const Job*> jobs;
  for (const auto& [id, job] : jobs_)
    if (is_in_queue(job.state)) jobs.push_back(&job);
  std::sort(jobs.begin(), jobs.end(),
            [](const Job* a, const Job* b) { return std::pair(a->rank, a->id) < std::pair(b->rank, b->id); });
  return jobs;
}

void JobQueue::update_positions() {
  for (auto& [id, job] : jobs_) job.position = 0;
  int position = 0;
  for (const Job* job : waiting()) jobs_.at(job->id).position = ++position;
}

void JobQueue::forget_oldest(const Job& spared) {
  const auto count = std::count_if(jobs_.begin(), jobs_.end(),
                                   [](const auto& entry) { return is_final(entry.second.state); });
  if (static_cast<std::size_t>(count) <= kHistoryMax) return;
  const auto oldest = std::find_if(jobs_.begin(), jobs_.end(), [&](const auto& entry) {
    return is_final(entry.second.state) && &entry.second != &spared && !unkept_.contains(entry.first);
  });
  if (oldest != jobs_.end()) jobs_.erase(oldest);
}

/// By the records in the jobs' folders.
std::string JobQueue::find_lost_jobs() {
  std::size_t found = 0;
  std::size_t lost = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(jobs_folder_, error)) {
    const std::string name = entry.path().filename().string();
    if (!is_job_number(name)) continue;
    const std::optional<Job> job = job_from_record(record_text(entry.path() / "job.json"));
    const bool is_found = job && job->id == std::stoll(name);
    store_.insert_with_id(is_found ? *job : lost_job(entry.path()));
    ++(is_found ? found : lost);
  }
  if (found + lost == 0) return "";
  return std::to_string(found) + " jobs were found again by the records in their folders" +
         (lost > 0 ? "; of " + std::to_string(lost) + " only the files are left" : "");
}

std::string JobQueue::restore() {
  std::string notice;
  if (store_.is_new()) notice = find_lost_jobs();
  for (Job& loaded : store_.load_recent(kHistoryMax)) {
    Job& job = jobs_.emplace(loaded.id, std::move(loaded)).first->second;
    job.folder = jobs_folder_ / std::to_string(job.id);
    if (job.state == JobState::kPlanning) {
      job.state = JobState::kQueued;
      keep(job);
    }
    if (job.state == JobState::kPainting) {
      job.state = JobState::kPaused;
      job.error = JobError{"", "the daemon ended while this job was painted"};
      keep(job);
    }
  }
  update_positions();
  return notice;
}

Job& JobQueue::get(const std::string& id) {
  const bool is_number = is_job_number(id);
  if (Job* job = is_number ? find(std::stoll(id)) : nullptr) return *job;
  archived_ = is_number ? store_.find(std::stoll(id)) : std::nullopt;
  if (!archived_) throw RpcFault{kRpcNoSuchJob, "there is no job " + id.substr(0, 40), "$.id"};
  archived_->folder = jobs_folder_ / std::to_string(archived_->id);
  return *archived_;
}

Job* JobQueue::find_key(const std::string& key) {
  const auto known = key.empty() ? std::nullopt : store_.find_key(key);
  return known ? &get(std::to_string(known->id)) : nullptr;
}

Job* JobQueue::find(std::int64_t id) {
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : &found->second;
}

Job& JobQueue::add(Job job) {
  job.created = utc_now();
  try {
    job.rank = store_.last_rank() + 1;
    store_.insert(job);
  } catch (const std::exception& error) {
    throw RpcFault{kRpcInternal, std::string("the job cannot be stored: ") + error.what(), ""};
  }
  job.folder = jobs_folder_ / std::to_string(job.id);
  const auto id = job.id;
  Job& kept = jobs_.emplace(id, std::move(job)).first->second;
  keep(kept);
  update_positions();
  return kept;
}

Job& JobQueue::move(const std::string& id, int position) {
  Job& job = get(id);
  if (!is_in_queue(job.state)) forbid(job, "only a job that waits has a place in the queue");
  std::vector<const Job*> order = waiting();
  std::erase(order, &job);
  const auto index = std::min(order.size(), static_cast<std::size_t>(position - 1));
  order.insert(order.begin() + static_cast<std::ptrdiff_t>(index), &job);
  std::vector<std::int64_t> ranks;
  for (const Job* waiting : order) ranks.push_back(waiting->rank);
  std::sort(ranks.begin(), ranks.end());
  std::int64_t rank = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> job_ranks;
  for (std::size_t i = 0; i < order.size(); ++i) {
    rank = std::max(rank + 1, ranks[i]);
    Job& moved = jobs_.at(order[i]->id);
    if (std::exchange(moved.rank, rank) != rank) job_ranks.emplace_back(moved.id, rank);
  }
  keep_ranks(job_ranks);
  update_positions();
  for (const auto& [moved, new_rank] : job_ranks)
    if (moved != job.id) progressed(jobs_.at(moved));
  changed(job);
  return job;
}

}  // namespace hilbrush
