#pragma once
#include <string>
#include <vector>

namespace hilbrush {

/// Records which files this process opens. It replaces the C library's open and fopen, so the calls of all
/// libraries are recorded. Names are kept from construction to `names()`. One object at a time, in one
/// thread.
class OpenedFiles {
 public:
  OpenedFiles();
  ~OpenedFiles();
  OpenedFiles(const OpenedFiles&) = delete;
  OpenedFiles& operator=(const OpenedFiles&) = delete;
  std::vector<std::string> names() const;
};

}  // namespace hilbrush
