#include "daemon/execution/journal_storage.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

#include "sampling/base/check.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, const std::string& sentence) {
  throw std::runtime_error(file.string() + ": " + sentence);
}
[[noreturn]] void fail_errno(const fs::path& file, const std::string& what) {
  fail(file, what + ": " + std::strerror(errno));
}

/// A process that was forked a moment ago shares our locks until it executes its program or dies: a lock is
/// given a second to become free.
bool lock_exclusively(int fd) {
  for (int attempt = 0; attempt < 100; ++attempt) {
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) return true;
    if (errno != EWOULDBLOCK && errno != EINTR) return false;
    ::usleep(10000);
  }
  return false;
}

void sync_folder(const fs::path& file) {
  const auto folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) fail_errno(folder, "cannot be opened");
  const int result = ::fsync(fd);
  ::close(fd);
  if (result != 0) fail_errno(folder, "cannot be synced");
}

}  // namespace

std::unique_ptr<JournalFile> JournalFile::create(const fs::path& file, std::size_t bytes) {
  std::unique_ptr<JournalFile> created(new JournalFile(file));
  const fs::path temporary = file.string() + ".part";
  std::error_code ignored;
  fs::remove(temporary, ignored);
  created->fd_ = ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (created->fd_ < 0) fail_errno(file, "cannot be created");
  created->temporary_ = temporary;
  if (const int error = ::posix_fallocate(created->fd_, 0, static_cast<off_t>(bytes)); error != 0)
    fail(file, std::string("no room for the journal: ") + std::strerror(error));
  if (!lock_exclusively(created->fd_)) fail_errno(file, "is in use");
  created->size_ = bytes;
  return created;
}

std::unique_ptr<JournalFile> JournalFile::open(const fs::path& file) {
  std::unique_ptr<JournalFile> opened(new JournalFile(file));
  opened->fd_ = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (opened->fd_ < 0) fail_errno(file, "cannot be opened");
  if (!lock_exclusively(opened->fd_)) fail(file, "is in use by another program");
  struct stat status {};
  if (::fstat(opened->fd_, &status) != 0) fail_errno(file, "cannot be read");
  opened->size_ = static_cast<std::size_t>(status.st_size);
  return opened;
}

JournalFile::~JournalFile() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove(temporary_, ignored);
  if (fd_ >= 0) ::close(fd_);
}

void JournalFile::publish() {
  sync();
  // link, unlike rename, refuses to replace a journal that is already there.
  if (::link(temporary_.c_str(), file_.c_str()) != 0) fail_errno(file_, "cannot be created");
  ::unlink(temporary_.c_str());
  temporary_.clear();
  sync_folder(file_);
}

void JournalFile::read(std::size_t offset, std::span<std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::pread(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_errno(file_, "cannot be read");
    if (count == 0) fail(file_, "is shorter than it was");
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    offset += static_cast<std::size_t>(count);
  }
}

void JournalFile::write(std::size_t offset, std::span<const std::uint8_t> bytes) {
  CHECK_LE(offset + bytes.size(), size_);
  while (!bytes.empty()) {
    const ssize_t count = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) fail_errno(file_, "cannot be written");
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    offset += static_cast<std::size_t>(count);
  }
}

void JournalFile::sync() {
  if (::fdatasync(fd_) != 0) fail_errno(file_, "cannot be synced to disk");
}

}  // namespace hilbrush
