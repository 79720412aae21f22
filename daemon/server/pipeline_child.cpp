#include "daemon/server/pipeline_child.h"

#include <fcntl.h>
#include <grp.h>
#include <poll.h>
#include <pwd.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "sampling/base/text.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;
using Steady = std::chrono::steady_clock;

constexpr std::size_t kStderrBytesMax = 2000;  // of its end, for the message of a crash
constexpr auto kProgressInterval = std::chrono::milliseconds(100);
constexpr int kPollMs = 100;

/// Closes its descriptor.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.release()) {}
  Descriptor& operator=(Descriptor&&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_ = -1;
};

struct Pipe {
  Descriptor read_end, write_end;
};

[[noreturn]] void throw_system_error(const char* what) {
  throw std::runtime_error(std::string(what) + ": " + std::strerror(errno));
}

Pipe make_pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw_system_error("no pipe can be made");
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

/// The groups of a user, looked up before the fork, where it is still allowed to.
std::vector<gid_t> groups_of(const ChildOwner& owner) {
  std::vector<gid_t> groups(64);
  int count = static_cast<int>(groups.size());
  const passwd* user = ::getpwuid(owner.uid);
  if (user == nullptr || ::getgrouplist(user->pw_name, owner.gid, groups.data(), &count) < 0)
    return {owner.gid};
  groups.resize(static_cast<std::size_t>(count));
  return groups;
}

/// Everything that the new process needs, prepared by the old one: after fork only async-signal-safe calls
/// are made.
struct Launch {
  std::vector<char*> argv;
  int null_fd, out_fd, err_fd;
  pid_t parent;
  std::optional<ChildOwner> owner;
  std::vector<gid_t> groups;
};

[[noreturn]] void become_pipeline(const Launch& launch) {
  ::setpgid(0, 0);
  if (launch.owner && (::setgroups(launch.groups.size(), launch.groups.data()) != 0 ||
                       ::setgid(launch.owner->gid) != 0 || ::setuid(launch.owner->uid) != 0))
    ::_exit(126);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // after setuid, which clears it
  if (::getppid() != launch.parent) ::_exit(126);
  ::dup2(launch.null_fd, 0);
  ::dup2(launch.out_fd, 1);
  ::dup2(launch.err_fd, 2);
  ::close_range(3, ~0u, 0);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  [[maybe_unused]] const int lower_priority = ::nice(5);
  sigset_t none;
  sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
  for (const int signal : {SIGPIPE, SIGTERM, SIGINT, SIGHUP}) ::signal(signal, SIG_DFL);
  ::execv(launch.argv.front(), launch.argv.data());
  ::_exit(127);
}

std::uint64_t resident_bytes(pid_t pid) {
  // Between fork and exec the child is a copy of the daemon, whose size says nothing about the pipeline's.
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/" + std::to_string(pid) + "/exe", error);
  if (error || program == std::filesystem::read_symlink("/proc/self/exe", error)) return 0;
  std::ifstream in("/proc/" + std::to_string(pid) + "/statm");
  std::uint64_t total = 0;
  std::uint64_t resident = 0;
  in >> total >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

std::string last_line(const std::string& text) {
  auto end = text.find_last_not_of(" \n\r\t");
  if (end == std::string::npos) return {};
  const auto begin = text.rfind('\n', end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1,
                     end - (begin == std::string::npos ? 0 : begin + 1) + 1);
}

/// Some signals come from the system or from an administrator, and tell nothing about the program.
std::string signal_sentence(int signal) {
  const std::string name = ::strsignal(signal);
  switch (signal) {
    case SIGXCPU:
    case SIGXFSZ:
      return "the pipeline reached a resource limit of the daemon's process: " + name;
    case SIGKILL:
      return "the pipeline was killed from outside, as the system does when memory is short: " + name;
    case SIGTERM:
    case SIGINT:
    case SIGHUP:
      return "the pipeline was ended from outside: " + name;
    default:
      return "the pipeline crashed: " + name;
  }
}

}  // namespace

struct PipelineChildren::Child {
  ChildId id = 0;
  ChildOrder order;
  pid_t pid = -1;
  int out_fd = -1;
  int err_fd = -1;
  std::string line, stderr_text;
  Steady::time_point last_heard, last_report;
  std::string stage;
  double fraction = 0;
  bool has_new_progress = false;
  bool is_killed = false;
  bool is_cancelled = false;
  ChildOutcome outcome;
  bool has_result = false;

  ~Child() {
    for (const int fd : {out_fd, err_fd})
      if (fd >= 0) ::close(fd);
  }
};

PipelineChildren::PipelineChildren(std::filesystem::path program, ChildLimits limits)
    : program_(std::move(program)), limits_(limits), wake_fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (wake_fd_ < 0) throw std::runtime_error(std::string("no event can be made: ") + std::strerror(errno));
  thread_ = std::thread([this] { watch(); });
}

PipelineChildren::~PipelineChildren() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    waiting_.clear();
  }
  ::eventfd_write(wake_fd_, 1);
  thread_.join();
  ::close(wake_fd_);
}

PipelineChildren::ChildId PipelineChildren::start(const ChildOrder& order) {
  ChildId id = 0;
  bool is_full = false;
  {
    const std::lock_guard lock(mutex_);
    id = ++last_id_;
    is_full = waiting_.size() >= kQueueMax;
    if (!is_full) waiting_.push_back({id, order});
  }
  if (is_full) {
    ChildOutcome outcome;
    outcome.error = std::to_string(kQueueMax) + " pipelines wait already";
    order.on_end(std::move(outcome));
  }
  ::eventfd_write(wake_fd_, 1);
  return id;
}

void PipelineChildren::cancel(ChildId id) {
  {
    const std::lock_guard lock(mutex_);
    if (std::erase_if(waiting_, [id](const Waiting& waiting) { return waiting.id == id; }) == 0)
      cancelled_.push_back(id);
  }
  ::eventfd_write(wake_fd_, 1);
}

/// @return false when the daemon ends.
bool PipelineChildren::take_orders() {
  std::vector<ChildId> cancelled;
  std::vector<Waiting> orders;
  {
    const std::lock_guard lock(mutex_);
    if (is_ending_) return false;
    cancelled.swap(cancelled_);
    while (!waiting_.empty() && children_.size() + orders.size() < kRunningMax) {
      orders.push_back(std::move(waiting_.front()));
      waiting_.pop_front();
    }
  }
  for (Waiting& waiting : orders) spawn(waiting.id, std::move(waiting.order));
  for (auto& child : children_) {
    if (std::find(cancelled.begin(), cancelled.end(), child->id) == cancelled.end()) continue;
    child->is_cancelled = true;
    kill_child(*child, "cancelled");
  }
  return true;
}

void PipelineChildren::watch() {
  for (;;) {
    std::vector<pollfd> polled{{wake_fd_, POLLIN, 0}};
    for (const auto& child : children_)
      for (const int fd : {child->out_fd, child->err_fd})
        if (fd >= 0) polled.push_back({fd, POLLIN, 0});
    ::poll(polled.data(), polled.size(), children_.empty() ? -1 : kPollMs);
    eventfd_t ignored;
    ::eventfd_read(wake_fd_, &ignored);
    if (!take_orders()) break;
    for (const auto& child : children_) {
      read_output(*child);
      check_limits(*child);
      report_progress(*child, Steady::now() - child->last_report >= kProgressInterval);
    }
    std::erase_if(children_, [this](const auto& child) { return reap(*child); });
  }
  for (const auto& child : children_) {
    ::kill(-child->pid, SIGKILL);
    ::waitpid(child->pid, nullptr, 0);
  }
}

void PipelineChildren::spawn(ChildId id, ChildOrder order) {
  auto child = std::make_unique<Child>();
  child->id = id;
  child->order = std::move(order);
  child->last_heard = child->last_report = Steady::now();
  try {
    Pipe out = make_pipe();
    Pipe err = make_pipe();
    const Descriptor null(::open("/dev/null", O_RDWR | O_CLOEXEC));
    if (null.get() < 0) throw_system_error("/dev/null cannot be opened");
    std::string program = program_.string();
    Launch launch{{program.data()}, null.get(), out.write_end.get(), err.write_end.get(), ::getpid(),
                  std::nullopt,     {}};
    for (auto& argument : child->order.arguments) launch.argv.push_back(argument.data());
    launch.argv.push_back(nullptr);
    if (child->order.owner && ::geteuid() == 0 && child->order.owner->uid != 0) {
      launch.owner = child->order.owner;
      launch.groups = groups_of(*launch.owner);
    }
    child->pid = ::fork();
    if (child->pid == 0) become_pipeline(launch);
    if (child->pid < 0) throw_system_error("no process can be started");
    ::setpgid(child->pid, child->pid);  // the child does it too: one of the two is first
    child->out_fd = out.read_end.release();
    child->err_fd = err.read_end.release();
    for (const int fd : {child->out_fd, child->err_fd}) ::fcntl(fd, F_SETFL, O_NONBLOCK);
  } catch (const std::exception& error) {
    child->outcome.error = error.what();
    child->order.on_end(std::move(child->outcome));
    return;
  }
  children_.push_back(std::move(child));
}

void PipelineChildren::read_output(Child& child) {
  const auto drain = [](int& fd, auto take) {
    char buffer[65536];
    // A child that never stops writing must not keep the others waiting.
    for (int round = 0; fd >= 0 && round < 16; ++round) {
      const ssize_t count = ::read(fd, buffer, sizeof buffer);
      if (count > 0) {
        take(buffer, static_cast<std::size_t>(count));
      } else if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
        ::close(fd);
        fd = -1;
      } else {
        return;
      }
    }
  };
  drain(child.out_fd, [&](const char* text, std::size_t length) {
    for (const char* end = text + length; text < end;) {
      const char* newline = std::find(text, end, '\n');
      child.line.append(text, newline);
      if (child.line.size() > limits_.line_bytes) {
        kill_child(child, "the pipeline wrote a line of more than " + std::to_string(limits_.line_bytes) +
                              " bytes and was killed");
        child.line.clear();
      }
      if (newline == end) break;
      take_line(child, child.line);
      child.line.clear();
      text = newline + 1;
    }
  });
  drain(child.err_fd, [&](const char* text, std::size_t length) {
    child.stderr_text.append(text, length);
    if (child.stderr_text.size() > kStderrBytesMax)
      child.stderr_text.erase(0, child.stderr_text.size() - kStderrBytesMax);
  });
}

void PipelineChildren::take_line(Child& child, const std::string& line) {
  if (child.is_killed) return;
  try {
    const Json json = Json::parse(line);
    child.last_heard = Steady::now();
    if (json.contains("stage")) {
      const auto stage = json.at("stage").get<std::string>();
      const bool is_new = stage != child.stage;
      child.stage = stage.substr(0, 50);
      child.fraction = std::clamp(json.value("fraction", 0.), 0., 1.);
      child.has_new_progress = true;
      report_progress(child, is_new);
    } else if (json.contains("warning")) {
      if (child.order.on_warning) child.order.on_warning(json.at("warning").get<std::string>());
    } else if (json.contains("result")) {
      child.has_result = true;
      child.outcome.result = json.at("result").dump(-1, ' ', false, Json::error_handler_t::replace);
    } else if (json.contains("error")) {
      child.outcome.error_at = json.at("error").value("at", "");
      child.outcome.error = json.at("error").at("message").get<std::string>();
    }
  } catch (const Json::exception&) {
    kill_child(child, "the pipeline wrote a line that does not belong to its protocol and was killed");
  }
}

void PipelineChildren::report_progress(Child& child, bool is_due) {
  if (!is_due || !child.has_new_progress) return;
  child.has_new_progress = false;
  child.last_report = Steady::now();
  if (child.order.on_progress) child.order.on_progress(child.stage, child.fraction);
}

void PipelineChildren::check_limits(Child& child) {
  if (child.is_killed) return;
  const std::chrono::duration<double> silence = Steady::now() - child.last_heard;
  if (silence.count() > limits_.silence_s)
    kill_child(child,
               "the pipeline made no progress for " + number(limits_.silence_s, 3) + " s and was killed");
  else if (resident_bytes(child.pid) > limits_.resident_bytes)
    kill_child(child, "the pipeline needed more than " +
                          number(static_cast<double>(limits_.resident_bytes >> 20), 3) +
                          " MB of memory and was killed; a smaller model or fewer dots may help");
}

void PipelineChildren::kill_child(Child& child, std::string sentence) {
  if (child.is_killed) return;
  child.is_killed = true;
  child.outcome.error_at.clear();
  child.outcome.error = std::move(sentence);
  ::kill(-child.pid, SIGKILL);
}

/// @return true once the child is gone and its end is reported.
bool PipelineChildren::reap(Child& child) {
  siginfo_t info{};
  if (::waitid(P_PID, static_cast<id_t>(child.pid), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
      info.si_pid == 0)
    return false;
  ::kill(-child.pid, SIGKILL);  // its own children too; before its id can belong to another process
  int status = 0;
  ::waitpid(child.pid, &status, 0);
  read_output(child);
  report_progress(child, true);
  if (child.is_cancelled) return true;

  ChildOutcome& outcome = child.outcome;
  if (!child.is_killed) {
    const bool is_clean = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    outcome.is_ok = is_clean && child.has_result;
    const std::string said = last_line(child.stderr_text);
    const std::string tail = said.empty() ? "" : "; its last message: " + said;
    if (WIFSIGNALED(status))
      outcome.error = signal_sentence(WTERMSIG(status)) + tail;
    else if (WEXITSTATUS(status) == 127 && said.empty() && outcome.error.empty())
      outcome.error = program_.string() + " cannot be started";
    else if (!outcome.is_ok && outcome.error.empty())
      outcome.error = "the pipeline ended with exit code " + std::to_string(WEXITSTATUS(status)) +
                      " and without a result" + tail;
  }
  child.order.on_end(std::move(outcome));
  return true;
}

}  // namespace hilbrush
