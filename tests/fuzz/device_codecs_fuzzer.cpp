#include <cstdint>

#include "tests/fuzz/device_codecs.h"

/// libFuzzer: what robots, drives, lasers and a laser's guard may be sent.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  hilbrush::decode_as_every_device({reinterpret_cast<const char*>(data), size});
  return 0;
}
