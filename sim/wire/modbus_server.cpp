#include "sim/wire/modbus_server.h"

#include <array>

namespace hilbrush {
namespace {

constexpr std::size_t kReadMax = 125;
constexpr std::size_t kWriteMax = 123;
constexpr std::size_t kMbapBytes = 7;

std::uint8_t byte_at(std::string_view bytes, std::size_t i) {
  return static_cast<std::uint8_t>(bytes[i]);
}
std::uint16_t word_at(std::string_view bytes, std::size_t i) {
  return static_cast<std::uint16_t>(byte_at(bytes, i) << 8 | byte_at(bytes, i + 1));
}
void put_word(std::string& bytes, std::uint16_t word) {
  bytes += static_cast<char>(word >> 8);
  bytes += static_cast<char>(word & 0xff);
}

/// Bytes of a request on a serial line, known from its head; 0 if more must come, npos for a function that is
/// not supported.
std::size_t rtu_bytes(std::string_view buffer) {
  if (buffer.size() < 2) return 0;
  switch (byte_at(buffer, 1)) {
    case 3:
    case 4:
    case 6:
      return 8;
    case 16:
      return buffer.size() < 7 ? 0 : 9u + byte_at(buffer, 6);
    case 23:
      return buffer.size() < 11 ? 0 : 13u + byte_at(buffer, 10);
    default:
      return std::string_view::npos;
  }
}

std::string exception_pdu(std::uint8_t function, ModbusOutcome outcome) {
  return {static_cast<char>(function | 0x80), static_cast<char>(outcome)};
}

std::vector<std::uint16_t> words_of(std::string_view bytes) {
  std::vector<std::uint16_t> words(bytes.size() / 2);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = word_at(bytes, 2 * i);
  return words;
}

}  // namespace

std::uint16_t modbus_crc(std::string_view bytes) {
  std::uint16_t crc = 0xffff;
  for (const char c : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ static_cast<std::uint8_t>(c));
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint16_t>(crc & 1 ? crc >> 1 ^ 0xA001 : crc >> 1);
  }
  return crc;
}

std::size_t ModbusServer::message_bytes(std::string_view buffer) const {
  if (framing_ == Framing::kTcp) {
    if (buffer.size() < kMbapBytes + 1) return 0;
    const std::size_t length = 6u + word_at(buffer, 4);
    // A length that no request has: the stream is out of step, and nothing in it can be trusted.
    if (length < kMbapBytes + 1 || length > 260) return buffer.size();
    return buffer.size() < length ? 0 : length;
  }
  const std::size_t length = rtu_bytes(buffer);
  if (length == std::string_view::npos) return buffer.size();
  if (length == 0 || buffer.size() < length) return 0;
  // Not a frame: on a line one would wait for silence; what has come so far is thrown away.
  return modbus_crc(buffer.substr(0, length)) == 0 ? length : buffer.size();
}

bool ModbusServer::parse(std::string_view message, Request& request) const {
  if (framing_ == Framing::kTcp) {
    if (message.size() < kMbapBytes + 1 || word_at(message, 2) != 0 ||
        message.size() != 6u + word_at(message, 4))
      return false;
    request = {word_at(message, 0), byte_at(message, 6), message.substr(kMbapBytes)};
    return true;
  }
  if (message.size() < 4 || modbus_crc(message) != 0) return false;
  request = {0, byte_at(message, 0), message.substr(1, message.size() - 3)};
  return true;
}

std::string ModbusServer::framed(const Request& request, const std::string& pdu) const {
  std::string frame;
  if (framing_ == Framing::kTcp) {
    put_word(frame, request.transaction);
    put_word(frame, 0);
    put_word(frame, static_cast<std::uint16_t>(pdu.size() + 1));
    frame += static_cast<char>(request.unit);
    return frame + pdu;
  }
  frame += static_cast<char>(request.unit);
  frame += pdu;
  const std::uint16_t crc = modbus_crc(frame);
  frame += static_cast<char>(crc & 0xff);
  frame += static_cast<char>(crc >> 8);
  return frame;
}

std::string ModbusServer::answer(std::string_view message) {
  Request request;
  if (!parse(message, request)) return {};
  const auto unit = units_.find(request.unit);
  if (unit == units_.end()) {
    // On a serial line no unit answers; a TCP gateway reports that.
    if (framing_ == Framing::kRtu) return {};
    return framed(request, exception_pdu(byte_at(request.pdu, 0), ModbusOutcome::kNoSuchUnit));
  }
  return framed(request, obey(*unit->second, request.pdu));
}

std::string ModbusServer::obey(RegisterBank& bank, std::string_view pdu) {
  const std::uint8_t function = byte_at(pdu, 0);
  const auto fail = [&](ModbusOutcome outcome) { return exception_pdu(function, outcome); };
  const auto read = [&](std::uint16_t address, std::size_t count) -> std::string {
    if (count < 1 || count > kReadMax) return fail(ModbusOutcome::kIllegalValue);
    std::vector<std::uint16_t> values(count);
    if (const auto outcome = bank.read(address, values); outcome != ModbusOutcome::kDone)
      return fail(outcome);
    std::string reply{static_cast<char>(function), static_cast<char>(2 * count)};
    for (const std::uint16_t value : values) put_word(reply, value);
    return reply;
  };
  const auto write = [&](std::uint16_t address, std::size_t count, std::string_view data) {
    if (count < 1 || count > kWriteMax || data.size() != 2 * count) return ModbusOutcome::kIllegalValue;
    return bank.write(address, words_of(data));
  };

  if ((function == 3 || function == 4) && pdu.size() == 5) return read(word_at(pdu, 1), word_at(pdu, 3));
  if (function == 6 && pdu.size() == 5) {
    const auto outcome = write(word_at(pdu, 1), 1, pdu.substr(3));
    return outcome == ModbusOutcome::kDone ? std::string(pdu) : fail(outcome);
  }
  if (function == 16 && pdu.size() >= 6 && pdu.size() == 6u + byte_at(pdu, 5)) {
    const auto outcome = write(word_at(pdu, 1), word_at(pdu, 3), pdu.substr(6));
    return outcome == ModbusOutcome::kDone ? std::string(pdu.substr(0, 5)) : fail(outcome);
  }
  if (function == 23 && pdu.size() >= 10 && pdu.size() == 10u + byte_at(pdu, 9)) {
    const auto outcome = write(word_at(pdu, 5), word_at(pdu, 7), pdu.substr(10));
    return outcome == ModbusOutcome::kDone ? read(word_at(pdu, 1), word_at(pdu, 3)) : fail(outcome);
  }
  const bool is_known = function == 3 || function == 4 || function == 6 || function == 16 || function == 23;
  return fail(is_known ? ModbusOutcome::kIllegalValue : ModbusOutcome::kIllegalFunction);
}

std::string ModbusServer::refusal(std::string_view message, bool has_failed) {
  Request request;
  if (!parse(message, request)) return {};
  const auto outcome = has_failed ? ModbusOutcome::kDeviceFailure : ModbusOutcome::kIllegalValue;
  return framed(request, exception_pdu(byte_at(request.pdu, 0), outcome));
}

/// TCP: another transaction's. RTU: another unit's, with a checksum that fits.
std::string ModbusServer::misaddressed(std::string answer) const {
  if (answer.empty()) return answer;
  if (framing_ == Framing::kTcp) {
    answer[1] = static_cast<char>(answer[1] + 1);
    return answer;
  }
  answer[0] = static_cast<char>(answer[0] + 1);
  answer.resize(answer.size() - 2);
  const std::uint16_t crc = modbus_crc(answer);
  answer += static_cast<char>(crc & 0xff);
  answer += static_cast<char>(crc >> 8);
  return answer;
}

/// RTU: the checksum no longer fits. TCP has none, and a damaged body would be the transport's fault: there
/// it is the protocol identifier that is wrong.
std::string ModbusServer::damaged(std::string answer) const {
  const std::size_t place = framing_ == Framing::kTcp ? 2 : answer.size() - 1;
  if (answer.size() > place) answer[place] = static_cast<char>(answer[place] ^ 0x5A);
  return answer;
}

}  // namespace hilbrush
