#include "daemon/commands/interrupt.h"

#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>

namespace hilbrush {
namespace {

sigset_t interrupts() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

InterruptWatch::InterruptWatch() {
  const sigset_t set = interrupts();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  descriptor_ = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
  if (descriptor_ < 0) {
    const int error = errno;
    pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
    throw std::system_error(error, std::generic_category(), "signals cannot be watched");
  }
}

InterruptWatch::~InterruptWatch() {
  take();
  close(descriptor_);
  const sigset_t set = interrupts();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

bool InterruptWatch::take() {
  signalfd_siginfo info;
  bool any = false;
  while (read(descriptor_, &info, sizeof(info)) == sizeof(info)) any = true;
  return any;
}

}  // namespace hilbrush
