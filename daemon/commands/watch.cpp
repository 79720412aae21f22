#include "daemon/commands/watch.h"

#include <poll.h>

#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <utility>

#include "daemon/commands/exit_code.h"
#include "daemon/commands/interrupt.h"
#include "daemon/commands/progress_display.h"
#include "daemon/commands/rpc_client.h"
#include "daemon/commands/text_output.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

/// Whether the job has reached `until` or passed it. Painting and paused may alternate any number of times,
/// so neither is past the other; a job of several copies is ready again after each part but the last.
bool is_reached(const Json& job, const std::string& until) {
  const std::string state = text_field(job, "state");
  const auto rank = [](const std::string& s) {
    if (s == "queued") return 0;
    if (s == "planning") return 1;
    if (s == "ready") return 2;
    if (s == "painting" || s == "paused") return 3;
    if (s == "done") return 4;
    return s == "failed" || s == "cancelled" ? 5 : -1;  // these end every wait
  };
  const double parts_done = number_field(job, "copies_done");
  if (until == "part") return rank(state) >= 4 || (state == "ready" && parts_done > 0);
  if (until == "ready" && rank(state) == 3 && parts_done + 1 < number_field(job, "copies")) return false;
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

/// Shows a job's updates as they come.
class JobDisplay {
 public:
  JobDisplay(CommandContext& context, std::string id, std::string until)
      : context_(context),
        id_(std::move(id)),
        until_(std::move(until)),
        bar_(context.terminal, context.is_json) {}

  /// @return whether the job has got where it is watched to.
  bool show(const Json& update) {
    job_ = member(update, "job");
    const std::string state = text_field(job_, "state");
    const bool is_end = is_reached(job_, until_);
    if (context_.is_json) {
      context_.terminal.out << update.dump() << std::endl;
      return is_end;
    }
    if (state != "queued" && state != "planning") show_plan();
    show_progress(state);
    if (state != state_ && !is_end) show_wait(state);
    state_ = state;
    return is_end;
  }

  /// The last words, and the exit code.
  int finish() {
    bar_.finish();
    const std::string state = text_field(job_, "state");
    if (!context_.is_json) {
      if (context_.terminal.out_is_terminal) context_.terminal.out << format_job_line(job_) << '\n';
      // Why a job is paused stands in its line.
      if (const std::string error = format_job_error(job_); state != "paused" && !error.empty())
        context_.terminal.err << "hilbrush: job " << printable(id_) << ": " << error << '\n';
      if (const std::string output = text_field(job_, "output"); state == "done" && !output.empty())
        context_.terminal.out << "results are in " << output << '\n';
    }
    return is_failed(state) ? kExitJobFailed : kExitOk;
  }

 private:
  /// Once, as soon as the job is planned: what its operator should see before painting.
  void show_plan() {
    if (is_plan_shown_) return;
    is_plan_shown_ = true;
    bar_.finish();
    context_.terminal.err << format_warnings(job_) << std::flush;
    context_.terminal.out << format_plan(job_) << std::flush;
  }

  void show_progress(const std::string& state) {
    std::string phase = state;
    if (state == "planning") phase.append(", ").append(text_field(job_, "stage", "waiting"));
    std::string text = format_job_brief(job_);
    if (!context_.terminal.out_is_terminal) {
      // The line of a stage is printed when the stage begins, so its percentage would always be near 0.
      text = state == "planning" ? "job " + id_ + ": " + phase : format_job_line(job_);
    }
    bar_.show(phase, number_field(job_, "progress"), text, state == "painting");
  }

  /// A job that waits for its operator says so, and why it was paused: the bar would stand still without a
  /// word.
  void show_wait(const std::string& state) {
    const std::string wait = format_job_wait(job_);
    if (wait.empty()) return;
    bar_.finish();
    if (context_.terminal.out_is_terminal) context_.terminal.out << format_job_line(job_) << '\n';
    context_.terminal.out << wait << '\n' << std::flush;
    show_progress(state);
  }

  CommandContext& context_;
  std::string id_, until_;
  ProgressDisplay bar_;
  Json job_;
  std::string state_;  ///< of the last update
  bool is_plan_shown_ = false;
};

}  // namespace

int watch_job(CommandContext& context, const std::string& id, const std::string& until) {
  InterruptWatch interrupts;
  RpcClient client(context.socket_path);
  JobDisplay display(context, id, until);
  Json update = client.call("job.watch", Json{{"id", id}});
  while (true) {
    const Json& named = member(member(update, "job"), "id");
    const bool is_mine = (named.is_string() ? named.get<std::string>() : named.dump()) == id;
    if (is_mine && display.show(update)) return display.finish();
    update = next_update(client, interrupts);
  }
}

}  // namespace hilbrush
