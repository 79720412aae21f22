#include "drivers/dobot/dobot_codec.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "drivers/link/line_codec.h"
#include "drivers/number_text.h"

namespace hilbrush::dobot {
namespace {

using line_codec::trimmed;

static_assert(std::endian::native == std::endian::little,
              "the feedback packet is little-endian and copied as it is");

// Byte offsets in the feedback packet.
constexpr std::size_t kLengthAt = 0, kDigitalOutputsAt = 16, kModeAt = 24, kTimeAt = 32, kTestWordAt = 48,
                      kSetpointAt = 192, kActualAt = 432, kSpeedAt = 480, kEnabledAt = 1026,
                      kRunningAt = 1028, kErrorAt = 1029;
constexpr std::uint64_t kTestWord = 0x0123456789ABCDEF;
constexpr double kFigureMax = 1e6;  ///< no joint of an arm is ever there

template <class T>
T value_at(std::string_view bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

bool read_joints(std::string_view bytes, std::size_t offset, Joints& joints) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    joints[i] = value_at<double>(bytes, offset + i * sizeof(double));
    if (!(std::abs(joints[i]) < kFigureMax)) return false;
  }
  return true;
}

bool is_frame_start(std::string_view bytes) {
  return value_at<std::uint16_t>(bytes, kLengthAt) == kFrameBytes &&
         value_at<std::uint64_t>(bytes, kTestWordAt) == kTestWord;
}

struct Call {
  std::string_view name;
  std::ptrdiff_t commas = 0;
  bool has_parameters = false;
};

std::optional<Call> parse_call(std::string_view text) {
  text = trimmed(text);
  const std::size_t open = text.find('(');
  if (open == std::string_view::npos || open == 0 || text.back() != ')') return std::nullopt;
  const std::string_view inside = trimmed(text.substr(open + 1, text.size() - open - 2));
  return Call{trimmed(text.substr(0, open)), std::count(inside.begin(), inside.end(), ','), !inside.empty()};
}

}  // namespace

std::string encode(std::string_view name, std::initializer_list<long> parameters) {
  std::string text(name);
  text += '(';
  for (const long parameter : parameters) {
    if (text.back() != '(') text += ',';
    text += std::to_string(parameter);
  }
  return text + ')';
}

std::string encode_joint_move(const Joints& joints) {
  std::string text = "JointMovJ(";
  for (const double joint : joints) {
    if (text.back() != '(') text += ',';
    text += fixed_text(joint, 6);
  }
  return text + ')';
}

std::array<std::string, 4> encode_pulse(int output, long pulse_ms) {
  return {encode("DO", {output, 1}), encode("wait", {pulse_ms}), encode("DO", {output, 0}), encode("Sync")};
}

std::optional<Reply> decode_reply(std::string_view text) {
  text = trimmed(text);
  Reply reply;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, reply.error);
  if (error != std::errc()) return std::nullopt;
  std::string_view tail = trimmed({rest, static_cast<std::size_t>(end - rest)});
  if (tail.empty() || tail.front() != ',') return std::nullopt;
  tail = trimmed(tail.substr(1));
  const std::size_t close = tail.rfind('}');  // values may hold braces; the echo has none
  if (tail.empty() || tail.front() != '{' || close == std::string_view::npos) return std::nullopt;
  reply.values = tail.substr(1, close - 1);
  tail = trimmed(tail.substr(close + 1));
  if (tail.empty() || tail.front() != ',') return std::nullopt;
  tail = trimmed(tail.substr(1));
  if (!parse_call(tail)) return std::nullopt;
  reply.command = tail;
  return reply;
}

bool is_echo(std::string_view echo, std::string_view command) {
  const auto a = parse_call(echo);
  const auto b = parse_call(command);
  if (!a || !b || a->commas != b->commas || a->has_parameters != b->has_parameters) return false;
  return line_codec::equals_ignoring_case(a->name, b->name);
}

std::string error_text(long error) {
  constexpr long kNoSuchCommand = -10000;
  constexpr long kParameterCount = -20000;
  constexpr long kParameterType = -30000;
  constexpr long kParameterRange = -40000;
  const auto is_of = [error](long base) { return error < base && error > base - 100; };
  if (error == -1) return "is refused";
  if (error == kNoSuchCommand) return "is unknown to the controller";
  if (error == kParameterCount) return "is refused: the number of parameters is wrong";
  if (is_of(kParameterType))
    return "is refused: parameter " + std::to_string(kParameterType - error) + " is of a wrong type";
  if (is_of(kParameterRange))
    return "is refused: parameter " + std::to_string(kParameterRange - error) + " is out of range";
  return "is refused with error " + std::to_string(error);
}

const char* mode_name(Mode mode) {
  switch (mode) {
    case Mode::kInit:
      return "starting up";
    case Mode::kBrakeOpen:
      return "with its brakes open";
    case Mode::kPowerOff:
      return "powered off";
    case Mode::kDisabled:
      return "disabled";
    case Mode::kEnabled:
      return "enabled and idle";
    case Mode::kDrag:
      return "being dragged by hand";
    case Mode::kRunning:
      return "running";
    case Mode::kRecording:
      return "recording";
    case Mode::kError:
      return "in alarm";
    case Mode::kPause:
      return "paused";
    case Mode::kJog:
      return "jogging";
  }
  return "in an unknown mode";
}

std::optional<Frame> decode_frame(std::string_view bytes) {
  if (bytes.size() != kFrameBytes || !is_frame_start(bytes)) return std::nullopt;
  // A second test word: the frame broke off, and the next one began in the middle of it.
  const std::string_view test_word(reinterpret_cast<const char*>(&kTestWord), sizeof kTestWord);
  if (bytes.find(test_word, kTestWordAt + 1) != std::string_view::npos) return std::nullopt;
  Frame frame;
  frame.digital_outputs = value_at<std::uint64_t>(bytes, kDigitalOutputsAt);
  frame.mode = static_cast<Mode>(value_at<std::uint64_t>(bytes, kModeAt));
  frame.time_ms = value_at<std::uint64_t>(bytes, kTimeAt);
  frame.is_enabled = value_at<std::uint8_t>(bytes, kEnabledAt) != 0;
  frame.is_running = value_at<std::uint8_t>(bytes, kRunningAt) != 0;
  frame.has_error = value_at<std::uint8_t>(bytes, kErrorAt) != 0;
  if (!read_joints(bytes, kSetpointAt, frame.setpoint) || !read_joints(bytes, kActualAt, frame.actual) ||
      !read_joints(bytes, kSpeedAt, frame.speed))
    return std::nullopt;
  return frame;
}

void FrameStream::push(std::string_view bytes) {
  buffer_ += bytes;
}

std::optional<Frame> FrameStream::next() {
  std::size_t start = 0;
  std::optional<Frame> frame;
  for (; !frame && start + kFrameBytes <= buffer_.size(); ++start)
    frame = decode_frame(std::string_view(buffer_).substr(start, kFrameBytes));
  // Without a frame, `start` is where the next one could still begin; with one, just behind its beginning.
  dropped_bytes_ += frame ? start - 1 : start;
  buffer_.erase(0, frame ? start - 1 + kFrameBytes : start);
  return frame;
}

std::optional<std::string> ReplyStream::next() {
  const std::size_t end = buffer_.find(';');
  if (end == std::string::npos) return std::nullopt;
  std::string reply = buffer_.substr(0, end);
  buffer_.erase(0, end + 1);
  return reply;
}

}  // namespace hilbrush::dobot
