#include <algorithm>
#include <cmath>

#include "sampling/base/text.h"
#include "sim/wire/dobot_controller.h"

namespace hilbrush {
namespace {

/// Between commas that are in no braces.
std::vector<std::string> split_arguments(std::string_view list) {
  std::vector<std::string> arguments;
  if (trimmed(list).empty()) return arguments;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= list.size(); ++i) {
    if (i < list.size() && (list[i] == '{' || list[i] == '(')) ++depth;
    if (i < list.size() && (list[i] == '}' || list[i] == ')')) --depth;
    if (i < list.size() && (list[i] != ',' || depth > 0)) continue;
    arguments.emplace_back(trimmed(list.substr(begin, i - begin)));
    begin = i + 1;
  }
  return arguments;
}

}  // namespace

/// A command ends with its closing parenthesis; a line end or semicolon after it belongs to nothing.
std::size_t DobotTextSession::message_bytes(std::string_view buffer) const {
  const std::size_t open = buffer.find('(');
  const std::size_t line_end = buffer.find('\n');
  if (open == std::string_view::npos || line_end < open)
    return line_end == std::string_view::npos ? 0 : line_end + 1;
  int depth = 0;
  for (std::size_t i = open; i < buffer.size(); ++i) {
    if (buffer[i] == '(') ++depth;
    if (buffer[i] == ')' && --depth == 0) {
      std::size_t end = i + 1;
      while (end < buffer.size() && (buffer[end] == '\r' || buffer[end] == '\n' || buffer[end] == ';')) ++end;
      return end;
    }
  }
  return 0;
}

std::string DobotTextSession::answer(std::string_view message) {
  std::string command(trimmed(message));
  while (!command.empty() && command.back() == ';') command.pop_back();
  if (command.empty()) return {};
  const std::size_t open = command.find('(');
  if (open == std::string::npos || command.back() != ')') return "-10000,{}," + command + ";";
  const std::string name = lower_case(trimmed(std::string_view(command).substr(0, open)));
  const auto arguments =
      split_arguments(std::string_view(command).substr(open + 1, command.size() - open - 2));
  if (port_ == Port::kMotion && (name == "sync" || name == "syncall")) {
    syncs_.push_back({controller_.accepted_count(), controller_.dropped_count(), command});
    run();
    return {};
  }
  const std::string result = port_ == Port::kDashboard ? controller_.dashboard(name, arguments)
                                                       : controller_.motion(name, arguments);
  return result + command + ";";
}

void DobotTextSession::run() {
  while (!syncs_.empty() && controller_.ended_count() >= syncs_.front().until) {
    const bool is_done = controller_.dropped_count() == syncs_.front().dropped;
    send((is_done ? "0,{}," : "-1,{},") + syncs_.front().command + ";");
    syncs_.pop_front();
  }
}

std::string DobotTextSession::refusal(std::string_view message, bool) {
  return "-1,{}," + std::string(trimmed(message)) + ";";
}

/// The echo is another command's.
std::string DobotTextSession::misaddressed(std::string answer) const {
  const std::size_t brace = answer.find("},");
  return brace == std::string::npos ? answer : answer.substr(0, brace + 2) + "GetTime();";
}

DobotFeedbackSession::DobotFeedbackSession(DobotController& controller, TrueCell& cell, FaultInjector& faults)
    : WireSession(WireDevice::kRobot, cell, faults), controller_(controller), next_frame_s_(cell.now_s()) {}

void DobotFeedbackSession::run() {
  if (cell_.now_s() < next_frame_s_) return;
  send(controller_.frame());
  const double frame_s = controller_.options().frame_s;
  next_frame_s_ = (std::floor(cell_.now_s() / frame_s + 1e-6) + 1) * frame_s;
}

double DobotFeedbackSession::next_event_s() const {
  return std::min(next_frame_s_, WireSession::next_event_s());
}

}  // namespace hilbrush
