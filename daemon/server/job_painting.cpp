#include <algorithm>
#include <chrono>
#include <cmath>

#include "daemon/server/job_queue.h"

/// The part of JobQueue that paints: prepare (program and journal are read), approach (the way is planned by a child),
/// paint, and what becomes of the job afterwards. One job at a time.
namespace hilbrush {

PaintOrder JobQueue::paint_order(const Job& job) const {
  return {job.folder,
          job.model_sha256,
          job.settings_sha256,
          std::min(job.copies_done + 1, job.copies),
          !job.is_begun && job.state != JobState::kDone,
          false};
}

void JobQueue::begin_run(Job& job, bool exposes_in_doubt) {
  if (run_) forbid(job, "job " + std::to_string(run_->job) + " still holds the cell");
  desk_.begin_painting(std::to_string(job.id));
  job.is_part_confirmed = true;
  if (job.started.empty()) job.started = utc_now();
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
void JobQueue::approach(const Prepared& prepared) {
  Job& job = jobs_.at(run_->job);
  if (prepared.fault) {
    ExecutionResult result;
    result.outcome = thread_.is_stop_latched() ? ExecutionOutcome::kStopped : ExecutionOutcome::kFailed;
    result.reason = prepared.fault->sentence;
    result.is_program_at_fault = prepared.fault->is_program_at_fault;
    return finish_run(result, {job.exposed, job.in_doubt});
  }
  job.is_begun = true;  // stored before the first dot
  take_tally(job, prepared.tally);
  changed(job);
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

void JobQueue::paint(std::vector<Joints> way) {
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

void JobQueue::note_progress(std::size_t exposed) {
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

void JobQueue::take_tally(Job& job, const PaintTally& tally) {
  job.exposed = tally.exposed;
  job.in_doubt = tally.in_doubt;
  job.progress =
      static_cast<double>(job.exposed) / static_cast<double>(std::max<std::uint64_t>(job.exposure_count(), 1));
}

void JobQueue::note_own_time(Job& job, const DurationHistogram& own_time) {
  job.own_times.add(own_time);
  const double scale = description_.simulation.time_scale;
  if (own_time.count() > 0)
    job.own_time = {job.own_times.count(), job.own_times.quantile_s(.5) * scale, job.own_times.quantile_s(.99) * scale};
}

namespace {

/// As a cell file takes it.
std::string measured_text(const MeasuredMotion& motion) {
  const auto rounded = [](double value) { return std::round(1e4 * value) / 1e4; };
  Json factors = Json::object();
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (motion.time_factor[i]) factors[kAxisNames[i]] = rounded(*motion.time_factor[i]);
  return Json{{"move_delay_ms", rounded(1e3 * motion.move_delay_s)}, {"time_factor", factors}}.dump();
}

}  // namespace

void JobQueue::note_motion(Job& job, const MotionTimes& motion) {
  job.motion_times.add(motion);
  if (const auto measured = job.motion_times.measured()) job.measured = measured_text(*measured);
}

/// After each copy but the last the job waits for its next part.
void JobQueue::finish_copy(Job& job) {
  ++job.copies_done;
  if (job.copies_done >= job.copies) {
    job.state = JobState::kDone;
    return;
  }
  if (!job.in_doubt.empty() && job.warnings.size() < Job::kWarningsMax)
    job.warnings.push_back("copy " + std::to_string(job.copies_done) + " is done but for " +
                           std::to_string(job.in_doubt.size()) + " dots in doubt");
  job.state = JobState::kReady;
  job.is_begun = false;
  job.is_part_confirmed = false;
  job.exposed = 0;
  job.in_doubt.clear();
  job.progress = 0;
  job.eta_s = job.planned_s * description_.simulation.time_scale;
}

void JobQueue::finish_run(const ExecutionResult& result, const PaintTally& tally) {
  Job& job = jobs_.at(run_->job);
  const bool is_cancelled = run_->is_cancelled;
  run_.reset();
  take_tally(job, tally);
  job.stage.clear();
  job.eta_s.reset();
  job.error.reset();
  note_own_time(job, result.own_time);
  note_motion(job, result.motion);
  switch (result.outcome) {
    case ExecutionOutcome::kFinished:
      finish_copy(job);
      break;
    case ExecutionOutcome::kPaused:
      job.state = is_cancelled ? JobState::kCancelled : JobState::kPaused;
      if (!result.reason.empty()) job.error = JobError{"", result.reason};
      break;
    case ExecutionOutcome::kStopped:
      job.state = is_cancelled ? JobState::kCancelled : JobState::kPaused;
      job.error = JobError{"cell", "the cell was stopped: " + desk_.reason()};
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

void JobQueue::handle_stop() {
  for (auto& [id, job] : jobs_) job.is_part_confirmed = false;
  leave_approach(ExecutionOutcome::kStopped, "the cell was stopped");
}

/// While the executor runs, its own end tells how the run ended; while the approach is planned, nothing else would.
/// True if it was.
bool JobQueue::leave_approach(ExecutionOutcome outcome, const std::string& reason) {
  if (!run_ || run_->phase != PaintRun::Phase::kApproaching) return false;
  if (run_->child) children_.cancel(*run_->child);
  thread_.release();
  const Job& job = jobs_.at(run_->job);
  finish_run({outcome, reason, false, 0, 0}, {job.exposed, job.in_doubt});
  return true;
}

/// What the journals say, one job at a time: the executor's thread has a short queue.
void JobQueue::inspect_next() {
  // Jobs that end in the meantime may have pushed one out of the history.
  while (!to_inspect_.empty() && !jobs_.contains(to_inspect_.back())) to_inspect_.pop_back();
  if (to_inspect_.empty() || is_ending_) return;
  const std::int64_t id = to_inspect_.back();
  to_inspect_.pop_back();
  thread_.inspect(paint_order(jobs_.at(id)), [this, id](std::optional<PaintTally> tally) {
    const auto found = jobs_.find(id);
    const bool is_kept = found != jobs_.end();
    if (tally && is_kept && (found->second.state == JobState::kPaused || found->second.state == JobState::kDone)) {
      take_tally(found->second, *tally);
      changed(found->second);
    }
    desk_.note_executor_at_rest();
    inspect_next();
  });
}

}  // namespace hilbrush
