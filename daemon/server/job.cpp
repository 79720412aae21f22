#include "daemon/server/job.h"

#include <algorithm>
#include <array>
#include <ctime>
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

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

bool is_final(JobState state) {
  return state == JobState::kDone || state == JobState::kFailed || state == JobState::kCancelled;
}

bool is_in_queue(JobState state) {
  return state == JobState::kQueued || state == JobState::kPlanning || state == JobState::kReady ||
         state == JobState::kPaused;
}

std::string job_to_record(const Job& job) {
  Json json{{"id", job.id},
            {"key", job.key},
            {"uid", job.uid},
            {"gid", job.gid},
            {"state", job_state_name(job.state)},
            {"model", job.model.string()},
            {"model_copy", job.model_copy.string()},
            {"model_sha256", job.model_sha256},
            {"settings", job.settings},
            {"settings_sha256", job.settings_sha256},
            {"cell", job.cell},
            {"dry_run", job.dry_run},
            {"rank", job.rank},
            {"copies", job.copies},
            {"copies_done", job.copies_done},
            {"is_begun", job.is_begun},
            {"created", job.created},
            {"started", job.started},
            {"ended", job.ended},
            {"placed", job.placed},
            {"skipped", job.skipped},
            {"exposed", job.exposed},
            {"planned_s", job.planned_s},
            {"own_dots", job.own_time.dots},
            {"own_median_s", job.own_time.median_s},
            {"own_p99_s", job.own_time.p99_s},
            {"measured", job.measured},
            {"error_at", job.error ? Json(job.error->at) : Json(nullptr)},
            {"error_message", job.error ? Json(job.error->message) : Json(nullptr)},
            {"warnings", job.warnings},
            {"plan", job.plan}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<Job> job_from_record(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  const auto take = [&](const char* key, auto& value) {
    const auto found = json.find(key);
    if (found == json.end() || found->is_null()) return false;
    try {
      value = found->template get<std::decay_t<decltype(value)>>();
      return true;
    } catch (const Json::exception&) {
      return false;
    }
  };
  const auto take_path = [&](const char* key, std::filesystem::path& path) {
    std::string value;
    if (take(key, value)) path = value;
  };
  Job job;
  std::string state;
  if (!take("id", job.id) || job.id <= 0 || !take("state", state) || !job_state_from_name(state))
    return std::nullopt;
  job.state = *job_state_from_name(state);
  take("key", job.key);
  take("uid", job.uid);
  take("gid", job.gid);
  take_path("model", job.model);
  take_path("model_copy", job.model_copy);
  take("model_sha256", job.model_sha256);
  take("settings", job.settings);
  take("settings_sha256", job.settings_sha256);
  take("cell", job.cell);
  take("dry_run", job.dry_run);
  take("rank", job.rank);
  take("copies", job.copies);
  take("copies_done", job.copies_done);
  take("is_begun", job.is_begun);
  take("created", job.created);
  take("started", job.started);
  take("ended", job.ended);
  take("placed", job.placed);
  take("skipped", job.skipped);
  take("exposed", job.exposed);
  take("planned_s", job.planned_s);
  take("own_dots", job.own_time.dots);
  take("own_median_s", job.own_time.median_s);
  take("own_p99_s", job.own_time.p99_s);
  take("measured", job.measured);
  JobError error;
  take("error_at", error.at);
  if (take("error_message", error.message)) job.error = error;
  take("warnings", job.warnings);
  take("plan", job.plan);
  return job;
}

namespace {

Json text_or_null(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json timing_json(const Job& job) {
  const Job::OwnTime& own = job.own_time;
  if (own.dots == 0) return nullptr;
  Json timing{{"dots", own.dots}, {"own_ms", {{"median", own.median_s * 1e3}, {"p99", own.p99_s * 1e3}}}};
  Json measured = Json::parse(job.measured, nullptr, false);
  if (!measured.is_object()) measured = nullptr;
  for (const char* key : {"moves", "is_enough"}) {  // beside what may be copied into a cell file
    timing[std::string("measured_") + key] =
        measured.is_object() && measured.contains(key) ? measured[key] : nullptr;
    if (measured.is_object()) measured.erase(key);
  }
  timing["measured"] = std::move(measured);
  return timing;
}

}  // namespace

Json plan_of_report(const Json& report) {
  constexpr std::size_t kCausesMax = 8;
  constexpr std::size_t kTextMax = 300;  // bytes
  const auto member = [](const Json& object, const char* key) {
    const auto found = object.find(key);
    return object.is_object() && found != object.end() ? *found : Json(nullptr);
  };
  const auto text = [&](const Json& object) {
    const Json value = member(object, "text");
    return value.is_string() ? Json(value.get<std::string>().substr(0, kTextMax)) : Json(nullptr);
  };
  Json plan;
  const Json mesh = member(report, "mesh");
  for (const char* key : {"size_mm", "min_mm", "max_mm"}) {
    const Json value = member(mesh, key);
    const bool is_vector =
        value.is_array() && value.size() == 3 &&
        std::all_of(value.begin(), value.end(), [](const Json& each) { return each.is_number(); });
    plan[key] = is_vector ? value : Json(nullptr);
  }
  Json causes = Json::array();
  const Json skipped = member(report, "skipped");
  for (std::size_t i = 0; skipped.is_array() && i < std::min(skipped.size(), kCausesMax); ++i)
    if (const Json count = member(skipped[i], "count"); count.is_number())
      causes.push_back({{"count", count}, {"text", text(skipped[i])}});
  plan["skipped"] = std::move(causes);
  plan["suggestion"] = text(member(report, "suggestion"));
  return plan;
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
  json["in_doubt"] = std::vector<std::uint32_t>(job.in_doubt.begin(),
                                                job.in_doubt.begin() + static_cast<std::ptrdiff_t>(listed));
  json["warnings"] = job.warnings;
  const Json plan = Json::parse(job.plan, nullptr, false);
  json["plan"] = plan.is_object() ? plan : Json(nullptr);
  json["model_copy"] = job.model_copy.empty() ? Json(nullptr) : Json(job.model_copy.string());
  const Json settings = Json::parse(job.settings, nullptr, false);
  json["settings"] = settings.is_object() ? settings : Json::object();
  json["created"] = job.created;
  json["started"] = text_or_null(job.started);
  json["ended"] = text_or_null(job.ended);
  json["key"] = text_or_null(job.key);
  json["copies"] = job.copies;
  json["copies_done"] = job.copies_done;
  json["position"] = job.position > 0 ? Json(job.position) : Json(nullptr);
  const bool can_paint = !job.dry_run && (job.state == JobState::kReady || job.state == JobState::kPaused);
  json["needs_part_in_place"] = can_paint && !job.is_part_confirmed;
  json["timing"] = timing_json(job);
  return json;
}

std::size_t job_json_bytes(const Job& job) {
  constexpr std::size_t kKeyBytes = 900;   // of all keys, with their punctuation
  constexpr std::size_t kIndexBytes = 11;  // of a dot in doubt, at most
  std::size_t bytes = kKeyBytes + job.settings.size() + job.plan.size() + job.measured.size() +
                      job.key.size() + job.model.native().size() + job.model_copy.native().size() +
                      job.folder.native().size() +
                      kIndexBytes * std::min(job.in_doubt.size(), kListedInDoubtMax);
  for (const std::string& warning : job.warnings) bytes += warning.size();
  return job.error ? bytes + job.error->at.size() + job.error->message.size() : bytes;
}

}  // namespace hilbrush
