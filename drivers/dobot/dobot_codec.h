#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Messages of the Dobot 4-axis TCP/IP interface as pure functions (manual "TCP_IP Remote Control Interface
/// Guide (4axis)", 2024-04-19): ASCII commands and replies of the ports 29999 (dashboard, at once) and 30003
/// (motion, queued), and the binary feedback packet of port 30004. Units of the wire: degrees, millimeters,
/// milliseconds.
namespace hilbrush::dobot {

/// J1, J2 in degrees, J3 in mm, J4 in degrees.
using Joints = std::array<double, 4>;

/// `Name(p1,p2)`; whole numbers.
std::string encode(std::string_view name, std::initializer_list<long> parameters = {});
/// `JointMovJ(j1,j2,j3,j4)` with six decimals: a billionth of a meter at arm's length.
std::string encode_joint_move(const Joints& joints);
/// A pulse on a digital output that the controller times by itself: `DO(i,1)wait(ms)DO(i,0)Sync()`. To be
/// sent in one write, so that it is queued whole or not at all; Sync is answered when the output is off
/// again.
std::array<std::string, 4> encode_pulse(int output, long pulse_ms);

/// `ErrorID,{values},Name(p1,p2);`
struct Reply {
  long error = 0;
  std::string values;   ///< between the braces
  std::string command;  ///< the echo, as sent
};
/// `text` without its semicolon. Nothing if it is not a reply.
std::optional<Reply> decode_reply(std::string_view text);
/// Whether `echo` repeats `command`: same name, without regard to case, and the same number of parameters.
bool is_echo(std::string_view echo, std::string_view command);
/// A sentence's end: "is refused: parameter 2 is out of range".
std::string error_text(long error);

/// RobotMode(), and the frame's robot_mode.
enum class Mode : std::uint64_t {
  kInit = 1,
  kBrakeOpen = 2,
  kPowerOff = 3,
  kDisabled = 4,
  kEnabled = 5,
  kDrag = 6,
  kRunning = 7,
  kRecording = 8,
  kError = 9,
  kPause = 10,
  kJog = 11
};
const char* mode_name(Mode mode);

/// What is used of the 1440-byte feedback packet, sent every 8 ms.
struct Frame {
  std::uint64_t digital_outputs = 0;  ///< bit i: output i + 1
  Mode mode = Mode::kInit;
  std::uint64_t time_ms = 0;  ///< of the controller's own clock
  Joints setpoint{};          ///< what the controller asks of its axes now
  Joints actual{};            ///< deg, mm
  Joints speed{};             ///< deg/s, mm/s
  bool is_enabled = false;
  bool is_running = false;
  bool has_error = false;
};
inline constexpr std::size_t kFrameBytes = 1440;

/// Nothing unless length, test word and figures are those of a frame.
std::optional<Frame> decode_frame(std::string_view bytes);

/// Cuts the feedback stream into frames, and finds the next frame again after bytes were lost.
class FrameStream {
 public:
  void push(std::string_view bytes);
  /// The next whole frame, or nothing until more is pushed.
  std::optional<Frame> next();
  std::uint64_t dropped_bytes() const { return dropped_bytes_; }

 private:
  std::string buffer_;
  std::uint64_t dropped_bytes_ = 0;
};

/// Cuts a reply stream at its semicolons. Never throws; is_overlong() when a reply has grown too long.
class ReplyStream {
 public:
  static constexpr std::size_t kReplyMax = 8192;
  void push(std::string_view bytes) { buffer_ += bytes; }
  std::optional<std::string> next();
  bool is_overlong() const { return buffer_.size() > kReplyMax; }
  bool is_empty() const { return buffer_.empty(); }
  void clear() { buffer_.clear(); }

 private:
  std::string buffer_;
};

}  // namespace hilbrush::dobot
