#include "daemon/server/lock_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace hilbrush {

LockFile::LockFile(const std::filesystem::path& file, const std::string& held)
    : fd_(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640)) {
  if (fd_ < 0) throw std::runtime_error(file.string() + ": cannot be opened: " + std::strerror(errno));
  // A child of a daemon that was killed may hold its lock for a moment longer.
  for (int attempt = 0; attempt < 50; ++attempt) {
    if (::flock(fd_, LOCK_EX | LOCK_NB) == 0) return;
    ::usleep(10000);
  }
  ::close(fd_);
  throw std::runtime_error(held + ": another hilbrushd uses it");
}

LockFile::~LockFile() {
  ::close(fd_);
}

}  // namespace hilbrush
