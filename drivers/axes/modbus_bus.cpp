#include "drivers/axes/modbus_bus.h"

#include <fcntl.h>
#include <modbus.h>
#include <sys/select.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>

#include "drivers/number_text.h"

namespace hilbrush {
namespace {

std::string endpoint_name(const ModbusEndpoint& endpoint) {
  return endpoint.host.empty() ? endpoint.port : endpoint.host + ":" + std::to_string(endpoint.tcp_port);
}

bool is_exception(int error) {
  return error >= EMBXILFUN && error <= EMBXGTAR;
}

/// The peer closed the connection; not: it is silent, or its answer is damaged.
bool is_hang_up(int error) {
  return error == ECONNRESET || error == EPIPE || error == EBADF || error == ECONNREFUSED || error == EIO ||
         error == ENOTCONN || error == ENXIO;
}

/// libmodbus waits by select(), which knows no descriptor beyond FD_SETSIZE and would end the program.
void check_descriptors(const std::string& name) {
  const int next = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (next >= 0) ::close(next);
  if (next < 0 || next >= FD_SETSIZE)
    throw LinkError(name + ": cannot be connected: this process has too many files and clients open");
}

std::string words_text(std::span<const std::uint16_t> words) {
  std::string text;
  for (const std::uint16_t value : words) text += ' ' + hex_text(value, 4);
  return text;
}

std::string request_text(const char* verb, int unit, int address, std::size_t count) {
  return "unit " + std::to_string(unit) + ' ' + verb + " 0x" +
         hex_text(static_cast<std::uint32_t>(address), 4) + " x " + std::to_string(count);
}

}  // namespace

ModbusBus::ModbusBus(const ModbusEndpoint& endpoint, double reply_s)
    : endpoint_(endpoint), reply_s_(reply_s), name_(endpoint_name(endpoint)) {}

ModbusBus::~ModbusBus() {
  close();
}

void ModbusBus::connect() {
  close();
  const std::lock_guard lock(mutex_);
  check_descriptors(name_);
  const ModbusEndpoint& at = endpoint_;
  context_ = at.host.empty() ? modbus_new_rtu(at.port.c_str(), at.baud, at.parity, 8, 1)
                             : modbus_new_tcp_pi(at.host.c_str(), std::to_string(at.tcp_port).c_str());
  if (context_ == nullptr) throw LinkError(name_ + ": no address for Modbus: " + modbus_strerror(errno));
  modbus_set_error_recovery(context_, MODBUS_ERROR_RECOVERY_NONE);
  constexpr std::uint32_t kConnectS = 2;
  modbus_set_response_timeout(context_, kConnectS, 0);
  if (modbus_connect(context_) != 0) {
    const int error = errno;
    modbus_free(context_);
    context_ = nullptr;
    throw LinkError(name_ + ": cannot be connected: " + modbus_strerror(error));
  }
  const auto microseconds = static_cast<std::uint32_t>(reply_s_ * 1e6);
  modbus_set_response_timeout(context_, microseconds / 1000000, microseconds % 1000000);
  is_open_ = true;
}

void ModbusBus::close() noexcept {
  const std::lock_guard lock(mutex_);
  is_open_ = false;
  if (context_ == nullptr) return;
  modbus_close(context_);
  modbus_free(context_);
  context_ = nullptr;
}

template <class Exchange>
void ModbusBus::exchange(int unit, const std::string& what, int attempts, Exchange work) {
  const std::unique_lock lock(mutex_, deadline_in(3 * reply_s_));
  if (!lock) throw LinkError(name_ + ": the bus is busy with a request that gets no answer");
  if (!is_open_) throw LinkError(name_ + ": not connected");
  modbus_set_slave(context_, unit);
  for (int attempt = 1;; ++attempt) {
    messages_.sent(what);
    if (work() >= 0) return;
    const int error = errno;
    messages_.received(modbus_strerror(error));
    modbus_flush(context_);  // an answer that comes late belongs to no request
    const std::string sentence = name_ + ": " + what + ": " + modbus_strerror(error) + messages_.text();
    if (is_exception(error)) throw DriverError(sentence);
    if (is_hang_up(error)) is_open_ = false;
    if (attempt == attempts || !is_open_) throw LinkError(sentence);
  }
}

void ModbusBus::read(int unit, int address, std::span<std::uint16_t> words) {
  exchange(unit, request_text("read", unit, address, words.size()), 2, [&] {
    const int count = modbus_read_registers(context_, address, static_cast<int>(words.size()), words.data());
    if (count >= 0) messages_.received(words_text(words));
    return count;
  });
}

void ModbusBus::write(int unit, int address, std::span<const std::uint16_t> words) {
  exchange(unit, request_text("write", unit, address, words.size()) + words_text(words), 1, [&] {
    const int count = modbus_write_registers(context_, address, static_cast<int>(words.size()), words.data());
    if (count >= 0) messages_.received("ok");
    return count;
  });
}

void ModbusBus::write_one(int unit, int address, std::uint16_t word) {
  exchange(unit, request_text("write one", unit, address, 1) + words_text({&word, 1}), 1, [&] {
    const int count = modbus_write_register(context_, address, word);
    if (count >= 0) messages_.received("ok");
    return count;
  });
}

}  // namespace hilbrush
