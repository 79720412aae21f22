#include "daemon/server/job_painting.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sampling/base/text.h"

namespace hilbrush {
namespace {

/// Of the copy that is painted, or comes next.
PaintOrder paint_order(const Job& job) {
  PaintOrder order;
  order.folder = job.folder;
  order.model_sha256 = job.model_sha256;
  order.settings_sha256 = job.settings_sha256;
  order.copy = std::min(job.copies_done + 1, job.copies);
  order.may_create_journal = !job.is_begun && job.state != JobState::kDone;
  return order;
}

double fraction_exposed(const Job& job) {
  return static_cast<double>(job.exposed) /
         static_cast<double>(std::max<std::uint64_t>(job.exposure_count(), 1));
}

void take_tally(Job& job, const PaintTally& tally) {
  job.exposed = tally.exposed;
  job.in_doubt = tally.in_doubt;
  job.progress = fraction_exposed(job);
}

/// As a cell file takes it, and the moves that it is from.
std::string measured_text(const MeasuredMotion& motion) {
  const auto rounded = [](double value) { return std::round(1e4 * value) / 1e4; };
  Json factors = Json::object();
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (motion.time_factor[i]) factors[kAxisNames[i]] = rounded(*motion.time_factor[i]);
  Json moves = Json::object();
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (motion.time_factor[i]) moves[kAxisNames[i]] = motion.moves[i];
  return Json{{"move_delay_ms", rounded(1e3 * motion.move_delay_s)},
              {"time_factor", factors},
              {"moves", moves},
              {"is_enough", motion.is_enough()}}
      .dump();
}

void note_motion(Job& job, const MotionTimes& motion) {
  job.motion_times.add(motion);
  if (const auto measured = job.motion_times.measured()) job.measured = measured_text(*measured);
}

/// Whole doubles: the path begins exactly where the axes are.
std::string joints_argument(const Joints& joints) {
  constexpr int kDigits = 17;
  std::string text;
  for (const double value : joints) text += (text.empty() ? "" : ",") + number(value, kDigits);
  return text;
}

/// A cell that fails can be repaired, and the job goes on; a program that must not be run never can be.
JobState state_after(const ExecutionResult& result, bool is_cancelled) {
  if (result.outcome == ExecutionOutcome::kFailed && result.is_program_at_fault) return JobState::kFailed;
  return is_cancelled ? JobState::kCancelled : JobState::kPaused;
}

std::optional<JobError> error_after(const ExecutionResult& result, const std::string& why_stopped) {
  switch (result.outcome) {
    case ExecutionOutcome::kFinished:
      break;
    case ExecutionOutcome::kPaused:
      if (!result.reason.empty()) return JobError{"", result.reason};
      break;
    case ExecutionOutcome::kStopped:
      return JobError{"cell", "the cell was stopped: " + why_stopped};
    case ExecutionOutcome::kFailed:
      return JobError{result.is_program_at_fault ? "program.ply" : "cell", result.reason};
  }
  return std::nullopt;
}

}  // namespace

JobPainting::JobPainting(JobQueue& queue, CellController& controller, CellThread& thread,
                         PipelineChildren& children, const CellDescription& description,
                         PostToSocketThread post)
    : queue_(queue),
      controller_(controller),
      thread_(thread),
      children_(children),
      description_(description),
      post_(std::move(post)) {
  controller_.on_stop = [this] { handle_stop(); };
}

void JobPainting::restore() {
  for (auto& [id, job] : queue_.jobs()) {
    if (job.dry_run) continue;
    // The journal on the disk is newer than what a power cut has left in the store.
    const bool has_journal = std::filesystem::exists(copy_file(paint_order(job), "journal", ""));
    const bool was_begun = std::exchange(job.is_begun, job.is_begun || has_journal);
    if (!job.is_begun) continue;
    const bool was_ready = job.state == JobState::kReady;
    if (was_ready) job.state = JobState::kPaused;
    if (was_ready || !was_begun) queue_.keep(job);
    if (job.state == JobState::kPaused || job.state == JobState::kDone) to_inspect_.push_back(id);
  }
  inspect_next();
}

Job& JobPainting::start(const std::string& id) {
  Job& job = queue_.get(id);
  if (job.state == JobState::kPaused) forbid(job, "it goes on with job.resume");
  if (job.dry_run) forbid(job, "a dry run is never painted");
  if (job.state != JobState::kReady) forbid(job, "only a ready job can be started");
  begin_run(job, false);
  return job;
}

Job& JobPainting::resume(const std::string& id, bool exposes_in_doubt, bool is_part_in_place) {
  Job& job = queue_.get(id);
  if (job.state == JobState::kReady) forbid(job, "it begins with job.start");
  if (job.state != JobState::kPaused) forbid(job, "only a paused job can be resumed");
  if (!job.is_part_confirmed && !is_part_in_place)
    throw RpcFault{
        kRpcWrongState,
        "job " + std::to_string(job.id) +
            " is paused, and since its last run the cell was stopped or the daemon was restarted: confirm "
            "that its part is in its place as before (part_in_place)",
        "$.part_in_place"};
  begin_run(job, exposes_in_doubt);
  return job;
}

Job& JobPainting::pause(const std::string& id) {
  Job& job = queue_.get(id);
  if (job.state == JobState::kPaused) return job;  // repeated, it does nothing
  if (job.state != JobState::kPainting) forbid(job, "only a job that is being painted can be paused");
  thread_.pause();
  if (leave_approach(ExecutionOutcome::kPaused, "")) return job;
  job.stage = "pausing";
  queue_.progressed(job);
  return job;
}

void JobPainting::cancel(Job& job) {
  run_->is_cancelled = true;
  thread_.pause();
  if (leave_approach(ExecutionOutcome::kPaused, "")) return;
  job.stage = "cancelling";
  queue_.progressed(job);
}

void JobPainting::begin_run(Job& job, bool exposes_in_doubt) {
  if (run_) forbid(job, "job " + std::to_string(run_->job) + " still holds the cell");
  controller_.begin_painting(std::to_string(job.id));
  job.is_part_confirmed = true;
  if (job.started.empty()) job.started = utc_now();
  thread_.resume();
  run_ = Run{};
  run_->job = job.id;
  run_->number = ++runs_;
  job.state = JobState::kPainting;
  job.stage = "prepare";
  job.error.reset();
  queue_.changed(job);
  PaintOrder order = paint_order(job);
  order.exposes_in_doubt = exposes_in_doubt;
  thread_.prepare(std::move(order), [this](const Prepared& prepared) {
    approach(prepared);
    controller_.note_executor_at_rest();
  });
}

void JobPainting::approach(const Prepared& prepared) {
  Job& job = *queue_.find(run_->job);
  if (prepared.fault && prepared.fault->is_for_another_cell) return keep_for_its_cell(job, *prepared.fault);
  if (prepared.fault)
    return end_run_before_painting(
        thread_.is_stop_latched() ? ExecutionOutcome::kStopped : ExecutionOutcome::kFailed, *prepared.fault);
  job.is_begun = true;  // stored before the first dot
  take_tally(job, prepared.tally);
  queue_.changed(job);
  run_->exposed_before = job.exposed;
  if (thread_.is_stop_latched()) {
    thread_.release();
    return end_run_before_painting(ExecutionOutcome::kStopped, {"the cell was stopped"});
  }
  if (prepared.next)
    plan_approach(job, *prepared.next, prepared.from);
  else
    paint({});
}

/// The path from where the axes really are to the next dot: planned by a child, because the daemon has no
/// mesh.
void JobPainting::plan_approach(Job& job, std::size_t next, const Joints& from) {
  run_->phase = Run::Phase::kApproaching;
  job.stage = "approach";
  queue_.changed(job);
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
                     std::to_string(next),
                     "--from=" + joints_argument(from)};
  // Its own copy of post_: the children's thread may still call it when this object is gone.
  order.on_end = [this, post = post_, number = run_->number](ChildOutcome outcome) {
    post([this, number, outcome = std::move(outcome)] {
      if (run_ && run_->number == number && run_->phase == Run::Phase::kApproaching) finish_approach(outcome);
    });
  };
  run_->child = children_.start(std::move(order));
}

void JobPainting::finish_approach(const ChildOutcome& outcome) {
  std::vector<Joints> path;
  std::string why = outcome.error;
  try {
    if (outcome.is_ok) path = Json::parse(outcome.result).at("via").get<std::vector<Joints>>();
  } catch (const Json::exception&) {
    why = "the pipeline's result holds no path";
  }
  if (why.empty()) return paint(std::move(path));
  thread_.release();
  end_run_before_painting(ExecutionOutcome::kPaused, {"no path to the next dot: " + why});
}

void JobPainting::paint(std::vector<Joints> approach) {
  Job& job = *queue_.find(run_->job);
  run_->phase = Run::Phase::kPainting;
  run_->child.reset();
  run_->begin = std::chrono::steady_clock::now();
  job.stage = "paint";
  queue_.progressed(job);
  thread_.paint(
      std::move(approach), [this](std::size_t exposed) { note_progress(exposed); },
      [this](const ExecutionResult& result, const PaintTally& tally) {
        finish_run(result, tally);
        controller_.note_executor_at_rest();
      });
}

void JobPainting::note_progress(std::size_t exposed) {
  if (!run_) return;
  Job& job = *queue_.find(run_->job);
  job.exposed = exposed;
  job.progress = fraction_exposed(job);
  // The pace of this run; before it has one, the time model's.
  constexpr std::size_t kPaceDots = 20;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - run_->begin;
  const auto total = static_cast<double>(std::max<std::uint64_t>(job.exposure_count(), 1));
  const auto done = exposed - std::min(exposed, run_->exposed_before);
  const double dot_s = done >= kPaceDots ? elapsed.count() / static_cast<double>(done)
                                         : job.planned_s * description_.simulation.time_scale / total;
  job.eta_s = dot_s * static_cast<double>(job.remaining());
  queue_.progressed(job);
}

void JobPainting::note_own_time(Job& job, const DurationHistogram& own_time) const {
  job.own_times.add(own_time);
  if (own_time.count() == 0) return;
  const double scale = description_.simulation.time_scale;
  job.own_time.dots = job.own_times.count();
  job.own_time.median_s = job.own_times.quantile_s(.5) * scale;
  job.own_time.p99_s = job.own_times.quantile_s(.99) * scale;
}

/// After each copy but the last the job waits for its next part.
void JobPainting::finish_copy(Job& job) const {
  ++job.copies_done;
  if (job.copies_done >= job.copies) {
    job.state = JobState::kDone;
    return;
  }
  if (!job.in_doubt.empty() && job.warnings.size() < Job::kWarningsMax)
    job.warnings.push_back("copy " + std::to_string(job.copies_done) + " is done except for " +
                           std::to_string(job.in_doubt.size()) + " dots in doubt");
  job.state = JobState::kReady;
  job.is_begun = false;
  job.is_part_confirmed = false;
  job.exposed = 0;
  job.in_doubt.clear();
  job.progress = 0;
  job.eta_s = job.planned_s * description_.simulation.time_scale;
}

void JobPainting::finish_run(const ExecutionResult& result, const PaintTally& tally) {
  Job& job = *queue_.find(run_->job);
  const bool is_cancelled = run_->is_cancelled;
  run_.reset();
  take_tally(job, tally);
  job.stage.clear();
  job.eta_s.reset();
  job.error.reset();
  note_own_time(job, result.own_time);
  note_motion(job, result.motion);
  const bool has_cell_failed = result.outcome == ExecutionOutcome::kFailed && !result.is_program_at_fault;
  if (result.outcome == ExecutionOutcome::kFinished) {
    finish_copy(job);
  } else {
    job.state = state_after(result, is_cancelled);
    job.error = error_after(result, controller_.reason());
  }
  if (has_cell_failed)
    controller_.stop(result.reason);
  else
    controller_.end_painting(job.state == JobState::kPaused);
  queue_.changed(job);
}

/// A run that ends before its first dot.
void JobPainting::end_run_before_painting(ExecutionOutcome outcome, const CellFault& why) {
  ExecutionResult result;
  result.outcome = outcome;
  result.reason = why.sentence;
  result.is_program_at_fault = why.is_program_at_fault;
  const Job& job = *queue_.find(run_->job);
  finish_run(result, {job.exposed, job.in_doubt});
}

/// The job stays what it was, for a daemon with its cell; a cancel is carried out.
void JobPainting::keep_for_its_cell(Job& job, const CellFault& why) {
  const bool is_cancelled = run_->is_cancelled;
  run_.reset();
  job.stage.clear();
  job.state = is_cancelled ? JobState::kCancelled : job.is_begun ? JobState::kPaused : JobState::kReady;
  if (!is_cancelled) job.error = JobError{"program.ply", why.sentence};
  controller_.end_painting(job.state == JobState::kPaused);
  queue_.changed(job);
}

void JobPainting::handle_stop() {
  for (auto& [id, job] : queue_.jobs()) job.is_part_confirmed = false;
  leave_approach(ExecutionOutcome::kStopped, "the cell was stopped");
}

/// While the executor runs, its result ends the run. While the approach is planned, the executor has nothing
/// to end, so the run ends here. @return false in all other phases.
bool JobPainting::leave_approach(ExecutionOutcome outcome, const std::string& reason) {
  if (!run_ || run_->phase != Run::Phase::kApproaching) return false;
  if (run_->child) children_.cancel(*run_->child);
  thread_.release();
  end_run_before_painting(outcome, {reason});
  return true;
}

/// Journals are read one job at a time: the executor's thread has a short queue.
void JobPainting::inspect_next() {
  // Jobs that end in the meantime may have pushed one out of the history.
  while (!to_inspect_.empty() && queue_.find(to_inspect_.back()) == nullptr) to_inspect_.pop_back();
  if (to_inspect_.empty() || is_ending_) return;
  const std::int64_t id = to_inspect_.back();
  to_inspect_.pop_back();
  thread_.inspect(paint_order(*queue_.find(id)), [this, id](std::optional<PaintTally> tally) {
    Job* job = queue_.find(id);
    if (tally && job && (job->state == JobState::kPaused || job->state == JobState::kDone)) {
      take_tally(*job, *tally);
      queue_.changed(*job);
    }
    controller_.note_executor_at_rest();
    inspect_next();
  });
}

}  // namespace hilbrush
