#include "daemon/server/job_planning.h"

#include <algorithm>
#include <utility>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "daemon/server/model_copy.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

/// A job's "cell": the daemon's own, or, for a dry run, another shipped one by name.
std::string cell_of(const SubmitOrder& order, const JobSettings& settings, const fs::path& cell_file,
                    const CellDescription& description) {
  if (!order.settings.contains("cell") || settings.cell == description.name) return cell_file.string();
  const auto refuse = [](const std::string& sentence) {
    throw RpcFault{kRpcBadInput, sentence, "$.settings.cell"};
  };
  if (settings.cell.find('/') != std::string::npos || settings.cell.ends_with(".json"))
    refuse("a job names a cell, it does not bring one");
  if (!order.dry_run)
    refuse("this daemon runs cell \"" + description.name + "\"; only a dry run can be for another one");
  return find_cell(settings.cell).string();
}

bool is_same_order(const Job& a, const Job& b) {
  return a.model == b.model && a.settings == b.settings && a.dry_run == b.dry_run && a.copies == b.copies;
}

/// Of its skipped dots, in the words of the plan.
std::string main_cause(const Job& job) {
  const Json plan = Json::parse(job.plan, nullptr, false);
  const Json* causes = plan.is_object() && plan.contains("skipped") ? &plan["skipped"] : nullptr;
  const bool is_known = causes != nullptr && !causes->empty() && causes->front().at("text").is_string();
  return is_known ? causes->front().at("text").get<std::string>() : "report.json names the causes";
}

bool is_unplanned(const Job& job) {
  return job.state == JobState::kQueued || job.state == JobState::kPlanning;
}

}  // namespace

JobPlanning::JobPlanning(JobQueue& queue, const Threads& threads, const CellDescription& description,
                         fs::path cell_file, PostToSocketThread post)
    : queue_(queue),
      children_(threads.children),
      checks_(threads.checks),
      copies_(threads.copies),
      description_(description),
      cell_file_(std::move(cell_file)),
      post_(std::move(post)) {}

Job JobPlanning::requested_job(const SubmitOrder& order, const Peer& peer) const {
  if (!order.model.is_absolute()) throw RpcFault{kRpcBadParams, "must be an absolute path", "$.model"};
  JobSettings settings;
  try {
    settings = job_settings_from_json(order.settings.dump(), "$.settings");
  } catch (const InputError& error) {
    throw RpcFault{kRpcBadInput, error.sentence(), error.at()};
  }
  Job job;
  job.cell = cell_of(order, settings, cell_file_, description_);
  settings.dry_run = order.dry_run;
  job.settings = job_settings_to_json(settings);
  job.settings_sha256 = job_settings_sha256(settings);
  job.model = order.model;
  job.dry_run = order.dry_run;
  job.key = order.key;
  job.uid = peer.uid;
  job.gid = peer.gid;
  job.copies = order.copies;
  if (job.dry_run && job.copies != 1) throw RpcFault{kRpcBadParams, "a dry run has no copies", "$.copies"};
  return job;
}

/// The job that was submitted with the same key. @throws RpcFault if that was another order, or if no further
/// job may wait.
Job* JobPlanning::earlier_job(const Job& job) {
  if (Job* earlier = queue_.find_key(job.key)) {
    if (is_same_order(*earlier, job)) return earlier;
    throw RpcFault{
        kRpcBadParams,
        "belongs to job " + std::to_string(earlier->id) + ", which was submitted with other parameters",
        "$.key"};
  }
  const auto unplanned = std::count_if(queue_.jobs().begin(), queue_.jobs().end(),
                                       [](const auto& entry) { return is_unplanned(entry.second); });
  if (static_cast<std::size_t>(unplanned) >= kUnplannedMax)
    throw RpcFault{kRpcWrongState, std::to_string(kUnplannedMax) + " jobs wait already: cancel one or wait",
                   ""};
  if (queue_.waiting().size() >= JobQueue::kWaitingMax)
    throw RpcFault{kRpcWrongState,
                   std::to_string(JobQueue::kWaitingMax) + " jobs wait to be planned or painted: cancel some",
                   ""};
  return nullptr;
}

void JobPlanning::submit(const SubmitOrder& order, const Peer& peer, const Reply& reply) {
  const Job job = requested_job(order, peer);
  if (const Job* earlier = earlier_job(job)) return reply.result({{"job", job_to_json(*earlier)}});
  // Its own copy of post_: the thread may still call it when this object is gone.
  const auto is_taken = checks_.run([this, post = post_, job, reply](const std::stop_token&) {
    JobError refusal;
    try {
      check_readable(job.model, job.uid, job.gid);
    } catch (const InputError& error) {
      refusal = {error.at(), error.sentence()};
    }
    post([this, job, reply, refusal] {
      try {
        reply.result({{"job", job_to_json(add_checked(job, refusal))}});
      } catch (const RpcFault& fault) {
        reply.fault(fault);
      }
      plan_next();  // after the answer, which is to say "queued"
    });
  });
  if (!is_taken)
    throw RpcFault{
        kRpcWrongState,
        std::to_string(FileThread::kQueueMax) + " models wait to be opened: their file system may not answer",
        ""};
}

Job& JobPlanning::add_checked(const Job& job, const JobError& refusal) {
  if (!refusal.message.empty()) throw RpcFault{kRpcBadInput, refusal.message, refusal.at};
  // Others may have been submitted while the model was opened.
  if (Job* earlier = earlier_job(job)) return *earlier;
  return queue_.add(job);
}

void JobPlanning::cancel(Job& job) {
  const bool was_planning = current_job(job.id) != nullptr;
  if (was_planning) stop_current();
  job.state = JobState::kCancelled;
  job.stage.clear();
  job.eta_s.reset();
  queue_.changed(job);
  if (was_planning) end_current();
}

void JobPlanning::shut_down() {
  is_ending_ = true;
  if (current_) stop_current();
}

void JobPlanning::stop_current() {
  if (current_->child) children_.cancel(*current_->child);
  if (current_->copy) copies_.cancel(*current_->copy);
}

void JobPlanning::plan_next() {
  if (current_ || is_ending_) return;
  const auto waiting = queue_.waiting();
  const auto found = std::find_if(waiting.begin(), waiting.end(),
                                  [](const Job* job) { return job->state == JobState::kQueued; });
  if (found == waiting.end()) return;
  Job& job = *queue_.find((*found)->id);
  current_ = Current{job.id, std::nullopt, std::nullopt};
  job.state = JobState::kPlanning;
  job.progress = 0;
  job.error.reset();
  job.warnings.clear();
  job.plan.clear();
  job.stage = "copy";
  queue_.changed(job);
  std::error_code error;
  fs::create_directories(job.folder, error);
  if (error) return fail(job, {job.folder.string(), "the job's folder cannot be made: " + error.message()});
  if (job.model_copy.empty())
    list_files(job);
  else
    run_pipeline(job);
}

/// The job that is being planned, if it still is.
Job* JobPlanning::current_job(std::int64_t id) {
  return current_ && current_->job == id ? queue_.find(id) : nullptr;
}

/// What all children of the pipeline have in common: their reports are posted to the socket thread, and are
/// ignored there if the job is no longer being planned. Each callback has its own copy of post_, because the
/// children's thread may still call it when this object is gone.
ChildOrder JobPlanning::watched_order(const Job& job, std::vector<std::string> arguments,
                                      std::function<void(Job&, ChildOutcome)> on_end) {
  ChildOrder order;
  order.arguments = std::move(arguments);
  order.on_progress = [this, post = post_, id = job.id](const std::string& stage, double fraction) {
    post([this, id, stage, fraction] {
      if (Job* planned = current_job(id)) {
        planned->stage = stage;
        planned->progress = fraction;
        queue_.progressed(*planned);
      }
    });
  };
  order.on_warning = [this, post = post_, id = job.id](const std::string& sentence) {
    post([this, id, sentence] {
      if (Job* planned = current_job(id); planned && planned->warnings.size() < Job::kWarningsMax)
        planned->warnings.push_back(sentence.substr(0, 1000));
    });
  };
  order.on_end = [this, post = post_, id = job.id, on_end = std::move(on_end)](ChildOutcome outcome) {
    post([this, id, on_end, outcome = std::move(outcome)] {
      if (Job* planned = current_job(id)) on_end(*planned, outcome);
    });
  };
  return order;
}

/// Which files a model refers to is found by reading it, and reading untrusted bytes is a child's work, done
/// with the submitter's rights.
void JobPlanning::list_files(Job& job) {
  ChildOrder order =
      watched_order(job, {"files", "--model", job.model.string()},
                    [this](Job& planned, const ChildOutcome& outcome) { copy_files(planned, outcome); });
  order.owner = ChildOwner{job.uid, job.gid};
  current_->child = children_.start(std::move(order));
}

void JobPlanning::copy_files(Job& job, const ChildOutcome& outcome) {
  current_->child.reset();
  if (!outcome.is_ok) return fail(job, {outcome.error_at, outcome.error});
  std::vector<fs::path> files;
  try {
    const Json result = Json::parse(outcome.result);
    for (const auto& file : result.at("files")) files.emplace_back(file.get<std::string>());
  } catch (const Json::exception&) {
    return fail(job, {"", "the pipeline gave no list of the model's files"});
  }
  current_->copy =
      copies_.run([this, post = post_, id = job.id, model = job.model, folder = job.folder, uid = job.uid,
                   gid = job.gid, files = std::move(files)](const std::stop_token& stop) {
        std::optional<ModelCopy> copy;
        JobError error;
        try {
          copy = copy_model(model, files, folder / "model", uid, gid, stop);
        } catch (const InputError& refusal) {
          error = {refusal.at(), refusal.sentence()};
        } catch (const std::exception& failure) {
          error = {model.string(), std::string("cannot be copied: ") + failure.what()};
        }
        post([this, id, copy, error] {
          Job* planned = current_job(id);
          if (planned == nullptr) return;
          if (!copy) return fail(*planned, error);
          planned->model_copy = copy->model;
          planned->model_sha256 = copy->sha256;
          run_pipeline(*planned);
        });
      });
  if (!current_->copy) fail(job, {"", "the copies of earlier models have not ended"});
}

void JobPlanning::run_pipeline(Job& job) {
  job.stage = "load";
  queue_.changed(job);
  current_->child = children_.start(
      watched_order(job,
                    {job.dry_run ? "dry-run" : "plan", "--model", job.model_copy.string(), "--settings-json",
                     job.settings, "--cell", job.cell, "--output", job.folder.string()},
                    [this](Job& planned, const ChildOutcome& outcome) { finish(planned, outcome); }));
}

void JobPlanning::finish(Job& job, const ChildOutcome& outcome) {
  if (!outcome.is_ok) return fail(job, {outcome.error_at, outcome.error});
  try {
    const Json report = Json::parse(outcome.result);
    const Json& dots = report.at("dots");
    job.placed = dots.at("placed").get<std::uint64_t>();
    job.exposed = job.dry_run ? dots.value("exposed", std::uint64_t{0}) : 0;
    job.skipped = 0;
    for (const auto& [reason, count] : dots.at("skipped").items()) job.skipped += count.get<std::uint64_t>();
    if (job.skipped + job.exposed > job.placed)
      throw std::runtime_error("the counts of the report do not add up");
    job.plan = plan_of_report(report).dump(-1, ' ', false, Json::error_handler_t::replace);
    job.planned_s =
        report.contains("time_s") && report["time_s"].is_object() ? report["time_s"].value("total", 0.) : 0.;
  } catch (const std::exception& error) {
    return fail(job, {"report.json", std::string("the pipeline's report cannot be used: ") + error.what()});
  }
  // A part would be put on the table for nothing.
  if (job.placed > 0 && job.exposure_count() == 0)
    return fail(
        job, {"", "none of the " + std::to_string(job.placed) + " dots can be exposed: " + main_cause(job)});
  job.state = job.dry_run ? JobState::kDone : JobState::kReady;
  job.progress = job.dry_run ? 1 : 0;
  job.stage.clear();
  if (!job.dry_run) job.eta_s = job.planned_s * description_.simulation.time_scale;
  queue_.changed(job);
  end_current();
}

void JobPlanning::fail(Job& job, JobError error) {
  job.state = JobState::kFailed;
  job.stage.clear();
  job.error = std::move(error);
  queue_.changed(job);
  end_current();
}

void JobPlanning::end_current() {
  current_.reset();
  plan_next();
}

}  // namespace hilbrush
