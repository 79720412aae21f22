#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <istream>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <thread>

#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/rpc_client.h"
#include "daemon/commands/settings_flags.h"
#include "daemon/commands/text_output.h"
#include "daemon/commands/watch.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The daemon copies the model, its textures and inlines before it answers.
constexpr auto kSubmitTimeout = std::chrono::seconds(60);
/// `hilbrush list` shows the newest jobs up to this number.
constexpr std::size_t kListedJobs = 100;

struct JobFlags {
  std::string id;
  std::string model, key;
  bool dry_run = false;
  SettingsFlags settings;
  bool part_in_place = false;
  bool accept_warnings = false;
  bool yes = false;
  std::string in_doubt;
  std::string until = "done";
  int copies = 1;
  int position = 1;
  bool is_queue = false;
};

/// Prints the answer of a method whose result is one job.
int print_job(const CommandContext& context, const Json& result, bool in_full) {
  const Json& job = member(result, "job");
  if (context.is_json)
    context.terminal.out << result.dump() << std::endl;
  else
    context.terminal.out << (in_full ? format_job(job) : format_job_line(job) + "\n") << std::flush;
  return kExitOk;
}

int submit(const CommandContext& context, const JobFlags& flags) {
  std::error_code error;
  if (!fs::exists(flags.model, error)) throw InputError(flags.model, "no such model");
  Json params{{"model", fs::absolute(flags.model).lexically_normal().string()},
              {"settings", Json::parse(flags.settings.to_json())},
              {"dry_run", flags.dry_run}};
  if (!flags.key.empty()) params["key"] = flags.key;
  if (flags.copies != 1) params["copies"] = flags.copies;
  RpcClient client(context.socket_path);
  const Json result = client.call("job.submit", params, kSubmitTimeout);
  const Json& job = member(result, "job");
  if (!context.is_json) {  // of a job that was submitted before with the same key
    context.terminal.err << format_warnings(job) << std::flush;
    context.terminal.out << format_plan(job);
  }
  print_job(context, result, false);
  if (const std::string state = text_field(job, "state");
      !context.is_json && (state == "queued" || state == "planning"))
    context.terminal.out << "`hilbrush watch " << text_field(job, "id")
                         << " --until ready` shows what is planned and its warnings" << std::endl;
  return kExitOk;
}

int list(const CommandContext& context, const JobFlags& flags) {
  RpcClient client(context.socket_path);
  Json params = flags.is_queue ? Json{{"order", "queue"}} : Json();
  Json result = client.call("job.list", params);
  // A page ends before it gets large: the rest of the daemon's default number is asked for.
  while (result.is_object() && member(result, "next").is_string() && result["jobs"].size() < kListedJobs) {
    params["after"] = result["next"];
    params["limit"] = kListedJobs - result["jobs"].size();
    const Json page = client.call("job.list", params);
    for (const Json& job : member(page, "jobs")) result["jobs"].push_back(job);
    result["next"] = member(page, "next");
  }
  if (context.is_json)
    context.terminal.out << result.dump() << std::endl;
  else
    context.terminal.out << format_job_table(result.is_array() ? result : member(result, "jobs"))
                         << std::flush;
  return kExitOk;
}

Json params_of(const JobFlags& flags) {
  return {{"id", flags.id}};
}

int move(const CommandContext& context, const JobFlags& flags) {
  RpcClient client(context.socket_path);
  return print_job(context, client.call("job.move", Json{{"id", flags.id}, {"position", flags.position}}),
                   false);
}

/// On a terminal; elsewhere nothing is asked, and the answer is no.
bool is_confirmed(const CommandContext& context, const std::string& question) {
  if (!context.terminal.in_is_terminal) return false;
  context.terminal.err << question << " [y/N] " << std::flush;
  std::string answer;
  std::getline(context.terminal.in, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

/// Only the operator can see whether the part is there: a flag, or a question on a terminal.
bool is_part_in_place(const CommandContext& context, const JobFlags& flags) {
  return flags.part_in_place ||
         is_confirmed(context, "Is the part of job " + printable(flags.id) + " in place?");
}

/// What was planned with warnings, such as a texture that is missing, spoils a part: the operator accepts
/// them first.
bool are_warnings_accepted(const CommandContext& context, const JobFlags& flags, const Json& job) {
  const std::string warnings = format_warnings(job);
  context.terminal.err << warnings << format_plan(job) << std::flush;
  return warnings.empty() || flags.accept_warnings ||
         is_confirmed(context, "Paint job " + printable(flags.id) + " in spite of its warnings?");
}

int start(const CommandContext& context, const JobFlags& flags) {
  const auto refuse = [&context](const char* why) {
    context.terminal.err << "hilbrush: not started: " << why << '\n';
    return kExitRefused;
  };
  RpcClient client(context.socket_path);
  const Json job = member(client.call("job.get", params_of(flags)), "job");
  if (!are_warnings_accepted(context, flags, job))
    return refuse("give --accept-warnings to paint the job in spite of its warnings");
  if (!is_part_in_place(context, flags)) return refuse("give --part-in-place when the part is on the table");
  return print_job(context, client.call("job.start", Json{{"id", flags.id}, {"part_in_place", true}}), false);
}

/// Asks about the part only if the daemon cannot be sure that it is still in place.
int resume(const CommandContext& context, const JobFlags& flags) {
  Json params{{"id", flags.id}};
  if (!flags.in_doubt.empty()) params["in_doubt"] = flags.in_doubt;
  RpcClient client(context.socket_path);
  const Json job = member(client.call("job.get", params_of(flags)), "job");
  const bool needs_confirmation = member(job, "needs_part_in_place") == true;
  if (needs_confirmation && !is_part_in_place(context, flags)) {
    context.terminal.err << "hilbrush: not resumed: give --part-in-place when the part is where it was\n";
    return kExitRefused;
  }
  if (needs_confirmation || flags.part_in_place) params["part_in_place"] = true;
  return print_job(context, client.call("job.resume", params), false);
}

int get(const CommandContext& context, const JobFlags& flags) {
  RpcClient client(context.socket_path);
  return print_job(context, client.call("job.get", params_of(flags)), true);
}

/// Painting ends between two dots, a moment after it was asked to: the answer waits for it, so that it is the
/// new state.
Json state_after_painting(RpcClient& client, const JobFlags& flags, Json result) {
  constexpr auto kPatience = std::chrono::seconds(30);  // a retract, a pulse and a settling take less
  constexpr auto kPause = std::chrono::milliseconds(50);
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (text_field(member(result, "job"), "state") == "painting" &&
         std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(kPause);
    result = client.call("job.get", params_of(flags));
  }
  return result;
}

int pause(const CommandContext& context, const JobFlags& flags) {
  RpcClient client(context.socket_path);
  return print_job(context, state_after_painting(client, flags, client.call("job.pause", params_of(flags))),
                   false);
}

/// Of a part that is painted in part nothing can be saved: a terminal asks first.
int cancel(const CommandContext& context, const JobFlags& flags) {
  RpcClient client(context.socket_path);
  if (!flags.yes && context.terminal.in_is_terminal) {
    const Json job = member(client.call("job.get", params_of(flags)), "job");
    const std::string state = text_field(job, "state");
    const bool is_begun = state == "painting" || state == "paused";
    const std::string question = format_job_line(job) +
                                 "\nCancelling is final: the part cannot be painted on, as it " +
                                 "can after `hilbrush pause`. Cancel?";
    if (is_begun && !is_confirmed(context, question)) {
      context.terminal.err << "hilbrush: not cancelled\n";
      return kExitRefused;
    }
  }
  return print_job(context, state_after_painting(client, flags, client.call("job.cancel", params_of(flags))),
                   false);
}

using Action = std::function<int(CommandContext&, const JobFlags&)>;

struct Declared {
  CLI::App* app;
  std::shared_ptr<JobFlags> flags;
};

Declared declare(CLI::App& app, CommandContext& context, const char* name, const char* description,
                 Action action) {
  auto flags = std::make_shared<JobFlags>();
  CLI::App* command = add_daemon_command(app, context, name, description);
  command->callback([&context, flags, action = std::move(action)] {
    context.action = [&context, flags, action] { return action(context, *flags); };
  });
  return {command, flags};
}

Declared declare_with_id(CLI::App& app, CommandContext& context, const char* name, const char* description,
                         Action action) {
  Declared declared = declare(app, context, name, description, std::move(action));
  declared.app->add_option("ID", declared.flags->id, "the job's number, see `hilbrush list`")->required();
  return declared;
}

void add_submit(CLI::App& app, CommandContext& context) {
  const Declared command = declare(
      app, context, "submit", "send a model to the daemon, which plans it at once; start paints it", submit);
  command.app->add_option("MODEL", command.flags->model, "VRML, OBJ, PLY, OFF or STL file")->required();
  command.app->add_flag("--dry-run", command.flags->dry_run,
                        "paint on a simulated cell of its own, without start");
  command.app->add_option("--key", command.flags->key,
                          "submitting again with the same key finds the same job");
  command.app
      ->add_option("--copies", command.flags->copies, "paint this many parts, one after another (default 1)")
      ->check(CLI::Range(1, 1000));
  command.flags->settings.add_to(*command.app);
}

void add_watch(CLI::App& app, CommandContext& context) {
  const Declared command = declare_with_id(
      app, context, "watch", "follow a job until it ends",
      [](CommandContext& c, const JobFlags& flags) { return watch_job(c, flags.id, flags.until); });
  command.app
      ->add_option(
          "--until", command.flags->until,
          "stop watching in this state: planning, ready, painting, paused or done (default); part: when this "
          "part of a job of several copies is painted")
      ->check(CLI::IsMember({"planning", "ready", "painting", "paused", "part", "done"}));
}

}  // namespace

void add_job_commands(CLI::App& app, CommandContext& context) {
  add_submit(app, context);
  add_watch(app, context);
  const Declared list_command = declare(app, context, "list", "show all jobs in a table",
                                        [](CommandContext& c, const JobFlags& f) { return list(c, f); });
  list_command.app->add_flag("--queue", list_command.flags->is_queue,
                             "only the waiting jobs, in the order of the queue");
  declare_with_id(app, context, "get", "show everything about one job", get);
  const Declared start_command =
      declare_with_id(app, context, "start", "start painting a job that is ready", start);
  start_command.app->add_flag("--part-in-place", start_command.flags->part_in_place,
                              "confirms that the part is on the table (without it a terminal asks)");
  start_command.app->add_flag("--accept-warnings", start_command.flags->accept_warnings,
                              "paints a job that was planned with warnings (without it a terminal asks)");
  declare_with_id(app, context, "pause", "pause painting after the current dot", pause);
  const Declared resume_command = declare_with_id(app, context, "resume", "continue painting", resume);
  resume_command.app
      ->add_option("--in-doubt", resume_command.flags->in_doubt,
                   "dots that may have been exposed already: leave or expose")
      ->check(CLI::IsMember({"leave", "expose"}));
  resume_command.app->add_flag(
      "--part-in-place", resume_command.flags->part_in_place,
      "confirms that the part is where it was (without it a terminal asks if necessary)");
  const Declared move_command =
      declare_with_id(app, context, "move", "move a waiting job to another position in the queue", move);
  move_command.app->add_option("POSITION", move_command.flags->position, "1: the next to be painted")
      ->required()
      ->check(CLI::Range(1, 1'000'000));
  const Declared cancel_command =
      declare_with_id(app, context, "cancel",
                      "cancel a job for good; its remaining dots are not painted (see pause)", cancel);
  cancel_command.app->add_flag("--yes", cancel_command.flags->yes,
                               "do not ask, even if the job is being painted (without it a terminal asks)");
}

}  // namespace hilbrush
