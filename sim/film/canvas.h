#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "sampling/images/image_file.h"

namespace hilbrush {

using Color = std::array<std::uint8_t, 3>;  ///< sRGB

/// An RGB picture to draw on. Pixels outside are ignored.
class Canvas {
 public:
  Canvas(int width, int height, Color background);

  void set(int x, int y, Color color);
  /// A filled square of side 2 * radius + 1 around (x, y).
  void mark(int x, int y, int radius, Color color);
  /// A straight line, one pixel wide, ends included.
  void line(int x0, int y0, int x1, int y1, Color color);
  /// Capitals, digits and common signs in a 5 x 7 raster, enlarged `scale` times, top left corner at (x, y);
  /// anything else is left blank.
  void write(int x, int y, std::string_view text, int scale, Color color);

  static int text_width(std::string_view text, int scale) {
    return static_cast<int>(text.size()) * 6 * scale;
  }
  static int text_height(int scale) { return 7 * scale; }

  const Picture& picture() const { return picture_; }

 private:
  Picture picture_;
};

}  // namespace hilbrush
