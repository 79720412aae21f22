#pragma once
#include <array>
#include <cstddef>
#include <string>

/// Positioning axes that move together: the robot's four joints, the table's two.
///
/// Life cycle:  disconnected -> connected -> enabled -> ready -> moving -> ready ...; any -> fault.
///   connect()  disconnected -> connected: identifies the device; nothing can move.
///   enable()   connected -> enabled: drives on; joints can be read.
///   home()     enabled -> ready: may move. A group that keeps its reference may be ready at once.
///   move_to()  ready -> moving -> ready when every axis is in position and settled.
///   A lost link is a fault with a sentence; clear_fault() connects again.
///   stop()     moving -> enabled-but-stopped (ready again at once): decelerates; from any thread,
///   idempotent, never throws. disable()  any but disconnected -> connected. clear_fault() fault ->
///   connected.
/// Unless said otherwise, calls come from the executor's thread only, and throw DriverError on refusal,
/// silence or fault.
namespace hilbrush {

enum class DeviceState { kDisconnected, kConnected, kEnabled, kReady, kMoving, kFault };
const char* device_state_name(DeviceState state);

/// Every group refuses a longer settle time (s), whatever its device would accept.
inline constexpr double kMaxSettleS = 60;
/// Rounding, in rad or m: every group refuses targets that are outside of its bounds by more.
inline constexpr double kBoundsTolerance = 1e-9;

template <std::size_t N>
class AxisGroup {
 public:
  using Positions = std::array<double, N>;  ///< rad; prismatic joints in m

  struct Status {
    DeviceState state = DeviceState::kDisconnected;
    Positions positions{};     ///< measured
    bool in_position = false;  ///< at the last target, settled
    std::string fault;         ///< a sentence, if state is kFault
    /// When the first frame or reply came that showed it in position and settled, on the cell's clock; 0 if
    /// unknown.
    double in_position_since_s = 0;
    /// How old this is: when the frame came, or the reading was begun, on the cell's clock; 0: it is of the
    /// present.
    double read_s = 0;
  };

  virtual ~AxisGroup() = default;
  virtual void connect() = 0;
  virtual void enable() = 0;
  virtual void home() = 0;
  virtual void disable() noexcept = 0;
  virtual void clear_fault() = 0;
  /// Starts a move of all axes to `target` and returns. Refuses targets outside the device's own limits, and
  /// when not ready. `settle_s`: how long the axes must have been at rest before in_position is reported, as
  /// the time model foresees.
  virtual void move_to(const Positions& target, double settle_s) = 0;
  /// How many further targets move_to() takes while a move is under way: they are visited in order, each at
  /// rest; in_position is about the last of them, and stop() forgets them all. One more is refused.
  virtual std::size_t look_ahead() const { return 0; }
  /// The next target, given while a pulse is on: a device that allows it is sent the set-point without its
  /// trigger. Nothing moves. It is a hint: it never waits for the device, and a stop, a fault and every other
  /// target cancel it. The next move_to() need not follow it.
  virtual void prepare(const Positions& /*target*/) {}
  /// What is known by the last frame or reply: cheap, never waits for the device. When the answer changes in
  /// state, fault or in_position, devices that learn it by themselves wake the cell's clock. From any thread.
  virtual Status status() = 0;
  /// The device's own estimate of when in_position can become true, on the cell's clock; a hint for polling.
  /// now if unknown.
  virtual double expected_arrival_s() = 0;
  /// From any thread, idempotent, never throws.
  virtual void stop() noexcept = 0;
};

using Robot = AxisGroup<4>;
using Table = AxisGroup<2>;

}  // namespace hilbrush
