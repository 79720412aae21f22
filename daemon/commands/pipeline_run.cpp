#include "daemon/commands/pipeline_run.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "daemon/commands/exit_code.h"
#include "daemon/commands/interrupt.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kLineBytesMax = 64u << 20;
constexpr std::size_t kStderrBytesKept = 8192;
constexpr auto kTerminationTimeout = std::chrono::seconds(3);  ///< between SIGTERM and SIGKILL

/// One end of a pipe, closed with its owner.
class Descriptor {
 public:
  explicit Descriptor(int descriptor = -1) : descriptor_(descriptor) {}
  ~Descriptor() { reset(); }
  Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    reset(std::exchange(other.descriptor_, -1));
    return *this;
  }
  void reset(int descriptor = -1) {
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = descriptor;
  }
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

struct Pipe {
  Descriptor reader, writer;
  Pipe() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0)
      throw std::system_error(errno, std::generic_category(), "no pipe can be made");
    reader.reset(ends[0]);
    writer.reset(ends[1]);
  }
};

/// A running child. The destructor kills its whole process group.
class Child {
 public:
  Child(const std::string& program, const std::vector<std::string>& arguments, int out, int err) {
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "no child process can be made");
    if (pid_ == 0) become(program, argv.data(), out, err, parent);
    setpgid(pid_, pid_);  // in parent and child, so that it is done whichever runs first
  }
  ~Child() {
    if (status_) return;
    kill(-pid_, SIGKILL);
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Returns the wait status; kills the child if it has not ended by then.
  int wait(std::chrono::steady_clock::duration timeout) {
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    int status = 0;
    while (!status_) {
      const pid_t ended = waitpid(pid_, &status, WNOHANG);
      if (ended == pid_) {
        status_ = status;
      } else if (std::chrono::steady_clock::now() > deadline) {
        kill(-pid_, SIGKILL);
        while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
        }
        status_ = status;
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    }
    kill(-pid_, SIGKILL);  // processes that the child may have left in its group
    return *status_;
  }

  void terminate() { kill(-pid_, SIGTERM); }

 private:
  /// Between fork and exec: async-signal-safe calls only.
  [[noreturn]] static void become(const std::string& program, char** argv, int out, int err, pid_t parent) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(127);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    const int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (null < 0 || dup2(null, 0) < 0 || dup2(out, 1) < 0 || dup2(err, 2) < 0) _exit(127);
    execv(program.c_str(), argv);
    const char* reason = strerrordesc_np(errno);
    if (reason != nullptr) (void)!write(2, reason, std::strlen(reason));
    _exit(127);
  }

  pid_t pid_ = -1;
  std::optional<int> status_;
};

/// Splits the child's output into lines, forwards progress and warnings, and keeps result and error.
class Protocol {
 public:
  explicit Protocol(const PipelineRunListener& listener) : listener_(listener) {}

  void take(const char* data, std::size_t size) {
    buffer_.append(data, size);
    for (std::size_t end = 0; (end = buffer_.find('\n')) != std::string::npos; buffer_.erase(0, end + 1))
      take_line(buffer_.substr(0, end));
    if (buffer_.size() > kLineBytesMax)
      throw PipelineFailure(kExitInternal, "hilbrush-pipeline prints a line without end");
  }

  std::optional<Json> result, error;

 private:
  void take_line(const std::string& line) {
    const Json message = Json::parse(line, nullptr, false);
    if (!message.is_object()) return;  // printed by a library
    if (const auto stage = message.find("stage"); stage != message.end() && stage->is_string()) {
      const auto fraction = message.find("fraction");
      const double value = fraction != message.end() && fraction->is_number() ? fraction->get<double>() : 0;
      if (listener_.on_progress) listener_.on_progress(stage->get<std::string>(), std::clamp(value, 0., 1.));
    } else if (const auto warning = message.find("warning");
               warning != message.end() && warning->is_string()) {
      if (listener_.on_warning) listener_.on_warning(warning->get<std::string>());
    } else if (message.contains("result")) {
      result = message["result"];
    } else if (message.contains("error")) {
      error = message["error"];
    }
  }

  const PipelineRunListener& listener_;
  std::string buffer_;
};

/// Reads both outputs until the child has closed them.
void follow(Child& child, const Descriptor& out, const Descriptor& err, InterruptWatch& interrupts,
            Protocol& protocol, std::string& child_stderr) {
  std::array<pollfd, 3> entries{
      {{out.get(), POLLIN, 0}, {err.get(), POLLIN, 0}, {interrupts.descriptor(), POLLIN, 0}}};
  std::array<char, 65536> block;
  while (entries[0].fd >= 0 || entries[1].fd >= 0) {
    if (poll(entries.data(), entries.size(), -1) < 0 && errno != EINTR)
      throw std::system_error(errno, std::generic_category(), "the child cannot be followed");
    if (entries[2].revents != 0 && interrupts.take()) {
      child.terminate();
      child.wait(kTerminationTimeout);
      throw Interrupted{
          "interrupted: hilbrush-pipeline was ended; files already written are left in the output folder"};
    }
    for (std::size_t i = 0; i < 2; ++i) {
      if (entries[i].revents == 0) continue;
      const ssize_t count = read(entries[i].fd, block.data(), block.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) {
        entries[i].fd = -1;  // poll() skips it
      } else if (i == 0) {
        protocol.take(block.data(), static_cast<std::size_t>(count));
      } else {
        child_stderr.append(block.data(), static_cast<std::size_t>(count));
        if (child_stderr.size() > kStderrBytesKept)
          child_stderr.erase(0, child_stderr.size() - kStderrBytesKept);
      }
    }
  }
}

std::string signal_sentence(int signal) {
  const char* name = strsignal(signal);
  const std::string by =
      " (signal " + std::to_string(signal) + ", " + (name != nullptr ? name : "unknown") + ")";
  if (signal == SIGKILL)
    return "hilbrush-pipeline was killed" + by +
           ", probably because memory ran out: fewer dots, a smaller texture or a coarser mesh need less";
  if (signal == SIGXCPU || signal == SIGXFSZ)
    return "hilbrush-pipeline was ended by a resource limit of this session" + by + ": see `ulimit -a`";
  if (signal == SIGTERM || signal == SIGINT || signal == SIGHUP)
    return "hilbrush-pipeline was ended from outside" + by;
  return "hilbrush-pipeline crashed" + by + "; this is a fault of the program, not of the model";
}

/// Returns the result. @throws PipelineFailure with the reason if there is none.
std::string conclude(int status, const Protocol& protocol, const std::string& child_stderr) {
  if (WIFSIGNALED(status))
    throw PipelineFailure(kExitInternal, signal_sentence(WTERMSIG(status)), {}, child_stderr);
  const int code = WEXITSTATUS(status);
  if (code == 127)
    throw PipelineFailure(kExitInternal, "hilbrush-pipeline cannot be started", {}, child_stderr);
  if (protocol.error && protocol.error->is_object()) {
    const auto text = [&](const char* key) {
      const auto found = protocol.error->find(key);
      return found != protocol.error->end() && found->is_string() ? found->get<std::string>() : std::string();
    };
    throw PipelineFailure(code == kExitOk ? kExitInternal : code, text("message"), text("at"), child_stderr);
  }
  if (code == kExitOk && protocol.result) return protocol.result->dump();
  throw PipelineFailure(code == kExitOk ? kExitInternal : code,
                        "hilbrush-pipeline ended with code " + std::to_string(code) +
                            (protocol.result ? " after its result" : " and without a result"),
                        {}, child_stderr);
}

}  // namespace

std::string find_pipeline_program() {
  std::error_code error;
  if (const char* program = std::getenv("HILBRUSH_PIPELINE"); program != nullptr && *program != '\0')
    return program;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path program = self.parent_path() / "hilbrush-pipeline";
  if (error || access(program.c_str(), X_OK) != 0)
    throw PipelineFailure(kExitInternal,
                          "there is no program " + program.string() +
                              ": is the installation complete? HILBRUSH_PIPELINE may name another");
  return program.string();
}

std::string run_pipeline_program(const std::string& program, const std::vector<std::string>& arguments,
                                 const PipelineRunListener& listener) {
  InterruptWatch interrupts;
  Pipe out, err;
  Child child(program, arguments, out.writer.get(), err.writer.get());
  out.writer.reset();
  err.writer.reset();
  Protocol protocol(listener);
  std::string child_stderr;
  follow(child, out.reader, err.reader, interrupts, protocol, child_stderr);
  return conclude(child.wait(std::chrono::minutes(1)), protocol, child_stderr);
}

}  // namespace hilbrush
