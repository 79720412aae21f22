#include <libserialport.h>

#include <memory>

#include "drivers/link/link.h"

namespace hilbrush {
namespace {

struct ClosePort {
  void operator()(sp_port* port) const {
    sp_close(port);
    sp_free_port(port);
  }
};
using Port = std::unique_ptr<sp_port, ClosePort>;

class SerialLink final : public Link {
 public:
  SerialLink(Port port, int fd, std::string name) : Link(fd, std::move(name)), port_(std::move(port)) {}

 private:
  Port port_;
};

std::string last_error() {
  const std::unique_ptr<char, void (*)(char*)> message(sp_last_error_message(), sp_free_error_message);
  return message && *message ? message.get() : "refused";
}

sp_parity to_library(Parity parity) {
  switch (parity) {
    case Parity::kEven:
      return SP_PARITY_EVEN;
    case Parity::kOdd:
      return SP_PARITY_ODD;
    case Parity::kNone:
      break;
  }
  return SP_PARITY_NONE;
}

}  // namespace

/// Reading and writing go through the port's descriptor and poll(), because the library does not distinguish
/// a hang-up from silence, neither when reading (0 bytes) nor when waiting.
std::unique_ptr<Link> open_serial_link(const std::string& name, int baud, Parity parity) {
  const auto check = [&](sp_return result, const char* what) {
    if (result == SP_OK) return;
    throw LinkError(name + ": " + what + ": " + (result == SP_ERR_FAIL ? last_error() : "not possible"));
  };
  sp_port* found = nullptr;
  check(sp_get_port_by_name(name.c_str(), &found), "no such serial port");
  Port port(found);
  check(sp_open(found, SP_MODE_READ_WRITE), "cannot be opened");
  check(sp_set_baudrate(found, baud), "cannot be set to its baud rate");
  check(sp_set_bits(found, 8), "cannot be set to 8 data bits");
  check(sp_set_parity(found, to_library(parity)), "cannot be set to its parity");
  check(sp_set_stopbits(found, 1), "cannot be set to 1 stop bit");
  check(sp_set_flowcontrol(found, SP_FLOWCONTROL_NONE), "cannot be set to no flow control");
  sp_flush(found, SP_BUF_BOTH);
  int fd = -1;
  check(sp_get_port_handle(found, &fd), "has no descriptor");
  return std::make_unique<SerialLink>(std::move(port), fd, name);
}

}  // namespace hilbrush
