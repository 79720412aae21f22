#include <cstddef>
#include <cstdint>
#include <string>

#include "sampling/base/input_error.h"
#include "sampling/images/image_file.h"
#include "sampling/model/model_file.h"
#include "tests/fuzz/playground.h"

/// libFuzzer: VRML of both versions, with Inlines and images around it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const hilbrush::Playground playground;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    hilbrush::load_model(playground.write("input.wrl", bytes), hilbrush::load_image_file);
  } catch (const hilbrush::InputError&) {
    // refused: fine
  }
  return 0;
}
