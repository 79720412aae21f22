#pragma once

/// Ctrl-C and SIGTERM as a descriptor, so that a command can put things in order before it ends.
namespace hilbrush {

/// While one lives, both signals only make descriptor() readable. Make it before any thread; one at a time.
class InterruptWatch {
 public:
  InterruptWatch();
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  int descriptor() const { return descriptor_; }
  /// Whether one came since the last call.
  bool take();

 private:
  int descriptor_ = -1;
};

/// Thrown where an interrupt ends a command; the text says what became of the work.
struct Interrupted {
  const char* sentence;
};

}  // namespace hilbrush
