#include "daemon/server/job_book.h"

#include <algorithm>
#include <chrono>
#include <ctime>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "daemon/server/model_copy.h"
#include "planner/sha256.h"
#include "sampling/input_error.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

[[noreturn]] void forbid(const Job& job, const std::string& why) {
  throw RpcFault{kRpcWrongState, "job " + std::to_string(job.id) + " is " + job_state_name(job.state) + ": " + why, ""};
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

JobBook::JobBook(Place place, JobStore& store, CellDesk& desk, CellThread& thread, PipelineChildren& children,
                 const CellDescription& description, Post post)
    : place_(std::move(place)),
      store_(store),
      desk_(desk),
      thread_(thread),
      children_(children),
      description_(description),
      post_(std::move(post)) {
  desk_.on_stop = [this] { handle_stop(); };
}

void JobBook::changed(Job& job, bool is_stored) {
  ++job.seq;
  if (is_stored) store_.update(job);
  if (on_change) on_change(job);
}

void JobBook::restore() {
  for (Job& job : store_.load_all()) {
    job.folder = place_.jobs_folder / std::to_string(job.id);
    if (!job.key.empty()) by_key_[job.key] = job.id;
    if (job.state == JobState::kPlanning) job.state = JobState::kQueued;
    if (job.state == JobState::kPainting) {
      job.state = JobState::kPaused;
      job.error = JobError{"", "the daemon ended while this job was painted"};
      store_.update(job);
    }
    if (job.state == JobState::kPaused || job.state == JobState::kDone) to_inspect_.push_back(job.id);
    jobs_.emplace(job.id, std::move(job));
  }
  std::erase_if(to_inspect_, [this](std::int64_t id) { return jobs_.at(id).dry_run; });
  inspect_next();
  plan_next();
}

/// What the journals say, one job at a time: the executor's thread has a short queue.
void JobBook::inspect_next() {
  if (to_inspect_.empty() || is_ending_) return;
  const std::int64_t id = to_inspect_.back();
  to_inspect_.pop_back();
  thread_.inspect(paint_order(jobs_.at(id)), [this, id](std::optional<PaintTally> tally) {
    Job& job = jobs_.at(id);
    if (tally && (job.state == JobState::kPaused || job.state == JobState::kDone)) {
      take_tally(job, *tally);
      changed(job);
    }
    desk_.note_executor_at_rest();
    inspect_next();
  });
}

void JobBook::shut_down() {
  is_ending_ = true;
  if (planning_ && planning_->child) children_.cancel(*planning_->child);
}

Job& JobBook::get(const std::string& id) {
  const bool is_number =
      !id.empty() && id.size() < 19 && std::all_of(id.begin(), id.end(), [](char c) { return c >= '0' && c <= '9'; });
  const auto found = is_number ? jobs_.find(std::stoll(id)) : jobs_.end();
  if (found == jobs_.end()) throw RpcFault{kRpcNoSuchJob, "there is no job " + id.substr(0, 40), "$.id"};
  return found->second;
}

Job& JobBook::submit(const SubmitOrder& order, const Peer& peer) {
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

  if (const auto known = by_key_.find(order.key); !order.key.empty() && known != by_key_.end()) {
    Job& earlier = jobs_.at(known->second);
    if (earlier.model == job.model && earlier.settings == job.settings && earlier.dry_run == job.dry_run)
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
  store_.insert(job);
  job.folder = place_.jobs_folder / std::to_string(job.id);
  if (!job.key.empty()) by_key_[job.key] = job.id;
  const auto id = job.id;
  Job& kept = jobs_.emplace(id, std::move(job)).first->second;
  // After the answer, which is to say "queued".
  post_([this] { plan_next(); });
  return kept;
}

void JobBook::plan_next() {
  if (planning_ || is_ending_) return;
  const auto found = std::find_if(jobs_.begin(), jobs_.end(),
                                  [](const auto& entry) { return entry.second.state == JobState::kQueued; });
  if (found == jobs_.end()) return;
  Job& job = found->second;
  planning_ = Planning{job.id, std::nullopt};
  job.state = JobState::kPlanning;
  job.progress = 0;
  job.error.reset();
  job.warnings.clear();
  job.stage = "copy";
  changed(job);
  std::error_code error;
  fs::create_directories(job.folder, error);
  if (error) return fail_planning(job, {job.folder.string(), "the job's folder can't be made: " + error.message()});
  if (job.model_copy.empty())
    list_files(job);
  else
    run_pipeline(job);
}

/// The job that is being planned, if it still is.
Job* JobBook::planned_job(std::int64_t id) {
  return planning_ && planning_->job == id ? &jobs_.at(id) : nullptr;
}

/// What all children of the pipeline have in common: the callbacks come home to the socket thread and find the job
/// still being planned, or do nothing.
ChildOrder JobBook::watched_order(const Job& job, std::vector<std::string> arguments,
                                  std::function<void(Job&, ChildOutcome)> on_end) {
  ChildOrder order;
  order.arguments = std::move(arguments);
  order.on_progress = [this, id = job.id](const std::string& stage, double fraction) {
    post_([this, id, stage, fraction] {
      if (Job* planned = planned_job(id)) {
        planned->stage = stage;
        planned->progress = fraction;
        changed(*planned, false);
      }
    });
  };
  order.on_warning = [this, id = job.id](const std::string& sentence) {
    post_([this, id, sentence] {
      if (Job* planned = planned_job(id); planned && planned->warnings.size() < Job::kWarningsMax)
        planned->warnings.push_back(sentence.substr(0, 1000));
    });
  };
  order.on_end = [this, id = job.id, on_end = std::move(on_end)](ChildOutcome outcome) {
    post_([this, id, on_end, outcome = std::move(outcome)] {
      if (Job* planned = planned_job(id)) on_end(*planned, outcome);
    });
  };
  return order;
}

/// Which files a model refers to is found by reading it, and reading untrusted bytes is a child's work, done with the
/// submitter's rights.
void JobBook::list_files(Job& job) {
  ChildOrder order = watched_order(job, {"files", "--model", job.model.string()},
                                   [this](Job& planned, const ChildOutcome& outcome) { copy_files(planned, outcome); });
  order.owner = ChildOwner{job.uid, job.gid};
  planning_->child = children_.start(std::move(order));
}

void JobBook::copy_files(Job& job, const ChildOutcome& outcome) {
  planning_->child.reset();
  if (!outcome.is_ok) return fail_planning(job, {outcome.error_at, outcome.error});
  std::vector<fs::path> files;
  try {
    const Json result = Json::parse(outcome.result);
    for (const auto& file : result.at("files")) files.emplace_back(file.get<std::string>());
  } catch (const Json::exception&) {
    return fail_planning(job, {"", "the pipeline gave no list of the model's files"});
  }
  children_.run([this, id = job.id, model = job.model, folder = job.folder, uid = job.uid, gid = job.gid,
                 files = std::move(files)] {
    std::optional<ModelCopy> copy;
    JobError error;
    try {
      copy = copy_model(model, files, folder / "model", uid, gid);
    } catch (const InputError& refusal) {
      error = {refusal.at(), refusal.sentence()};
    } catch (const std::exception& failure) {
      error = {model.string(), std::string("can't be copied: ") + failure.what()};
    }
    post_([this, id, copy, error] {
      Job* planned = planned_job(id);
      if (planned == nullptr) return;
      if (!copy) return fail_planning(*planned, error);
      planned->model_copy = copy->model;
      planned->model_sha256 = copy->sha256;
      run_pipeline(*planned);
    });
  });
}

void JobBook::run_pipeline(Job& job) {
  job.stage = "load";
  changed(job);
  planning_->child = children_.start(
      watched_order(job,
                    {job.dry_run ? "dry-run" : "plan", "--model", job.model_copy.string(), "--settings-json",
                     job.settings, "--cell", job.cell, "--output", job.folder.string()},
                    [this](Job& planned, const ChildOutcome& outcome) { finish_pipeline(planned, outcome); }));
}

void JobBook::finish_pipeline(Job& job, const ChildOutcome& outcome) {
  if (!outcome.is_ok) return fail_planning(job, {outcome.error_at, outcome.error});
  try {
    const Json report = Json::parse(outcome.result);
    const Json& dots = report.at("dots");
    job.placed = dots.at("placed").get<std::uint64_t>();
    job.exposed = job.dry_run ? dots.value("exposed", std::uint64_t{0}) : 0;
    job.skipped = 0;
    for (const auto& [reason, count] : dots.at("skipped").items()) job.skipped += count.get<std::uint64_t>();
    if (job.skipped + job.exposed > job.placed) throw std::runtime_error("the counts of the report do not add up");
    job.planned_s =
        report.contains("time_s") && report["time_s"].is_object() ? report["time_s"].value("total", 0.) : 0.;
  } catch (const std::exception& error) {
    return fail_planning(job, {"report.json", std::string("the pipeline's report can't be used: ") + error.what()});
  }
  job.state = job.dry_run ? JobState::kDone : JobState::kReady;
  job.progress = job.dry_run ? 1 : 0;
  job.stage.clear();
  if (!job.dry_run) job.eta_s = job.planned_s * description_.simulation.time_scale;
  changed(job);
  end_planning();
}

void JobBook::fail_planning(Job& job, JobError error) {
  job.state = JobState::kFailed;
  job.stage.clear();
  job.error = std::move(error);
  changed(job);
  end_planning();
}

void JobBook::end_planning() {
  planning_.reset();
  plan_next();
}

PaintOrder JobBook::paint_order(const Job& job) const {
  return {job.folder, job.model_sha256, job.settings_sha256, false};
}

Job& JobBook::start(const std::string& id) {
  Job& job = get(id);
  if (job.state == JobState::kPaused) forbid(job, "it goes on with job.resume");
  if (job.dry_run) forbid(job, "a dry run is never painted");
  if (job.state != JobState::kReady) forbid(job, "only a ready job can be started");
  begin_run(job, false);
  return job;
}

Job& JobBook::resume(const std::string& id, bool exposes_in_doubt) {
  Job& job = get(id);
  if (job.state == JobState::kReady) forbid(job, "it begins with job.start");
  if (job.state != JobState::kPaused) forbid(job, "only a paused job can be resumed");
  begin_run(job, exposes_in_doubt);
  return job;
}

void JobBook::begin_run(Job& job, bool exposes_in_doubt) {
  if (run_) forbid(job, "job " + std::to_string(run_->job) + " still holds the cell");
  desk_.begin_painting(std::to_string(job.id));
  thread_.resume();
  run_ = PaintRun{};
  run_->job = job.id;
  run_->number = ++runs_;
  job.state = JobState::kPainting;
  job.stage = "prepare";
  job.error.reset();
  changed(job);
  PaintOrder order = paint_order(job);
  order.exposes_in_doubt = exposes_in_doubt;
  thread_.prepare(std::move(order), [this](const Prepared& prepared) {
    approach(prepared);
    desk_.note_executor_at_rest();
  });
}

/// The way from where the axes really are to the next dot: planned anew by a child, because the daemon knows no mesh.
void JobBook::approach(const Prepared& prepared) {
  Job& job = jobs_.at(run_->job);
  if (prepared.fault) {
    ExecutionResult result;
    result.outcome = thread_.is_stop_latched() ? ExecutionOutcome::kStopped : ExecutionOutcome::kFailed;
    result.reason = prepared.fault->sentence;
    result.is_program_at_fault = prepared.fault->is_program_at_fault;
    return finish_run(result, {job.exposed, job.in_doubt});
  }
  take_tally(job, prepared.tally);
  run_->exposed_before = job.exposed;
  if (thread_.is_stop_latched()) {
    thread_.release();
    return finish_run({ExecutionOutcome::kStopped, "the cell was stopped", false, 0, 0}, prepared.tally);
  }
  if (!prepared.next) return paint({});
  run_->phase = PaintRun::Phase::kApproaching;
  job.stage = "approach";
  changed(job);
  std::string from;
  for (const double value : prepared.from) {
    char text[40];
    std::snprintf(text, sizeof text, "%s%.17g", from.empty() ? "" : ",", value);
    from += text;
  }
  ChildOrder order;
  order.arguments = {"approach",
                     "--model",
                     job.model_copy.string(),
                     "--settings-json",
                     job.settings,
                     "--cell",
                     job.cell,
                     "--program",
                     (job.folder / "program.ply").string(),
                     "--next",
                     std::to_string(*prepared.next),
                     "--from=" + from};
  order.on_end = [this, number = run_->number](ChildOutcome outcome) {
    post_([this, number, outcome = std::move(outcome)] {
      if (!run_ || run_->number != number || run_->phase != PaintRun::Phase::kApproaching) return;
      std::vector<Joints> way;
      std::string why = outcome.error;
      try {
        if (outcome.is_ok) way = Json::parse(outcome.result).at("via").get<std::vector<Joints>>();
      } catch (const Json::exception&) {
        why = "the pipeline gave no way";
      }
      if (why.empty()) return paint(std::move(way));
      thread_.release();
      const Job& stuck = jobs_.at(run_->job);
      finish_run({ExecutionOutcome::kPaused, "no way to the next dot: " + why, false, 0, 0},
                 {stuck.exposed, stuck.in_doubt});
    });
  };
  run_->child = children_.start(std::move(order));
}

void JobBook::paint(std::vector<Joints> way) {
  Job& job = jobs_.at(run_->job);
  run_->phase = PaintRun::Phase::kPainting;
  run_->child.reset();
  run_->begin = std::chrono::steady_clock::now();
  job.stage = "paint";
  changed(job, false);
  thread_.paint(
      std::move(way), [this](std::size_t exposed) { note_progress(exposed); },
      [this](const ExecutionResult& result, const PaintTally& tally) {
        finish_run(result, tally);
        desk_.note_executor_at_rest();
      });
}

void JobBook::note_progress(std::size_t exposed) {
  if (!run_) return;
  Job& job = jobs_.at(run_->job);
  job.exposed = exposed;
  const auto total = static_cast<double>(std::max<std::uint64_t>(job.exposure_count(), 1));
  job.progress = static_cast<double>(exposed) / total;
  // The pace of this run; before it has one, the time model's.
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - run_->begin;
  constexpr std::size_t kPaceDots = 20;
  const auto done = exposed - std::min(exposed, run_->exposed_before);
  const double dot_s = done >= kPaceDots ? elapsed.count() / static_cast<double>(done)
                                         : job.planned_s * description_.simulation.time_scale / total;
  job.eta_s = dot_s * static_cast<double>(job.remaining());
  changed(job, false);
}

void JobBook::take_tally(Job& job, const PaintTally& tally) {
  job.exposed = tally.exposed;
  job.in_doubt = tally.in_doubt;
  job.progress =
      static_cast<double>(job.exposed) / static_cast<double>(std::max<std::uint64_t>(job.exposure_count(), 1));
}

void JobBook::finish_run(const ExecutionResult& result, const PaintTally& tally) {
  Job& job = jobs_.at(run_->job);
  const bool is_cancelled = run_->is_cancelled;
  run_.reset();
  take_tally(job, tally);
  job.stage.clear();
  job.eta_s.reset();
  job.error.reset();
  switch (result.outcome) {
    case ExecutionOutcome::kFinished:
      job.state = JobState::kDone;
      break;
    case ExecutionOutcome::kPaused:
      job.state = is_cancelled ? JobState::kCancelled : JobState::kPaused;
      if (!result.reason.empty()) job.error = JobError{"", result.reason};
      break;
    case ExecutionOutcome::kStopped:
      job.state = is_cancelled ? JobState::kCancelled : JobState::kPaused;
      job.error = JobError{"cell", result.reason};
      break;
    case ExecutionOutcome::kFailed:
      // A cell that fails can be mended and the job goes on; a program that must not run never will.
      job.state = result.is_program_at_fault ? JobState::kFailed
                  : is_cancelled             ? JobState::kCancelled
                                             : JobState::kPaused;
      job.error = JobError{result.is_program_at_fault ? "program.ply" : "cell", result.reason};
      break;
  }
  if (result.outcome == ExecutionOutcome::kFailed && !result.is_program_at_fault)
    desk_.stop(result.reason);
  else
    desk_.end_painting(job.state == JobState::kPaused);
  changed(job);
}

Job& JobBook::pause(const std::string& id) {
  Job& job = get(id);
  if (job.state != JobState::kPainting) forbid(job, "only a job that is being painted can be paused");
  thread_.pause();
  if (leave_approach(ExecutionOutcome::kPaused, "")) return job;
  job.stage = "pausing";
  changed(job, false);
  return job;
}

Job& JobBook::cancel(const std::string& id) {
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

void JobBook::handle_stop() {
  leave_approach(ExecutionOutcome::kStopped, "the cell was stopped");
}

/// While the executor runs, its own end tells how the run ended; while the approach is planned, nothing else would.
/// True if it was.
bool JobBook::leave_approach(ExecutionOutcome outcome, const std::string& reason) {
  if (!run_ || run_->phase != PaintRun::Phase::kApproaching) return false;
  if (run_->child) children_.cancel(*run_->child);
  thread_.release();
  const Job& job = jobs_.at(run_->job);
  finish_run({outcome, reason, false, 0, 0}, {job.exposed, job.in_doubt});
  return true;
}

}  // namespace hilbrush
