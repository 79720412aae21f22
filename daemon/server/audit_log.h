#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/server/json_rpc.h"
#include "daemon/server/peer.h"

/// Who did what: one line an act (requests that only look are not recorded) with time, user, uid, pid,
/// address, method, a summary of the parameters, and the result. Appended to, never rewritten; rotation is
/// the system's. Socket thread only.
namespace hilbrush {

class AuditLog {
 public:
  /// @throws std::runtime_error naming the file.
  explicit AuditLog(const std::filesystem::path& file);
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  /// `result`: "ok" or the fault's sentence. A line that cannot be written is lost: a full disk must not keep
  /// the cell from being stopped.
  void record(const Peer& peer, const std::string& method, const Json& params,
              const std::string& result) noexcept;
  /// A wrong token. At most one line in kRefusalPeriod: the others are counted, and the next line says how
  /// many.
  void record_refusal(const Peer& peer, const std::string& method) noexcept;

 private:
  static constexpr std::chrono::seconds kRefusalPeriod{10};
  std::optional<std::chrono::steady_clock::time_point> last_refusal_;
  std::uint64_t refusals_ = 0;  ///< since that line
  int fd_ = -1;
};

}  // namespace hilbrush
