#include "daemon/server/model_copy.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/fsuid.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/base/sha256.h"
#include "sampling/base/write_all.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

/// Closes its file.
class OpenFile {
 public:
  explicit OpenFile(int fd) : fd_(fd) {}
  ~OpenFile() {
    if (fd_ >= 0) ::close(fd_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// The system call itself: glibc's setgroups changes every thread of the process, the kernel's only this one.
void set_thread_groups(const std::vector<gid_t>& groups) {
  CHECK(::syscall(SYS_setgroups, groups.size(), groups.data()) == 0);
}

std::vector<gid_t> groups_of(uid_t uid, gid_t gid) {
  std::vector<gid_t> groups(64);
  int count = static_cast<int>(groups.size());
  const passwd* user = ::getpwuid(uid);
  if (user == nullptr || ::getgrouplist(user->pw_name, gid, groups.data(), &count) < 0) return {gid};
  groups.resize(static_cast<std::size_t>(count));
  return groups;
}

/// What the path leads to is found out before it is opened: opening a device may already act on it, and
/// opening a pipe waits for its writer.
int open_as_peer(const fs::path& file, uid_t uid, gid_t gid) {
  const AsPeer peer(uid, gid);
  const auto refuse = [&] {
    throw InputError(file.string(), std::string("cannot be read: ") + std::strerror(errno));
  };
  const OpenFile place(::open(file.c_str(), O_PATH | O_CLOEXEC));
  if (place.get() < 0) refuse();
  struct stat status {};
  if (::fstat(place.get(), &status) != 0) refuse();
  if (!S_ISREG(status.st_mode)) throw InputError(file.string(), "is not a regular file");
  const std::string same = "/proc/self/fd/" + std::to_string(place.get());
  const int fd = ::open(same.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY);
  if (fd < 0) refuse();
  return fd;
}

/// Relative to `base`. The folder may have been reached by a link; whether the file itself is one was looked
/// at when the list was made.
fs::path place_below(const fs::path& file, const fs::path& base) {
  std::error_code error;
  const fs::path folder = fs::canonical(fs::absolute(file).parent_path(), error);
  if (error) throw InputError(file.string(), "cannot be read: " + error.message());
  const fs::path relative = (folder / file.filename()).lexically_relative(base);
  if (relative.empty() || *relative.begin() == "..")
    throw InputError(file.string(), "lies outside the model's folder; a job takes only what is below it");
  return relative;
}

std::uintmax_t copy_file(int from, const fs::path& to, Sha256& hash, std::uintmax_t bytes_left,
                         const fs::path& source, const std::stop_token& stop) {
  fs::create_directories(to.parent_path());
  const OpenFile out(::open(to.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640));
  if (out.get() < 0)
    throw InputError(source.string(), std::string("the job's copy cannot be made: ") + std::strerror(errno));
  std::vector<char> block(std::size_t{1} << 18);
  std::uintmax_t copied = 0;
  for (;;) {
    if (stop.stop_requested())
      throw InputError(source.string(), "is not copied any further: the job was cancelled");
    const ssize_t count = ::read(from, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw InputError(source.string(), std::string("cannot be read: ") + std::strerror(errno));
    if (count == 0) return copied;
    copied += static_cast<std::uintmax_t>(count);
    if (copied > bytes_left)
      throw InputError(source.string(),
                       "makes the model larger than " + std::to_string(kModelBytesMax >> 20) + " MB");
    const std::string_view bytes(block.data(), static_cast<std::size_t>(count));
    hash.update(bytes);
    if (!write_all(out.get(), bytes))
      throw InputError(source.string(),
                       std::string("the job's copy cannot be written: ") + std::strerror(errno));
  }
}

}  // namespace

AsPeer::AsPeer(uid_t uid, gid_t gid) {
  if (::geteuid() != 0 || uid == 0) return;
  own_groups_.resize(static_cast<std::size_t>(std::max(0, ::getgroups(0, nullptr))));
  CHECK(::getgroups(static_cast<int>(own_groups_.size()), own_groups_.data()) >= 0);
  is_changed_ = true;
  set_thread_groups(groups_of(uid, gid));
  ::setfsgid(gid);
  ::setfsuid(uid);
}

AsPeer::~AsPeer() {
  if (!is_changed_) return;
  ::setfsuid(::geteuid());
  ::setfsgid(::getegid());
  set_thread_groups(own_groups_);
}

void check_readable(const fs::path& file, uid_t uid, gid_t gid) {
  const OpenFile open(open_as_peer(file, uid, gid));
}

ModelCopy copy_model(const fs::path& model, const std::vector<fs::path>& files, const fs::path& target,
                     uid_t uid, gid_t gid, const std::stop_token& stop) {
  if (files.size() > kModelFilesMax)
    throw InputError(model.string(), "refers to more than " + std::to_string(kModelFilesMax) + " files");
  std::error_code ignored;
  std::error_code absence;
  const fs::path base = fs::canonical(fs::absolute(model).parent_path(), absence);  // as the files' paths are
  if (absence) throw InputError(model.string(), "cannot be read: " + absence.message());
  fs::remove_all(target, ignored);
  try {
    Sha256 hash;
    std::uintmax_t bytes = 0;
    bool has_model = false;
    for (const auto& file : files) {
      const fs::path relative = place_below(file, base);
      has_model = has_model || relative == model.filename();
      const OpenFile from(open_as_peer(file, uid, gid));
      bytes += copy_file(from.get(), target / relative, hash, kModelBytesMax - bytes, file, stop);
    }
    if (!has_model) throw InputError(model.string(), "is not among the files that reading it reads");
    return {target / model.filename(), hash.hex_digest()};
  } catch (const fs::filesystem_error& error) {
    fs::remove_all(target, ignored);
    throw InputError(model.string(), std::string("cannot be copied: ") + error.what());
  } catch (...) {
    fs::remove_all(target, ignored);
    throw;
  }
}

}  // namespace hilbrush
