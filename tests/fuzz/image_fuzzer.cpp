#include <cstddef>
#include <cstdint>
#include <string>

#include "sampling/images/image_file.h"
#include "tests/fuzz/playground.h"

/// libFuzzer: image files of every kind that is read; the first byte picks the ending.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const hilbrush::Playground playground;
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  (void)hilbrush::load_image_file(playground.write(data[0] % 2 ? "input.tga" : "input.png", bytes), 1 << 22);
  return 0;
}
