#include "daemon/server/method_table.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

constexpr const char* kSessionOpen = "session.open";
constexpr std::size_t kPageBytes = std::size_t{1} << 18;  // of a list, about: some milliseconds' work

Json object_schema(Json properties, std::vector<std::string> required) {
  return {{"type", "object"},
          {"properties", std::move(properties)},
          {"required", std::move(required)},
          {"additionalProperties", false}};
}

Json no_params() {
  return object_schema(Json::object(), {});
}

Json id_schema() {
  return {{"type", "string"}, {"minLength", 1}, {"maxLength", 40}, {"description", "the job's id"}};
}

Json job_params() {
  return object_schema({{"id", id_schema()}}, {"id"});
}

/// Schemas of results stand in components.schemas of the OpenRPC document.
Json reference(const char* name) {
  return {{"$ref", std::string("#/components/schemas/") + name}};
}

Json result_with(const char* key, Json schema) {
  return {{"type", "object"}, {"properties", {{key, std::move(schema)}}}, {"required", {key}}};
}

Json typed(const char* type, const char* description) {
  return {{"type", type}, {"description", description}};
}

Json nullable(const char* type, const char* description) {
  return {{"type", {type, "null"}}, {"description", description}};
}

Json job_schema() {
  Json states = Json::array();
  for (const auto state : {JobState::kQueued, JobState::kPlanning, JobState::kReady, JobState::kPainting,
                           JobState::kPaused, JobState::kDone, JobState::kFailed, JobState::kCancelled})
    states.push_back(job_state_name(state));
  const Json count = {{"type", "integer"}, {"minimum", 0}};
  Json properties = {
      {"id", typed("string", "identifies the job")},
      {"state", {{"type", "string"}, {"enum", states}}},
      {"model", typed("string", "as submitted")},
      {"dry_run", typed("boolean", "computed only: opens no device")},
      {"dots",
       {{"type", "object"},
        {"properties",
         {{"placed", count},
          {"exposed", count},
          {"in_doubt", count},
          {"remaining", count},
          {"skipped", count}}},
        {"description", "placed = exposed + in_doubt + remaining + skipped"}}},
      {"stage", nullable("string", "what is being done")},
      {"progress", typed("number", "0 to 1: of the stage while planning, of the dots while painting")},
      {"eta_s", nullable("number", "seconds of painting left")},
      {"output", typed("string", "the job's folder")},
      {"error",
       {{"type", {"object", "null"}},
        {"properties", {{"at", {{"type", "string"}}}, {"message", {{"type", "string"}}}}}}},
      {"in_doubt", typed("array", "indices of the dots that may have been exposed, at most 1000")},
      {"warnings", typed("array", "sentences of the pipeline")},
      {"plan",
       nullable("object",
                "once planned: size_mm, min_mm, max_mm of the object as it stands on the post, the causes of "
                "skipped dots with count and text, and the suggestion or null")},
      {"model_copy", nullable("string", "the model in the job's folder")},
      {"settings", typed("object", "all settings, defaults filled in")},
      {"created", typed("string", "ISO 8601, UTC")},
      {"started", nullable("string", "when it was first painted")},
      {"ended", nullable("string", "when it came to its end")},
      {"key", nullable("string", "idempotency key")},
      {"copies", typed("integer", "parts to paint; dots are those of the present one")},
      {"copies_done", typed("integer", "parts that are painted")},
      {"position", nullable("integer", "place in the queue, from 1")},
      {"needs_part_in_place",
       typed("boolean", "job.start or job.resume must confirm that the part is in its place")},
      {"timing", nullable("object",
                          "the time that Hilbrush itself adds to each dot: dots counted, own_ms median, p99; "
                          "and what the moves "
                          "took, measured, as it may stand in a cell file, with measured_moves that each "
                          "factor is from, and "
                          "measured_is_enough: false if these are too few for a cell file")}};
  return {{"type", "object"}, {"properties", std::move(properties)}};
}

Json cell_schema() {
  return {
      {"type", "object"},
      {"properties",
       {{"state",
         {{"type", "string"},
          {"enum", {"stopped", "clearing", "idle", "arming", "armed", "homing", "painting"}}}},
        {"laser", {{"type", "string"}, {"enum", {"off", "on", "unconfirmed"}}}},
        {"interlock", {{"type", "string"}, {"enum", {"closed", "open"}}}},
        {"job", nullable("string", "the job that is being painted")},
        {"reason", nullable("string", "why the cell is stopped")},
        {"joints", typed("object", "measured; the unit is in the key")},
        {"devices", typed("object", "state and fault of each device")},
        {"name", typed("string", "of the cell file")},
        {"sha256", typed("string", "of the cell file")},
        {"simulated", typed("boolean", "no real device moves")},
        {"time_scale", typed("number", "wall seconds of one simulated second; 0: as fast as possible")}}}};
}

std::string id_of(const Json& params) {
  return params.at("id").get<std::string>();
}

/// Ends with `limit` jobs or when the page gets large, and says where the next one begins.
Json page_of(const std::vector<const Job*>& jobs, const Job* after, std::size_t limit) {
  auto next = jobs.begin();
  if (after != nullptr) {
    next = std::find(jobs.begin(), jobs.end(), after);
    if (next == jobs.end()) throw RpcFault{kRpcNoSuchJob, "this job is not in the list any more", "$.after"};
    ++next;
  }
  Json listed = Json::array();
  for (std::size_t bytes = 0; next != jobs.end() && listed.size() < limit && bytes < kPageBytes; ++next) {
    bytes += job_json_bytes(**next);
    listed.push_back(job_to_json(**next));
  }
  const bool has_more = next != jobs.end() && !listed.empty();
  return {{"next", has_more ? Json(std::to_string((*std::prev(next))->id)) : Json(nullptr)},
          {"jobs", std::move(listed)}};
}

Json job_result(const Job& job) {
  return {{"job", job_to_json(job)}};
}

/// A job that is being painted is the executor's; any other is cancelled at once. Repeated, it does nothing.
Job& cancel_job(const Jobs& jobs, const std::string& id) {
  Job& job = jobs.queue.get(id);
  if (job.state == JobState::kCancelled) return job;
  if (is_final(job.state)) forbid(job, "there is nothing to cancel");
  if (job.state == JobState::kPainting)
    jobs.painting.cancel(job);
  else
    jobs.planning.cancel(job);
  return job;
}

}  // namespace

MethodTable::MethodTable(const Jobs& jobs, CellController& controller, AuditLog& audit,
                         std::function<Json()> info)
    : audit_(audit) {
  add_job_acts(jobs);
  add_job_views(jobs.queue);
  add_cell_methods(controller);
  add_system_methods(std::move(info));
  add_session_method();
}

void MethodTable::add_job_acts(const Jobs& jobs) {
  const Json job = result_with("job", reference("Job"));
  const auto add_act = [&](const char* name, const char* summary, Json params,
                           std::function<Job&(const Json&, const Caller&)> act) {
    methods_.push_back({name, summary, true, std::move(params), job,
                        [act = std::move(act)](const Json& given, const Caller& caller, const Reply& reply) {
                          reply.result(job_result(act(given, caller)));
                        }});
  };
  const Json submit_params =
      object_schema({{"model",
                      {{"type", "string"},
                       {"minLength", 1},
                       {"maxLength", 4096},
                       {"description", "absolute path, read with the submitter's rights"}}},
                     {"settings", typed("object", "see the job file: dpi or dots, size_mm or units_mm, ...")},
                     {"dry_run", typed("boolean", "compute the whole job, open no device")},
                     {"key",
                      {{"type", "string"},
                       {"maxLength", 200},
                       {"description", "idempotency key: the same key is the same job"}}},
                     {"copies",
                      {{"type", "integer"},
                       {"minimum", 1},
                       {"maximum", JobPlanning::kCopiesMax},
                       {"description", "parts to paint, one after another; default 1"}}}},
                    {"model"});
  methods_.push_back({"job.submit", "Takes a model; answered when it was found readable, the job is queued.",
                      true, submit_params, job,
                      [jobs](const Json& given, const Caller& caller, const Reply& reply) {
                        jobs.planning.submit(
                            {given.at("model").get<std::string>(), given.value("settings", Json::object()),
                             given.value("dry_run", false), given.value("key", ""), given.value("copies", 1)},
                            caller.peer, reply);
                      }});
  const Json part = {{"const", true}, {"description", "the operator confirms that the part is in its place"}};
  add_act("job.start", "Paints a ready job; the cell must be armed.",
          object_schema({{"id", id_schema()}, {"part_in_place", part}}, {"id", "part_in_place"}),
          [jobs](const Json& given, const Caller&) -> Job& { return jobs.painting.start(id_of(given)); });
  add_act("job.pause", "Ends painting between two dots.", job_params(),
          [jobs](const Json& given, const Caller&) -> Job& { return jobs.painting.pause(id_of(given)); });
  const Json in_doubt = {{"type", "string"},
                         {"enum", {"leave", "expose"}},
                         {"description", "what becomes of the dots in doubt; default: leave"}};
  add_act("job.resume", "Goes on with a paused job; the cell must be armed.",
          object_schema({{"id", id_schema()}, {"part_in_place", part}, {"in_doubt", in_doubt}}, {"id"}),
          [jobs](const Json& given, const Caller&) -> Job& {
            return jobs.painting.resume(id_of(given), given.value("in_doubt", "leave") == "expose",
                                        given.value("part_in_place", false));
          });
  const Json position = {
      {"type", "integer"}, {"minimum", 1}, {"maximum", 1000000}, {"description", "1: the next"}};
  add_act("job.move", "Gives a waiting job another place in the queue.",
          object_schema({{"id", id_schema()}, {"position", position}}, {"id", "position"}),
          [jobs](const Json& given, const Caller&) -> Job& {
            return jobs.queue.move(id_of(given), given.at("position").get<int>());
          });
  add_act("job.cancel", "Gives a job up for good.", job_params(),
          [jobs](const Json& given, const Caller&) -> Job& { return cancel_job(jobs, id_of(given)); });
}

void MethodTable::add_job_views(JobQueue& queue) {
  const Json job = result_with("job", reference("Job"));
  methods_.push_back({"job.get", "One job.", false, job_params(), job,
                      [&queue](const Json& given, const Caller&, const Reply& reply) {
                        reply.result(job_result(queue.get(id_of(given))));
                      }});
  Json page = result_with("jobs", {{"type", "array"}, {"items", reference("Job")}});
  page["properties"]["next"] =
      nullable("string", "the last job of this page, if more follow: they come with it as \"after\"");
  methods_.push_back(
      {"job.list",
       "A page of the jobs, the newest first; or of those that wait, in their order. It ends before it gets "
       "large.",
       false,
       object_schema(
           {{"limit",
             {{"type", "integer"}, {"minimum", 1}, {"maximum", 1000}, {"description", "default 100"}}},
            {"order",
             {{"type", "string"}, {"enum", {"newest", "queue"}}, {"description", "default: newest"}}},
            {"after", id_schema()}},
           {}),
       std::move(page), [&queue](const Json& given, const Caller&, const Reply& reply) {
         std::vector<const Job*> listed;
         if (given.value("order", "newest") == "queue")
           listed = queue.waiting();
         else
           for (auto entry = queue.jobs().rbegin(); entry != queue.jobs().rend(); ++entry)
             listed.push_back(&entry->second);
         const auto after =
             given.contains("after") ? &queue.get(given.at("after").get<std::string>()) : nullptr;
         reply.result(page_of(listed, after, given.value("limit", std::size_t{100})));
       }});
  Json watched = result_with("job", reference("Job"));
  watched["properties"]["seq"] =
      typed("integer",
            "of this state; job.update notifications that follow have higher ones, some may be passed over");
  methods_.push_back({"job.watch",
                      "The job now, and from now on a job.update notification {seq, job} for each change, "
                      "over this connection.",
                      false, job_params(), watched,
                      [&queue](const Json& given, const Caller& caller, const Reply& reply) {
                        const Job& found = queue.get(id_of(given));
                        caller.watch(found.id);
                        reply.result({{"seq", found.seq}, {"job", job_to_json(found)}});
                      }});
  methods_.push_back({"job.unwatch", "No more job.update notifications of this job over this connection.",
                      false, job_params(), job,
                      [&queue](const Json& given, const Caller& caller, const Reply& reply) {
                        const Job& found = queue.get(id_of(given));
                        caller.unwatch(found.id);
                        reply.result(job_result(found));
                      }});
}

void MethodTable::add_cell_methods(CellController& controller) {
  const Json cell = result_with("cell", reference("Cell"));
  methods_.push_back(
      {"cell.status", "The cell's state, laser, interlock, joints and devices.", false, no_params(), cell,
       [&controller](const Json&, const Caller&, const Reply& reply) { reply.result(controller.status()); }});
  methods_.push_back({"cell.stop", "Laser off, axes stopped, at once and latched; a painting job is paused.",
                      true, no_params(), cell, [&controller](const Json&, const Caller& caller, Reply reply) {
                        controller.stop("stopped by " + caller.peer.user, std::move(reply));
                      }});
  methods_.push_back(
      {"cell.clear", "Takes a stop back, if there is one; nothing moves.", true, no_params(), cell,
       [&controller](const Json&, const Caller&, Reply reply) { controller.clear(std::move(reply)); }});
  methods_.push_back(
      {"cell.arm", "Axes ready, laser armed for one job; answered when its start delay is over.", true,
       no_params(), cell,
       [&controller](const Json&, const Caller&, Reply reply) { controller.arm(std::move(reply)); }});
  methods_.push_back({"cell.home",
                      "All axes to their home positions in the dark: up first, then the table, then the arm; "
                      "answered when there.",
                      true, no_params(), cell, [&controller](const Json&, const Caller&, Reply reply) {
                        controller.home(std::move(reply));
                      }});
}

void MethodTable::add_system_methods(std::function<Json()> info) {
  methods_.push_back({"system.info", "The daemon: version, uptime, folders, limits.", false, no_params(),
                      result_with("system", {{"type", "object"}}),
                      [info = std::move(info)](const Json&, const Caller&, const Reply& reply) {
                        reply.result({{"system", info()}});
                      }});
  methods_.push_back({"rpc.discover",
                      "This table as an OpenRPC document.",
                      false,
                      no_params(),
                      {{"type", "object"}},
                      [this](const Json&, const Caller&, const Reply& reply) { reply.result(discover()); }});
}

/// The token itself is never recorded.
void MethodTable::add_session_method() {
  const Json token = {{"type", "string"}, {"minLength", 1}, {"maxLength", 1000}, {"description", "a secret"}};
  methods_.push_back({kSessionOpen, "Says who a connection over TCP is: the first request there.", false,
                      object_schema({{"token", token}}, {"token"}),
                      result_with("user", typed("string", "whose token it is")),
                      [this](const Json& given, const Caller& caller, const Reply& reply) {
                        const auto peer = caller.identify(given.at("token").get<std::string>());
                        if (!peer) {
                          audit_.record_refusal(caller.peer, kSessionOpen);
                          throw RpcFault{kRpcNotPermitted, "this token belongs to no user", "$.token"};
                        }
                        audit_.record(*peer, kSessionOpen, Json::object(), "ok");
                        reply.result({{"user", peer->user}});
                      }});
}

Right Method::right() const {
  if (name == kSessionOpen) return Right::kNone;
  return is_act && name != "cell.stop" ? Right::kOperate : Right::kLook;
}

namespace {

std::optional<RpcFault> missing_right(const Method& method, const Peer& peer) {
  const Right needed = method.right();
  if (needed == Right::kNone || (needed == Right::kLook ? peer.may_look : peer.may_operate))
    return std::nullopt;
  std::string sentence;
  if (peer.user.empty())
    sentence = "this connection has not said who it is: session.open with a token comes first";
  else if (needed == Right::kOperate && peer.may_look)
    sentence = "user " + peer.user + " may look and stop the cell, but not operate it";
  else
    sentence = "user " + peer.user + " may not use this daemon";
  return RpcFault{kRpcNotPermitted, sentence, ""};
}

}  // namespace

const Method* MethodTable::find(const std::string& name) const {
  const auto found =
      std::find_if(methods_.begin(), methods_.end(), [&](const Method& known) { return known.name == name; });
  return found == methods_.end() ? nullptr : &*found;
}

bool MethodTable::is_act(const std::string& name) const {
  const Method* method = find(name);
  return method != nullptr && method->is_act;
}

bool MethodTable::is_open_to_strangers(const std::string& name) const {
  const Method* method = find(name);
  return method != nullptr && method->right() == Right::kNone;
}

void MethodTable::dispatch(const RpcRequest& request, const Caller& caller, Reply reply) const {
  const Method* method = find(request.method);
  if (method == nullptr)
    return reply.fault(
        {kRpcUnknownMethod,
         "there is no method \"" + request.method.substr(0, 60) + "\"; rpc.discover lists them", ""});
  const bool is_stranger = caller.peer.user.empty();  // what they may not do anyway is not worth a line each
  if (method->is_act && !is_stranger) {
    const auto record = [this, peer = caller.peer, name = method->name, params = request.params](
                            const std::string& result) { audit_.record(peer, name, params, result); };
    reply.result = [record, answer = std::exchange(reply.result, {})](Json result) {
      record("ok");
      answer(std::move(result));
    };
    reply.fault = [record, answer = std::exchange(reply.fault, {})](RpcFault fault) {
      record(fault.message);
      answer(std::move(fault));
    };
  }
  if (auto fault = missing_right(*method, caller.peer)) return reply.fault(std::move(*fault));
  try {
    if (auto fault = check_schema(request.params, method->params)) return reply.fault(std::move(*fault));
    method->handler(request.params, caller, reply);
  } catch (const RpcFault& fault) {
    reply.fault(fault);
  } catch (const InputError& error) {
    reply.fault({kRpcBadInput, error.sentence(), error.at()});
  } catch (const std::exception& error) {
    reply.fault({kRpcInternal, std::string("the daemon failed: ") + error.what(), ""});
  }
}

Json MethodTable::discover() const {
  Json methods = Json::array();
  for (const Method& method : methods_) {
    Json params = Json::array();
    const auto& required = method.params.at("required");
    for (const auto& [name, schema] : method.params.at("properties").items())
      params.push_back({{"name", name},
                        {"required", std::find(required.begin(), required.end(), name) != required.end()},
                        {"schema", schema}});
    methods.push_back({{"name", method.name},
                       {"summary", method.summary},
                       {"paramStructure", "by-name"},
                       {"params", std::move(params)},
                       {"result", {{"name", "result"}, {"schema", method.result}}}});
  }
  return {{"openrpc", "1.2.6"},
          {"info", {{"title", "hilbrushd"}, {"version", HILBRUSH_VERSION}}},
          {"methods", std::move(methods)},
          {"components", {{"schemas", {{"Job", job_schema()}, {"Cell", cell_schema()}}}}}};
}

}  // namespace hilbrush
