#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace hilbrush {

/// One positioning drive behind a fieldbus, in its own steps. Each call is a few bounded exchanges on the
/// wire and throws DriverError. `give_up`, asked between the exchanges of a handshake, ends it with a
/// DriverError, so that a stop never waits longer than one exchange.
class AxisDrive {
 public:
  using GiveUp = std::function<bool()>;
  struct Move {
    std::int32_t target = 0;         ///< steps
    std::uint32_t speed = 0;         ///< steps/s
    std::uint32_t acceleration = 0;  ///< steps/s2
    bool operator==(const Move&) const = default;
  };
  struct Reading {
    double position = 0;             ///< measured, steps
    std::optional<double> setpoint;  ///< what the profile asks for now, steps
    bool is_enabled = false;
    bool is_homed = false;
    bool has_arrived = false;  ///< as the drive reports it
    bool has_fault = false;
    std::uint32_t alarm = 0;
  };

  virtual ~AxisDrive() = default;
  virtual void connect() = 0;
  virtual void close() noexcept = 0;
  /// For the operator. @throws DriverError
  virtual std::string identify() = 0;
  virtual Reading read() = 0;
  virtual void enable(const GiveUp& give_up) = 0;
  virtual void disable() = 0;
  virtual void home(const GiveUp& give_up) = 0;
  /// Writes the part of a move that does not start it: nothing moves, now or later, by this alone. False if
  /// this drive has no such part. What fails leaves the drive with data that the next whole order overwrites.
  virtual bool write_ahead(const Move& move, const GiveUp& give_up) = 0;
  /// Returns when the drive has taken the order. `is_ahead`: write_ahead() has written this very move, and
  /// nothing was ordered since; only the rest of it is sent.
  virtual void start(const Move& move, bool is_ahead, const GiveUp& give_up) = 0;
  virtual void stop() = 0;
  virtual void clear_fault() = 0;
  virtual std::string alarm_text(std::uint32_t alarm) const = 0;
};

}  // namespace hilbrush
