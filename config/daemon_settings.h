#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// The daemon's settings file: who may connect, and whether over TCP, too.
///
///   {"access": [{"user": "anna", "may": "operate"}, {"group": "staff", "may": "look"}],
///    "tcp": {"host": "127.0.0.1", "port": 4777, "tokens": [{"user": "anna", "sha256": "<64 hexadecimal digits>"}]}}
///
/// Without `access` everybody who can open the Unix socket may operate. With it only those named may, of those who can;
/// root and the daemon's own user always may. Who may look may also stop the cell. Without `tcp` there is no TCP.
namespace hilbrush {

struct DaemonSettings {
  struct AccessRule {
    std::string user, group;   ///< one of them
    bool may_operate = false;  ///< else: look
  };
  struct Token {
    std::string user;    ///< whoever brings the token acts with this local user's rights
    std::string sha256;  ///< of the token's text, so that this file gives no token away
  };
  struct Tcp {
    std::string host = "127.0.0.1";  ///< an address of this machine
    std::uint16_t port = 0;          ///< 0: any free one
    std::vector<Token> tokens;
  };
  std::optional<std::vector<AccessRule>> access;
  std::optional<Tcp> tcp;
};

/// @throws InputError with "<origin>: <JSON path>" and a sentence.
DaemonSettings daemon_settings_from_json(const std::string& text, const std::string& origin);
/// @throws InputError naming the file.
DaemonSettings load_daemon_settings(const std::filesystem::path& file);

}  // namespace hilbrush
