#pragma once

/// Ctrl-C and SIGTERM as a descriptor, so that a command can clean up before it ends.
namespace hilbrush {

/// While such an object exists, both signals only make descriptor() readable. Create it before any thread is
/// started; only one at a time.
class InterruptWatch {
 public:
  InterruptWatch();
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  int descriptor() const { return descriptor_; }
  /// Whether a signal has come since the last call.
  bool take();

 private:
  int descriptor_ = -1;
};

/// Thrown where an interrupt ends a command; the sentence says what has become of the work.
struct Interrupted {
  const char* sentence;
};

}  // namespace hilbrush
