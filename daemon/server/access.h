#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/daemon_settings.h"
#include "daemon/server/peer.h"

/// Who may do what, by the daemon's settings. Names of users and groups are looked up once, at the start.
namespace hilbrush {

class Access {
 public:
  /// @throws InputError naming a user or group that this machine does not know.
  explicit Access(const DaemonSettings& settings);

  /// A process on this machine; `groups` are all that it is in.
  Peer local_peer(uid_t uid, gid_t gid, pid_t pid, const std::vector<gid_t>& groups) const;
  /// The owner of a token that came over TCP; empty if there is none. Takes the same time whatever the token
  /// is.
  std::optional<Peer> token_peer(const std::string& token, const std::string& address) const;

 private:
  struct Rule {
    std::optional<uid_t> uid;
    std::optional<gid_t> gid;
    bool may_operate = false;
  };
  struct Token {
    std::string sha256;
    Peer peer;
  };
  bool has_rules_ = false;
  std::vector<Rule> rules_;
  std::vector<Token> tokens_;
};

/// Wrong tokens by the address they came from: after too many within a minute, no token from there is tried.
/// Socket thread only.
class TokenFailures {
 public:
  static constexpr int kFailuresMax = 20;             ///< of an address within a minute
  static constexpr std::size_t kAddressesMax = 1000;  ///< that are remembered

  /// `address`: host:port, of which the host counts.
  bool may_try(const std::string& address);
  void note(const std::string& address);

 private:
  using Clock = std::chrono::steady_clock;
  struct Failures {
    int count = 0;
    Clock::time_point first;
  };
  std::map<std::string, Failures> failures_;
};

}  // namespace hilbrush
