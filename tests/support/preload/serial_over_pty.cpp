// Loaded with LD_PRELOAD in front of a program that opens serial ports through libserialport, so that it
// takes a pseudo-terminal for one. The library refuses pseudo-terminals for two reasons: they are not listed
// in /sys/class/tty, and they have no modem lines. Here they are reported as listed, and the modem lines are
// emulated: request to send and data terminal ready are accepted, clear to send and data set ready are
// reported. All other calls are passed on.

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdarg>
#include <cstring>

namespace {

constexpr char kListing[] = "/sys/class/tty/pts/";

bool is_in_listing(const char* path) {
  return std::strncmp(path, kListing, sizeof kListing - 1) == 0;
}
/// Something that exists in place of an entry of the listing.
const char* listed(const char* path) {
  return is_in_listing(path) ? "/" : path;
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

bool is_of_modem_lines(unsigned long request) {
  return request == TIOCMGET || request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC;
}

}  // namespace

extern "C" {

int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  using Ioctl = int (*)(int, unsigned long, ...);
  static const auto real = next<Ioctl>("ioctl");
  int lines = 0;
  // A serial port has its own answer.
  const bool is_pseudo_terminal = is_of_modem_lines(request) && real(fd, TIOCMGET, &lines) != 0;
  if (!is_pseudo_terminal) return real(fd, request, argument);
  if (request == TIOCMGET) *static_cast<int*>(argument) = TIOCM_CTS | TIOCM_DSR | TIOCM_CAR;
  return 0;
}

/// What libraries built against an older libc call lstat().
int __lxstat(int version, const char* path, struct stat* status) noexcept {
  using Lstat = int (*)(int, const char*, struct stat*);
  static const auto real = next<Lstat>("__lxstat");
  return real(version, listed(path), status);
}

int lstat(const char* path, struct stat* status) noexcept {
  return ::fstatat(AT_FDCWD, listed(path), status, AT_SYMLINK_NOFOLLOW);
}

/// An entry names its device's driver; this one has none.
ssize_t readlink(const char* path, char* target, size_t size) noexcept {
  if (!is_in_listing(path)) return ::readlinkat(AT_FDCWD, path, target, size);
  constexpr char kTarget[] = "../../devices/virtual/tty";
  const size_t length = size < sizeof kTarget - 1 ? size : sizeof kTarget - 1;
  std::memcpy(target, kTarget, length);
  return static_cast<ssize_t>(length);
}

}  // extern "C"
