#include "sim/wire/wire_session.h"

#include <algorithm>

namespace hilbrush {

void WireSession::receive(std::string_view bytes) {
  if (faults_.is_line_down(device_)) return;
  input_ += bytes;
  for (;;) {
    const std::size_t length = message_bytes(input_);
    if (length == 0) break;
    const std::string message = input_.substr(0, length);
    input_.erase(0, length);
    take_message(message);
  }
  if (input_.size() > kMaxMessage) input_.clear();
}

void WireSession::take_message(std::string_view message) {
  const auto fault = faults_.on_message(device_);
  if (!fault) {
    send(answer(message));
    return;
  }
  switch (fault->kind) {
    case WireFaultKind::kLostRequest:
      return;
    case WireFaultKind::kSilence:
      answer(message);
      return;
    case WireFaultKind::kHalfFrame: {
      const std::string whole = answer(message);
      send(whole.substr(0, whole.size() / 2));
      return;
    }
    case WireFaultKind::kWrongId:
      send(misaddressed(answer(message)));
      return;
    case WireFaultKind::kWrongChecksum:
      send(damaged(answer(message)));
      return;
    case WireFaultKind::kException:
    case WireFaultKind::kRefused:
      send(refusal(message, fault->kind == WireFaultKind::kException));
      return;
    case WireFaultKind::kLateAnswer:
      send(answer(message), cell_.now_s() + fault->duration_s);
      return;
    case WireFaultKind::kDroppedConnection:
      faults_.set_line_down(device_, fault->duration_s);
      is_dropped_ = true;
      input_.clear();
      return;
    default:
      send(answer(message));
  }
}

std::string WireSession::damaged(std::string answer) const {
  if (!answer.empty()) answer[answer.size() / 2] = static_cast<char>(answer[answer.size() / 2] ^ 0x15);
  return answer;
}

void WireSession::send(std::string bytes, double due_s) {
  if (!bytes.empty()) output_.push_back({due_s, std::move(bytes)});
}

std::string WireSession::take_output() {
  std::string due;
  while (!output_.empty() && output_.front().due_s <= cell_.now_s()) {
    if (!faults_.is_line_down(device_)) due += output_.front().bytes;
    output_.pop_front();
  }
  return due;
}

double WireSession::next_event_s() const {
  return output_.empty() ? TrueCell::kNever : output_.front().due_s;
}

}  // namespace hilbrush
