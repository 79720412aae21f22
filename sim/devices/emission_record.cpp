#include "sim/devices/emission_record.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "sampling/base/write_all.h"

namespace hilbrush {

namespace {

static_assert(std::endian::native == std::endian::little, "records are written as they lie in memory");

constexpr std::string_view kHeader =
    "hilbrush emissions 1\n"
    "format binary_little_endian\n"
    "property double j1\nproperty double j2\nproperty double j3\nproperty double j4\nproperty double "
    "a\nproperty "
    "double c\n"
    "property double start_s\nproperty double length_s\nproperty double commanded_s\nproperty double "
    "power_w\n"
    "property uint is_moving\n"
    "property uint crc32\n"
    "end_header\n";

constexpr std::size_t kDoubleCount = kAxisCount + 4;
constexpr std::size_t kCheckedBytes = kDoubleCount * sizeof(double) + sizeof(std::uint32_t);
constexpr std::size_t kRecordBytes = kCheckedBytes + sizeof(std::uint32_t);
using Record = std::array<std::uint8_t, kRecordBytes>;

/// CRC-32 (ISO-HDLC, reflected polynomial 0xEDB88320).
constexpr std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t remainder = byte;
    for (int bit = 0; bit < 8; ++bit) remainder = (remainder >> 1) ^ (remainder & 1 ? 0xEDB88320u : 0u);
    table[byte] = remainder;
  }
  return table;
}

std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  static constexpr auto kTable = crc_table();
  std::uint32_t crc = ~0u;
  for (const std::uint8_t byte : bytes) crc = kTable[(crc ^ byte) & 0xff] ^ (crc >> 8);
  return ~crc;
}

Record encode(const Emission& emission) {
  std::array<double, kDoubleCount> numbers;
  std::copy(emission.joints.begin(), emission.joints.end(), numbers.begin());
  numbers[kAxisCount] = emission.start_s;
  numbers[kAxisCount + 1] = emission.length_s;
  numbers[kAxisCount + 2] = emission.commanded_s;
  numbers[kAxisCount + 3] = emission.power_w;
  const std::uint32_t is_moving = emission.is_moving ? 1 : 0;

  Record record;
  std::memcpy(record.data(), numbers.data(), sizeof numbers);
  std::memcpy(record.data() + sizeof numbers, &is_moving, sizeof is_moving);
  const std::uint32_t crc = crc32({record.data(), kCheckedBytes});
  std::memcpy(record.data() + kCheckedBytes, &crc, sizeof crc);
  return record;
}

/// False if the checksum does not fit.
bool decode(std::span<const std::uint8_t> record, Emission& emission) {
  std::uint32_t crc = 0;
  std::uint32_t is_moving = 0;
  std::memcpy(&crc, record.data() + kCheckedBytes, sizeof crc);
  if (crc != crc32(record.first(kCheckedBytes))) return false;
  std::array<double, kDoubleCount> numbers;
  std::memcpy(numbers.data(), record.data(), sizeof numbers);
  std::memcpy(&is_moving, record.data() + sizeof numbers, sizeof is_moving);
  std::copy_n(numbers.begin(), kAxisCount, emission.joints.begin());
  emission.start_s = numbers[kAxisCount];
  emission.length_s = numbers[kAxisCount + 1];
  emission.commanded_s = numbers[kAxisCount + 2];
  emission.power_w = numbers[kAxisCount + 3];
  emission.is_moving = is_moving != 0;
  return true;
}

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
  throw std::runtime_error(file.string() + ": " + what);
}

[[noreturn]] void fail_by_system(const std::filesystem::path& file, const std::string& what) {
  fail(file, what + ": " + std::strerror(errno));
}

void write_record(int fd, const std::filesystem::path& file, std::string_view bytes) {
  if (!write_all(fd, bytes)) fail_by_system(file, "cannot be written");
}

std::vector<std::uint8_t> read_all(int fd, const std::filesystem::path& file) {
  std::vector<std::uint8_t> bytes;
  std::array<std::uint8_t, 1 << 16> buffer;
  for (;;) {
    const ssize_t count = ::read(fd, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_by_system(file, "cannot be read");
    if (count == 0) return bytes;
    bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + count);
  }
}

struct Contents {
  std::vector<Emission> emissions;
  std::size_t whole_bytes = 0;  ///< header and whole records; 0 if even the header is torn
};

Contents parse(std::span<const std::uint8_t> bytes, const std::filesystem::path& file) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.size() < kHeader.size() && kHeader.starts_with(text)) return {};
  if (!text.starts_with(kHeader)) fail(file, "is not an emission record of this version");

  Contents contents;
  contents.whole_bytes = kHeader.size();
  const std::size_t record_count = (bytes.size() - kHeader.size()) / kRecordBytes;
  contents.emissions.resize(record_count);
  for (std::size_t i = 0; i < record_count; ++i) {
    if (!decode(bytes.subspan(contents.whole_bytes, kRecordBytes), contents.emissions[i])) {
      if (contents.whole_bytes + 2 * kRecordBytes <= bytes.size())
        fail(file, "emission " + std::to_string(i + 1) + " is damaged");
      contents.emissions.resize(i);
      break;
    }
    contents.whole_bytes += kRecordBytes;
  }
  return contents;
}

/// Owns an open file for the length of a function.
struct OpenFile {
  int fd;
  ~OpenFile() {
    if (fd >= 0) ::close(fd);
  }
};

}  // namespace

EmissionRecordFile::EmissionRecordFile(const std::filesystem::path& file) : file_(file) {
  OpenFile open{::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0640)};
  if (open.fd < 0) fail_by_system(file, "cannot be opened");
  const std::vector<std::uint8_t> bytes = read_all(open.fd, file);
  whole_bytes_ = parse(bytes, file).whole_bytes;
  if (whole_bytes_ < bytes.size() && ::ftruncate(open.fd, static_cast<off_t>(whole_bytes_)) != 0)
    fail_by_system(file, "cannot be cut to its whole records");
  if (whole_bytes_ == 0) {
    write_record(open.fd, file, kHeader);
    whole_bytes_ = kHeader.size();
  }
  fd_ = std::exchange(open.fd, -1);
}

EmissionRecordFile::~EmissionRecordFile() {
  ::close(fd_);
}

void EmissionRecordFile::append(const Emission& emission) {
  const Record record = encode(emission);
  try {
    write_record(fd_, file_, {reinterpret_cast<const char*>(record.data()), record.size()});
  } catch (...) {
    // Half a record (disk full) must not shift the ones that may follow.
    if (::ftruncate(fd_, static_cast<off_t>(whole_bytes_)) != 0) ::close(std::exchange(fd_, -1));
    throw;
  }
  whole_bytes_ += record.size();
}

std::vector<Emission> read_emission_record(const std::filesystem::path& file) {
  const OpenFile open{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  if (open.fd < 0) fail_by_system(file, "cannot be opened");
  return parse(read_all(open.fd, file), file).emissions;
}

}  // namespace hilbrush
