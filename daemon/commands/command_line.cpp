#include "daemon/commands/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>

#include "config/json_reader.h"
#include "config/rpc_errors.h"
#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/interrupt.h"
#include "daemon/commands/pipeline_run.h"
#include "daemon/commands/rpc_client.h"
#include "daemon/execution/cell_devices.h"
#include "drivers/driver_error.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

constexpr const char* kFooter =
    "Exit codes: 0 done; 1 internal failure; 2 wrong usage; 3 bad input (model, settings, cell, program, "
    "job);\n"
    "4 no daemon answers or the connection was lost; 5 refused in this state; 6 the job failed or was "
    "cancelled, or\n"
    "none of its dots can be exposed; 130 interrupted.";

std::string default_socket() {
  const char* path = std::getenv("HILBRUSH_SOCKET");
  return path != nullptr && *path != '\0' ? path : "/run/hilbrush/hilbrush.sock";
}

int exit_code_of(int rpc_error) {
  switch (rpc_error) {
    case kRpcBadParams:
    case kRpcBadInput:
    case kRpcNoSuchJob:
      return kExitBadInput;
    case kRpcWrongState:
    case kRpcDeviceFault:
    case kRpcNotPermitted:
      return kExitRefused;
    default:
      return kExitInternal;
  }
}

/// Prints the sentence on standard error; with --json also as an object on standard output.
int report_failure(const CommandContext& context, int exit_code, const std::string& at,
                   const std::string& sentence) {
  context.terminal.err << "hilbrush: " << printable(at.empty() ? sentence : at + ": " + sentence)
                       << std::endl;
  if (context.is_json) {
    const nlohmann::ordered_json error{{"error", {{"code", exit_code}, {"message", sentence}, {"at", at}}}};
    context.terminal.out << error.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
                         << std::endl;
  }
  return exit_code;
}

/// Prints what a failed child wrote to its standard error, each line marked as a quotation.
void quote_child(const CommandContext& context, const std::string& child_stderr) {
  for (std::size_t start = 0; start < child_stderr.size();) {
    const std::size_t end = std::min(child_stderr.find('\n', start), child_stderr.size());
    if (end > start)
      context.terminal.err << "  | " << printable(child_stderr.substr(start, end - start)) << '\n';
    start = end + 1;
  }
}

int run_action(const CommandContext& context) {
  try {
    return context.action();
  } catch (const CellHeld& error) {
    return report_failure(context, kExitRefused, error.at(), error.sentence());
  } catch (const DriverError& error) {
    return report_failure(context, kExitRefused, {}, error.what());
  } catch (const InputError& error) {
    return report_failure(context, kExitBadInput, error.at(), error.sentence());
  } catch (const RpcRefusal& error) {
    return report_failure(context, exit_code_of(error.code()), error.at(), error.what());
  } catch (const ConnectionError& error) {
    return report_failure(context, kExitNoDaemon, {}, error.what());
  } catch (const PipelineFailure& error) {
    const int code = report_failure(context, error.exit_code(), error.at(), error.what());
    quote_child(context, error.child_stderr());
    return code;
  } catch (const Interrupted& interrupted) {
    return report_failure(context, kExitInterrupted, {}, interrupted.sentence);
  } catch (const std::exception& error) {
    return report_failure(context, kExitInternal, {}, error.what());
  }
}

}  // namespace

CLI::App* add_command(CLI::App& app, CommandContext& context, const std::string& name,
                      const std::string& description) {
  CLI::App* command = app.add_subcommand(name, description);
  command->add_flag("--json", context.is_json, "print the exact result as JSON");
  command->set_version_flag("--version", "hilbrush " HILBRUSH_VERSION);
  command->footer(kFooter);
  return command;
}

CLI::App* add_daemon_command(CLI::App& app, CommandContext& context, const std::string& name,
                             const std::string& description) {
  CLI::App* command = add_command(app, context, name, description);
  command->add_option(
      "--socket", context.socket_path,
      "the daemon's socket, or tcp://HOST:PORT with a token in $HILBRUSH_TOKEN (default $HILBRUSH_SOCKET, "
      "else /run/hilbrush/hilbrush.sock)");
  return command;
}

namespace {

/// "foo" and "--size" as they would be keys: "foo", "size".
std::string as_key(std::string word) {
  word.erase(0, word.find_first_not_of('-'));
  std::replace(word.begin(), word.end(), '-', '_');
  return word;
}

/// The one of `words` that `word` is probably a misspelling of, or nothing.
std::optional<std::string> nearest_argument(const std::string& word, const std::vector<std::string>& words) {
  std::vector<std::string> keys;
  for (const std::string& each : words) keys.push_back(as_key(each));
  const std::optional<std::string> nearest = nearest_word(as_key(word), keys);
  if (!nearest) return std::nullopt;
  return words[static_cast<std::size_t>(std::find(keys.begin(), keys.end(), *nearest) - keys.begin())];
}

/// For the first argument that is not understood, what was probably meant: "no command foo; did you mean
/// ...?".
std::string unknown_argument_sentence(const CLI::App& app) {
  const std::vector<std::string> unknown = app.remaining(true);
  if (unknown.empty()) return {};
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const bool is_command = chosen.empty() && !unknown.front().starts_with("-");
  if (!is_command && !unknown.front().starts_with("-")) return {};
  const std::string word = unknown.front().substr(0, unknown.front().find('='));
  std::vector<std::string> words;
  if (is_command)
    for (const CLI::App* command : app.get_subcommands({})) words.push_back(command->get_name());
  else
    for (const CLI::Option* option : (chosen.empty() ? app : *chosen.front()).get_options())
      for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
  const std::optional<std::string> meant = nearest_argument(word, words);
  return std::string(is_command ? "no command is called " : "there is no flag ") + word +
         (meant ? "; did you mean " + *meant + "?" : "");
}

int report_usage(const CLI::App& app, const CLI::ParseError& error, Terminal& terminal) {
  const std::string sentence = unknown_argument_sentence(app);
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  terminal.err << "hilbrush: " << printable(sentence.empty() ? error.what() : sentence) << "\nTry hilbrush "
               << (chosen.empty() ? "" : chosen.front()->get_name() + " ") << "--help.\n";
  return kExitUsage;
}

/// `help` and `help COMMAND` are --help and COMMAND --help.
std::vector<std::string> with_help_flag(std::vector<std::string> arguments) {
  if (arguments.empty() || arguments.front() != "help") return arguments;
  arguments.erase(arguments.begin());
  arguments.emplace_back("--help");
  return arguments;
}

/// A full disk or a closed pipe is a failure, too.
int checked_output(const CommandContext& context, int exit_code) {
  if (context.terminal.out.flush() || exit_code != kExitOk) return exit_code;
  context.terminal.err << "hilbrush: standard output cannot be written" << std::endl;
  return kExitInternal;
}

}  // namespace

int run_hilbrush(const std::vector<std::string>& arguments, Terminal& terminal) {
  CommandContext context{terminal, default_socket(), false, {}};
  CLI::App app("Paints pictures on three-dimensional objects with light.", "hilbrush");
  app.set_version_flag("--version", "hilbrush " HILBRUSH_VERSION);
  app.require_subcommand(1);
  app.footer(std::string("`hilbrush COMMAND --help` explains one command.\n") + kFooter);
  try {
    add_pipeline_commands(app, context);
    add_quality_command(app, context);
    add_job_commands(app, context);
    add_cell_commands(app, context);
    add_check_command(app, context);
    add_commissioning_commands(app, context);
    std::vector<std::string> words = with_help_flag(arguments);
    std::reverse(words.begin(), words.end());  // CLI11 takes them from the back
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // help or version was asked for
      app.exit(error, terminal.out, terminal.err);
      return checked_output(context, kExitOk);
    }
    return report_usage(app, error, terminal);
  } catch (const std::exception& error) {
    return report_failure(context, kExitInternal, {}, error.what());
  }
  return checked_output(context, run_action(context));
}

}  // namespace hilbrush
