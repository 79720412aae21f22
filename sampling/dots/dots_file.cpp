#include "sampling/dots/dots_file.h"

#include <array>
#include <bit>
#include <cstring>
#include <sstream>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

static_assert(std::endian::native == std::endian::little, "the rows are written as they lie in memory");

constexpr std::size_t kRowBytes = 3 * sizeof(double) + 5 * sizeof(float) + sizeof(std::uint32_t) + 1;
constexpr std::size_t kRowsAtOnce = 4096;

std::string header(double pitch_m, std::uint64_t dot_count, std::span<const std::string> reason_names) {
  std::ostringstream out;
  out.precision(12);
  out << "ply\nformat binary_little_endian 1.0\ncomment dots of Hilbrush in painting order; meters, object "
         "frame\n"
      << "comment pitch_m " << pitch_m << '\n';
  for (std::size_t code = 0; code < reason_names.size(); ++code)
    out << "comment reason " << code << ' ' << reason_names[code] << '\n';
  out << "element vertex " << dot_count << '\n';
  for (const char* name : {"x", "y", "z"}) out << "property double " << name << '\n';
  for (const char* name : {"nx", "ny", "nz", "tone", "level"}) out << "property float " << name << '\n';
  out << "property uint component\nproperty uchar reason\nend_header\n";
  return out.str();
}

template <class T>
char* put(char* at, const T& value) {
  std::memcpy(at, &value, sizeof value);
  return at + sizeof value;
}

char* put_dot(char* at, const Dot& dot, std::uint8_t reason) {
  for (int k = 0; k < 3; ++k) at = put(at, dot.position_O[k]);
  for (int k = 0; k < 3; ++k) at = put(at, dot.normal_O[k]);
  at = put(at, dot.tone);
  at = put(at, dot.level);
  at = put(at, dot.component);
  return put(at, reason);
}

}  // namespace

DotsFile::DotsFile(const std::filesystem::path& file, double pitch_m, std::uint64_t dot_count,
                   std::span<const std::string> reason_names)
    : file_(file), out_(file, std::ios::binary | std::ios::trunc), missing_(dot_count) {
  if (!out_) throw InputError(file.string(), "cannot be opened for writing");
  const std::string text = header(pitch_m, dot_count, reason_names);
  out_.write(text.data(), static_cast<std::streamsize>(text.size()));
}

void DotsFile::add(std::span<const Dot> dots, std::span<const std::uint8_t> reasons) {
  CHECK(reasons.empty() || reasons.size() == dots.size());
  CHECK_LE(dots.size(), missing_);
  missing_ -= dots.size();
  std::array<char, kRowBytes * kRowsAtOnce> rows;
  for (std::size_t i = 0; i < dots.size();) {
    char* end = rows.data();
    for (std::size_t k = 0; k < kRowsAtOnce && i < dots.size(); ++k, ++i)
      end = put_dot(end, dots[i], reasons.empty() ? std::uint8_t{0} : reasons[i]);
    out_.write(rows.data(), end - rows.data());
  }
}

void DotsFile::close() {
  CHECK_EQ(missing_, std::uint64_t{0});
  out_.close();
  if (!out_) throw InputError(file_.string(), "cannot be written: is the disk full?");
}

void write_dots(const DotSequence& sequence, std::span<const std::uint8_t> reasons,
                std::span<const std::string> reason_names, const std::filesystem::path& file) {
  CHECK_EQ(reasons.size(), sequence.dots.size());
  DotsFile out(file, sequence.pitch_m, sequence.dots.size(), reason_names);
  out.add(sequence.dots, reasons);
  out.close();
}

}  // namespace hilbrush
