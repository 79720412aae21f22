#include "daemon/server/job.h"

#include <algorithm>
#include <array>
#include <utility>

namespace hilbrush {
namespace {

constexpr std::array<std::pair<JobState, const char*>, 8> kStateNames{{{JobState::kQueued, "queued"},
                                                                       {JobState::kPlanning, "planning"},
                                                                       {JobState::kReady, "ready"},
                                                                       {JobState::kPainting, "painting"},
                                                                       {JobState::kPaused, "paused"},
                                                                       {JobState::kDone, "done"},
                                                                       {JobState::kFailed, "failed"},
                                                                       {JobState::kCancelled, "cancelled"}}};
constexpr std::size_t kListedInDoubtMax = 1000;

}  // namespace

const char* job_state_name(JobState state) {
  for (const auto& [known, name] : kStateNames)
    if (known == state) return name;
  return "unknown";
}

std::optional<JobState> job_state_from_name(const std::string& name) {
  for (const auto& [state, known] : kStateNames)
    if (known == name) return state;
  return std::nullopt;
}

bool is_final(JobState state) {
  return state == JobState::kDone || state == JobState::kFailed || state == JobState::kCancelled;
}

Json job_to_json(const Job& job) {
  const auto listed = std::min(job.in_doubt.size(), kListedInDoubtMax);
  Json json;
  json["id"] = std::to_string(job.id);
  json["state"] = job_state_name(job.state);
  json["model"] = job.model.string();
  json["dry_run"] = job.dry_run;
  json["dots"] = {{"placed", job.placed},
                  {"exposed", job.exposed},
                  {"in_doubt", job.in_doubt.size()},
                  {"remaining", job.remaining()},
                  {"skipped", job.skipped}};
  json["stage"] = job.stage.empty() ? Json(nullptr) : Json(job.stage);
  json["progress"] = job.progress;
  json["eta_s"] = job.eta_s ? Json(*job.eta_s) : Json(nullptr);
  json["output"] = job.folder.string();
  json["error"] = job.error ? Json{{"at", job.error->at}, {"message", job.error->message}} : Json(nullptr);
  json["in_doubt"] =
      std::vector<std::uint32_t>(job.in_doubt.begin(), job.in_doubt.begin() + static_cast<std::ptrdiff_t>(listed));
  json["warnings"] = job.warnings;
  json["model_copy"] = job.model_copy.empty() ? Json(nullptr) : Json(job.model_copy.string());
  json["settings"] = job.settings.empty() ? Json::object() : Json::parse(job.settings);
  json["created"] = job.created;
  json["key"] = job.key.empty() ? Json(nullptr) : Json(job.key);
  return json;
}

}  // namespace hilbrush
