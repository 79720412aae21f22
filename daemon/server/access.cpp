#include "daemon/server/access.h"

#include <grp.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>

#include "sampling/base/input_error.h"
#include "sampling/base/sha256.h"

namespace hilbrush {
namespace {

const passwd& known_user(const std::string& name, const std::string& at) {
  const passwd* user = ::getpwnam(name.c_str());
  if (user == nullptr) throw InputError(at, "this machine knows no user \"" + name + "\"");
  return *user;
}

gid_t known_group(const std::string& name, const std::string& at) {
  const group* found = ::getgrnam(name.c_str());
  if (found == nullptr) throw InputError(at, "this machine knows no group \"" + name + "\"");
  return found->gr_gid;
}

std::string user_name(uid_t uid) {
  const passwd* user = ::getpwuid(uid);
  return user != nullptr ? user->pw_name : std::to_string(uid);
}

std::vector<gid_t> groups_of(const passwd& user) {
  std::vector<gid_t> groups(256);
  int count = static_cast<int>(groups.size());
  if (::getgrouplist(user.pw_name, user.pw_gid, groups.data(), &count) < 0) return {user.pw_gid};
  groups.resize(static_cast<std::size_t>(count));
  return groups;
}

/// Without a branch on the digits.
bool is_same_digest(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

std::string host_of(const std::string& address) {
  return address.substr(0, address.rfind(':'));
}

}  // namespace

Access::Access(const DaemonSettings& settings) : has_rules_(settings.access.has_value()) {
  if (settings.access) {
    for (std::size_t i = 0; i < settings.access->size(); ++i) {
      const auto& given = (*settings.access)[i];
      const std::string at = "$.access[" + std::to_string(i) + "]";
      Rule rule;
      rule.may_operate = given.may_operate;
      if (given.user.empty())
        rule.gid = known_group(given.group, at + ".group");
      else
        rule.uid = known_user(given.user, at + ".user").pw_uid;
      rules_.push_back(rule);
    }
  }
  if (!settings.tcp) return;
  for (std::size_t i = 0; i < settings.tcp->tokens.size(); ++i) {
    const auto& given = settings.tcp->tokens[i];
    const passwd user = known_user(given.user, "$.tcp.tokens[" + std::to_string(i) + "].user");
    tokens_.push_back({given.sha256, local_peer(user.pw_uid, user.pw_gid, 0, groups_of(user))});
  }
}

Peer Access::local_peer(uid_t uid, gid_t gid, pid_t pid, const std::vector<gid_t>& groups) const {
  Peer peer;
  peer.uid = uid;
  peer.gid = gid;
  peer.pid = pid;
  peer.user = user_name(uid);
  peer.may_operate = !has_rules_ || uid == 0 || uid == ::geteuid();
  peer.may_look = peer.may_operate;
  for (const Rule& rule : rules_) {
    const bool is_meant =
        rule.uid ? *rule.uid == uid
                 : *rule.gid == gid || std::find(groups.begin(), groups.end(), *rule.gid) != groups.end();
    if (!is_meant) continue;
    peer.may_look = true;
    peer.may_operate |= rule.may_operate;
  }
  return peer;
}

std::optional<Peer> Access::token_peer(const std::string& token, const std::string& address) const {
  const std::string digest = sha256_hex(token);
  std::optional<Peer> found;
  for (const Token& known : tokens_)
    if (is_same_digest(known.sha256, digest)) found = known.peer;
  if (found) found->address = address;
  return found;
}

bool TokenFailures::may_try(const std::string& address) {
  std::erase_if(failures_, [now = Clock::now()](const auto& entry) {
    return now - entry.second.first > std::chrono::minutes(1);
  });
  const auto found = failures_.find(host_of(address));
  return found == failures_.end() || found->second.count < kFailuresMax;
}

void TokenFailures::note(const std::string& address) {
  if (failures_.size() >= kAddressesMax) failures_.clear();
  Failures& failures = failures_[host_of(address)];
  if (failures.count++ == 0) failures.first = Clock::now();
}

}  // namespace hilbrush
