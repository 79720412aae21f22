#pragma once
#include <string>
#include <vector>

namespace hilbrush {

/// Watches which files this process opens, by standing in for the C library's open and fopen; so it sees other
/// libraries' opens as well. Names are kept from construction to `names()`. One at a time, one thread.
class OpenedFiles {
 public:
  OpenedFiles();
  ~OpenedFiles();
  OpenedFiles(const OpenedFiles&) = delete;
  OpenedFiles& operator=(const OpenedFiles&) = delete;
  std::vector<std::string> names() const;
};

}  // namespace hilbrush
