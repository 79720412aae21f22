#include <cstddef>
#include <cstdint>
#include <string>

#include "sampling/base/input_error.h"
#include "sampling/images/image_file.h"
#include "sampling/model/model_file.h"
#include "tests/fuzz/playground.h"

/// libFuzzer: the formats of sampling/model/files; the first byte picks one.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const hilbrush::Playground playground;
  if (size == 0) return 0;
  static const char* const kNames[] = {"input.obj", "input.ply", "input.off", "input.stl"};
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    hilbrush::load_model(playground.write(kNames[data[0] % 4], bytes), hilbrush::load_image_file);
  } catch (const hilbrush::InputError&) {
    // refused: fine
  }
  return 0;
}
