#include <filesystem>

#include "daemon/server/job_queue.h"
#include "daemon/server/model_copy.h"
#include "sampling/base/input_error.h"

/// The part of JobQueue that plans: a job's files are listed, copied and planned by children, one job at a time.
namespace hilbrush {

namespace fs = std::filesystem;

void JobQueue::plan_next() {
  if (planning_ || is_ending_) return;
  const auto waiting = queue();
  const auto found =
      std::find_if(waiting.begin(), waiting.end(), [](const Job* job) { return job->state == JobState::kQueued; });
  if (found == waiting.end()) return;
  Job& job = jobs_.at((*found)->id);
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
Job* JobQueue::planned_job(std::int64_t id) {
  return planning_ && planning_->job == id ? &jobs_.at(id) : nullptr;
}

/// What all children of the pipeline have in common: the callbacks come home to the socket thread and find the job
/// still being planned, or do nothing.
ChildOrder JobQueue::watched_order(const Job& job, std::vector<std::string> arguments,
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
void JobQueue::list_files(Job& job) {
  ChildOrder order = watched_order(job, {"files", "--model", job.model.string()},
                                   [this](Job& planned, const ChildOutcome& outcome) { copy_files(planned, outcome); });
  order.owner = ChildOwner{job.uid, job.gid};
  planning_->child = children_.start(std::move(order));
}

void JobQueue::copy_files(Job& job, const ChildOutcome& outcome) {
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

void JobQueue::run_pipeline(Job& job) {
  job.stage = "load";
  changed(job);
  planning_->child = children_.start(
      watched_order(job,
                    {job.dry_run ? "dry-run" : "plan", "--model", job.model_copy.string(), "--settings-json",
                     job.settings, "--cell", job.cell, "--output", job.folder.string()},
                    [this](Job& planned, const ChildOutcome& outcome) { finish_pipeline(planned, outcome); }));
}

void JobQueue::finish_pipeline(Job& job, const ChildOutcome& outcome) {
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

void JobQueue::fail_planning(Job& job, JobError error) {
  job.state = JobState::kFailed;
  job.stage.clear();
  job.error = std::move(error);
  changed(job);
  end_planning();
}

void JobQueue::end_planning() {
  planning_.reset();
  plan_next();
}

}  // namespace hilbrush
