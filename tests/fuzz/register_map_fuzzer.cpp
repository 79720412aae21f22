#include <cstdint>
#include <string>

#include "config/cell_devices.h"
#include "config/register_map_file.h"
#include "sampling/base/input_error.h"

/// libFuzzer: register maps and cell files, which people write.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    hilbrush::register_map_from_json(text, "map.json");
  } catch (const hilbrush::InputError&) {
    // refused: fine
  }
  try {
    hilbrush::cell_devices_from_json(text, "cell.json");
  } catch (const hilbrush::InputError&) {
    // refused: fine
  }
  return 0;
}
