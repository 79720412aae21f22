#include "daemon/server/audit_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <utility>

namespace hilbrush {
namespace {

constexpr std::size_t kSummaryBytesMax = 300;

std::string utc_now_ms() {
  timeval now{};
  ::gettimeofday(&now, nullptr);
  std::tm utc{};
  ::gmtime_r(&now.tv_sec, &utc);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  return fmt::format("{}.{:03}Z", text, now.tv_usec / 1000);
}

}  // namespace

AuditLog::AuditLog(const std::filesystem::path& file)
    : fd_(::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0640)) {
  if (fd_ < 0) throw std::runtime_error(file.string() + ": cannot be opened: " + std::strerror(errno));
}

AuditLog::~AuditLog() {
  ::close(fd_);
}

void AuditLog::record(const Peer& peer, const std::string& method, const Json& params,
                      const std::string& result) noexcept {
  try {
    // ASCII: control characters cannot forge lines.
    std::string summary = params.dump(-1, ' ', true, Json::error_handler_t::replace);
    if (summary.size() > kSummaryBytesMax) summary.resize(kSummaryBytesMax);
    Json line{{"time", utc_now_ms()}, {"user", peer.user}, {"uid", peer.uid}, {"pid", peer.pid}};
    if (peer.user.empty()) line["uid"] = line["pid"] = nullptr;  // it has not said who it is
    if (!peer.address.empty()) line["address"] = peer.address;
    line["method"] = method;
    line["params"] = summary;
    line["result"] = result;
    const std::string text = line.dump(-1, ' ', true, Json::error_handler_t::replace) + "\n";
    [[maybe_unused]] const ssize_t written = ::write(fd_, text.data(), text.size());
  } catch (const std::exception&) {
  }
}

void AuditLog::record_refusal(const Peer& peer, const std::string& method) noexcept {
  const auto now = std::chrono::steady_clock::now();
  if (last_refusal_ && now - *last_refusal_ < kRefusalPeriod) {
    ++refusals_;
    return;
  }
  last_refusal_ = now;
  const auto unrecorded = std::exchange(refusals_, 0);
  record(peer, method, Json::object(),
         unrecorded == 0 ? "refused"
                         : "refused, as " + std::to_string(unrecorded) + " others since the last such line");
}

}  // namespace hilbrush
