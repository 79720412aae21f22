#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// The daemon's settings file: which users may connect, and whether TCP is served besides the Unix socket.
///
///   {"access": [{"user": "anna", "may": "operate"}, {"group": "staff", "may": "look"}],
///    "tcp": {"host": "127.0.0.1", "port": 4777, "tokens": [{"user": "anna", "sha256": "<64 hexadecimal
///    digits>"}]}}
///
/// Without `access` every user that can open the Unix socket may operate. With it only the users and groups
/// that it names; root and the daemon's own user always may. "look" includes stopping the cell. Without `tcp`
/// there is no TCP.
namespace hilbrush {

struct DaemonSettings {
  struct AccessRule {
    std::string user, group;   ///< exactly one of them is set
    bool may_operate = false;  ///< false: may only look
  };
  struct Token {
    std::string user;    ///< a client with the token has the rights of this local user
    std::string sha256;  ///< of the token's text, so that the file does not reveal the token
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
