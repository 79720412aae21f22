#pragma once
#include <filesystem>
#include <string>

namespace hilbrush {

/// Held as long as the daemon lives: two daemons never share a state folder, a socket or a cell. The file
/// stays; only the lock on it counts.
class LockFile {
 public:
  /// `held`: what the lock stands for, in the sentence of the error. @throws std::runtime_error if the file
  /// cannot be opened, or another process holds it for half a second.
  LockFile(const std::filesystem::path& file, const std::string& held);
  ~LockFile();
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

 private:
  int fd_;
};

}  // namespace hilbrush
