#pragma once
#include <cstdint>
#include <string>

/// Who asks, as the system or a token says.
namespace hilbrush {

struct Peer {
  std::uint32_t uid = 0;
  std::uint32_t gid = 0;
  std::int32_t pid = 0;      ///< 0 over TCP
  std::string user;          ///< name, or the uid's figures
  std::string address;       ///< over TCP: host:port; else empty
  bool may_look = false;     ///< may ask, watch, and stop the cell; nothing without it
  bool may_operate = false;  ///< may do everything
};

}  // namespace hilbrush
