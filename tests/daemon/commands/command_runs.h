#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "daemon/commands/command_line.h"
#include "tests/support/temporary_folder.h"

/// What the tests of the operator's command share: a daemon that follows a script, and the
/// command with its streams.
namespace hilbrush::commands_test {

using testing_support::TemporaryFolder;

/// One accepted connection, from the daemon's side.
class Peer {
 public:
  explicit Peer(int descriptor) : descriptor_(descriptor) {}
  std::string read_line();  ///< empty at the end
  void write(const std::string& text);
  void write_line(const std::string& text) { write(text + "\n"); }
  /// Blocks until the other side closes.
  void wait_for_close();

 private:
  int descriptor_;
  std::string buffer_;
};

/// Listens on a socket and runs the script on the first connection, in a thread of its own.
class FakeDaemon {
 public:
  explicit FakeDaemon(std::function<void(Peer&)> script);
  ~FakeDaemon();
  FakeDaemon(const FakeDaemon&) = delete;
  FakeDaemon& operator=(const FakeDaemon&) = delete;
  std::string socket_path() const { return (folder_.path() / "socket").string(); }
  /// Waits until the script has ended.
  void finish();

 private:
  TemporaryFolder folder_;
  int listener_ = -1;
  std::thread thread_;
};

/// Answers every request with the same member: "\"result\":{...}".
class AnsweringDaemon {
 public:
  explicit AnsweringDaemon(std::string reply_member);
  std::string socket_path() const { return daemon_.socket_path(); }
  /// What was asked, without the constant members. Call after the command ended.
  std::vector<std::string> requests();

 private:
  std::vector<std::string> requests_;
  FakeDaemon daemon_;
};

struct CommandRun {
  int exit_code = -1;
  std::string out, err;
};
/// Runs `hilbrush` with these arguments; `input`: what the operator types, on a terminal; nothing: standard
/// input is a pipe.
CommandRun run_command(const std::vector<std::string>& arguments, bool is_terminal = false,
                       const char* input = nullptr);

/// For commands that run hilbrush-pipeline: a shell script takes its place.
class ScriptedChild : public testing::Test {
 protected:
  void TearDown() override { unsetenv("HILBRUSH_PIPELINE"); }

  /// $folder is the test's folder.
  void use_child(const std::string& script) {
    const std::string program =
        folder_.write("child", "#!/bin/sh\nfolder='" + folder_.path().string() + "'\n" + script + "\n", true);
    setenv("HILBRUSH_PIPELINE", program.c_str(), 1);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  TemporaryFolder folder_;
};
/// For the script: the child's arguments go to $folder/arguments, one a line.
inline constexpr const char* kKeepArguments =
    "for a in \"$@\"; do echo \"$a\"; done > \"$folder/arguments\"\n";

}  // namespace hilbrush::commands_test
