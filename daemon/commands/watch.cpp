#include "daemon/commands/watch.h"

#include <poll.h>

#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/commands/exit_code.h"
#include "daemon/commands/interrupt.h"
#include "daemon/commands/progress_display.h"
#include "daemon/commands/rpc_client.h"
#include "daemon/commands/text_output.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

/// Whether a job in `state` has reached `until` or passed it. Painting and paused may alternate any number of times, so
/// neither is past the other.
bool is_reached(const std::string& state, const std::string& until) {
  const auto rank = [](const std::string& s) {
    if (s == "queued") return 0;
    if (s == "planning") return 1;
    if (s == "ready") return 2;
    if (s == "painting" || s == "paused") return 3;
    if (s == "done") return 4;
    return s == "failed" || s == "cancelled" ? 5 : -1;  // these end every wait
  };
  return state == until || rank(state) > rank(until);
}

bool is_failed(const std::string& state) {
  return state == "failed" || state == "cancelled";
}

/// Blocks until an update of the job or an interrupt.
Json next_update(RpcClient& client, InterruptWatch& interrupts) {
  while (true) {
    while (const auto notification = client.next_notification(RpcClient::Milliseconds(0)))
      if (notification->method == "job.update") return notification->params;
    std::array<pollfd, 2> entries{{{client.descriptor(), POLLIN, 0}, {interrupts.descriptor(), POLLIN, 0}}};
    if (poll(entries.data(), entries.size(), -1) < 0 && errno != EINTR)
      throw ConnectionError("waiting for the daemon failed");
    if (interrupts.take()) throw Interrupted{"no longer watching; the job goes on"};
  }
}

/// Once a job is planned, what its operator should see before painting.
void show_plan(CommandContext& context, ProgressDisplay& display, const Json& job) {
  display.finish();
  context.terminal.err << format_warnings(job) << std::flush;
  context.terminal.out << format_plan(job) << std::flush;
}

bool is_planned(const std::string& state) {
  return state != "queued" && state != "planning";
}

}  // namespace

int watch_job(CommandContext& context, const std::string& id, const std::string& until) {
  InterruptWatch interrupts;
  RpcClient client(context.socket_path);
  ProgressDisplay display(context.terminal, context.is_json);
  Json update = client.call("job.watch", Json{{"id", id}});
  Json job;
  bool is_plan_shown = context.is_json;
  while (true) {
    const Json& named = member(member(update, "job"), "id");
    if ((named.is_string() ? named.get<std::string>() : named.dump()) == id) {
      job = member(update, "job");
      const std::string state = text_field(job, "state");
      if (context.is_json) context.terminal.out << update.dump() << std::endl;
      if (is_planned(state) && !is_plan_shown) {
        is_plan_shown = true;
        show_plan(context, display, job);
      }
      std::string phase = state;
      if (state == "planning") phase.append(", ").append(text_field(job, "stage", "waiting"));
      // In a pipe the line of a stage is printed when the stage begins, so its percentage would always be near 0.
      const bool is_begin = state == "planning" && !context.terminal.out_is_terminal;
      std::string line = "job ";
      line.append(id).append(": ").append(phase);
      display.show(phase, number_field(job, "progress"), is_begin ? line : format_job_line(job), state == "painting");
      if (is_reached(state, until)) break;
    }
    update = next_update(client, interrupts);
  }
  display.finish();
  if (!context.is_json) {
    if (context.terminal.out_is_terminal) context.terminal.out << format_job_line(job) << '\n';
    if (const std::string error = format_job_error(job); !error.empty())
      context.terminal.err << "hilbrush: job " << printable(id) << ": " << error << '\n';
    if (const std::string output = text_field(job, "output"); text_field(job, "state") == "done" && !output.empty())
      context.terminal.out << "results are in " << output << '\n';
  }
  return is_failed(text_field(job, "state")) ? kExitJobFailed : kExitOk;
}

}  // namespace hilbrush
