#include "planner/cell_model/program_file.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <system_error>

#include "sampling/base/sha256.h"
#include "sampling/base/text.h"

namespace hilbrush {
namespace {

static_assert(std::endian::native == std::endian::little, "records are written as they lie in memory");

constexpr std::string_view kMagic =
    "ply\nformat binary_little_endian 1.0\ncomment hilbrush exposure program 1\n";
constexpr std::string_view kHashKey = "comment sha256_of_all_below ";
constexpr std::size_t kHashDigits = 64;
constexpr std::size_t kHeaderBytesMax = 8192;
constexpr std::size_t kExposureBytes = 3 * 8 + 3 * 4 + 2 * 4 + 6 * 8 + 3 * 4 + 4;
constexpr std::size_t kViaBytes = 4 + 6 * 8;
constexpr std::size_t kBlockRecords = 4096;

constexpr std::string_view kExposureProperties =
    "property double x\nproperty double y\nproperty double z\n"
    "property float nx\nproperty float ny\nproperty float nz\n"
    "property float tone\nproperty float energy\n"
    "property double j1\nproperty double j2\nproperty double j3\nproperty double j4\nproperty double "
    "a\nproperty "
    "double c\n"
    "property float power\nproperty float pulse\nproperty float incidence\nproperty uint dot\n";
constexpr std::string_view kViaProperties =
    "property uint before\n"
    "property double j1\nproperty double j2\nproperty double j3\nproperty double j4\nproperty double "
    "a\nproperty "
    "double c\n";

/// What the header says besides the layout.
struct Header {
  Provenance provenance;
  double pitch_m = 0;
  std::uint64_t exposure_count = 0;
  std::uint64_t via_count = 0;
};

/// The header's part that the hash covers: all after the hash's own line.
std::string header_text(const Header& header) {
  std::string text;
  text += "comment model_sha256 " + header.provenance.model_sha256 + '\n';
  text += "comment settings_sha256 " + header.provenance.settings_sha256 + '\n';
  text += "comment cell_sha256 " + header.provenance.cell_sha256 + '\n';
  text += "comment version " + header.provenance.version + '\n';
  text += "comment pitch_m " + number(header.pitch_m, 17) + '\n';
  text += "element vertex " + std::to_string(header.exposure_count) + '\n';
  text += kExposureProperties;
  text += "element via " + std::to_string(header.via_count) + '\n';
  text += kViaProperties;
  text += "end_header\n";
  return text;
}

/// Takes a `T` from, or puts it at, the cursor of a record.
template <class T>
void put(std::uint8_t*& at, const T& value) {
  std::memcpy(at, &value, sizeof value);
  at += sizeof value;
}
template <class T>
void take(const std::uint8_t*& at, T& value) {
  std::memcpy(&value, at, sizeof value);
  at += sizeof value;
}

/// One list of fields for both directions, so that they cannot drift apart.
template <class Exposure_, class Field>
void for_each_field(Exposure_& e, Field field) {
  for (int i = 0; i < 3; ++i) field(e.position_O[i]);
  for (int i = 0; i < 3; ++i) field(e.normal_O[i]);
  field(e.tone);
  field(e.energy_j);
  for (auto& joint : e.joints) field(joint);
  field(e.power_w);
  field(e.pulse_s);
  field(e.incidence);
  field(e.dot_index);
}
template <class Field>
void for_each_field(const Via& via, Field field) {
  field(via.before_exposure);
  for (const auto& joint : via.joints) field(joint);
}
template <class Field>
void for_each_field(Via& via, Field field) {
  field(via.before_exposure);
  for (auto& joint : via.joints) field(joint);
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& sentence) {
  throw ProgramFileError(file.string() + ": " + sentence);
}

template <class Record>
void write_records(std::ostream& out, Sha256& hash, const std::vector<Record>& records,
                   std::size_t record_bytes) {
  std::vector<std::uint8_t> block(kBlockRecords * record_bytes);
  for (std::size_t first = 0; first < records.size(); first += kBlockRecords) {
    std::uint8_t* at = block.data();
    const std::size_t last = std::min(first + kBlockRecords, records.size());
    for (std::size_t i = first; i < last; ++i)
      for_each_field(records[i], [&at](const auto& value) { put(at, value); });
    const std::size_t bytes = static_cast<std::size_t>(at - block.data());
    hash.update(std::span(block.data(), bytes));
    out.write(reinterpret_cast<const char*>(block.data()), static_cast<std::streamsize>(bytes));
  }
}

template <class Record>
std::vector<Record> read_records(std::istream& in, Sha256& hash, std::size_t count,
                                 std::size_t record_bytes) {
  std::vector<Record> records(count);
  std::vector<std::uint8_t> block(kBlockRecords * record_bytes);
  for (std::size_t first = 0; first < count; first += kBlockRecords) {
    const std::size_t last = std::min(first + kBlockRecords, count);
    const std::size_t bytes = (last - first) * record_bytes;
    if (!in.read(reinterpret_cast<char*>(block.data()), static_cast<std::streamsize>(bytes))) return {};
    hash.update(std::span(block.data(), bytes));
    const std::uint8_t* at = block.data();
    for (std::size_t i = first; i < last; ++i)
      for_each_field(records[i], [&at](auto& value) { take(at, value); });
  }
  return records;
}

/// Removes the unfinished file unless it was renamed into place.
class PartFile {
 public:
  explicit PartFile(const std::filesystem::path& file) : path_(file.string() + ".part") {}
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;
  ~PartFile() {
    std::error_code ignored;
    if (!is_renamed_) std::filesystem::remove(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }
  void rename_to(const std::filesystem::path& file) {
    std::error_code error;
    std::filesystem::rename(path_, file, error);
    if (error) refuse(file, "cannot be written: " + error.message());
    is_renamed_ = true;
  }

 private:
  std::filesystem::path path_;
  bool is_renamed_ = false;
};

bool is_one_line(const std::string& text) {
  for (const char c : text)
    if (static_cast<unsigned char>(c) < 0x20) return false;
  return text.size() <= 256;
}

/// The value of the next line, which must start with `key`.
std::string_view take_line(std::string_view& text, std::string_view key, const std::filesystem::path& file) {
  const std::size_t end = text.find('\n');
  if (end == text.npos || text.substr(0, key.size()) != key || end < key.size())
    refuse(file, "its header lacks the line \"" + std::string(key) + "...\"");
  const std::string_view value = text.substr(key.size(), end - key.size());
  text.remove_prefix(end + 1);
  return value;
}

template <class Number>
Number to_number(std::string_view text, const char* what, const std::filesystem::path& file) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size())
    refuse(file, std::string("its header's ") + what + " is no number");
  return number;
}

/// Parses the hashed part of the header. What it does not understand is caught by writing it again: see
/// read_header.
Header parse_header(std::string_view text, const std::filesystem::path& file) {
  Header header;
  header.provenance.model_sha256 = take_line(text, "comment model_sha256 ", file);
  header.provenance.settings_sha256 = take_line(text, "comment settings_sha256 ", file);
  header.provenance.cell_sha256 = take_line(text, "comment cell_sha256 ", file);
  header.provenance.version = take_line(text, "comment version ", file);
  header.pitch_m = to_number<double>(take_line(text, "comment pitch_m ", file), "pitch_m", file);
  header.exposure_count =
      to_number<std::uint64_t>(take_line(text, "element vertex ", file), "exposure count", file);
  if (text.substr(0, kExposureProperties.size()) != kExposureProperties)
    refuse(file, "its exposures have other properties than this version's");
  text.remove_prefix(kExposureProperties.size());
  header.via_count = to_number<std::uint64_t>(take_line(text, "element via ", file), "via count", file);
  return header;
}

/// Leaves `in` at the first exposure. The hash's value goes to `expected_hash`, what it covers of the header
/// to `hash`.
Header read_header(std::istream& in, const std::filesystem::path& file, Sha256& hash,
                   std::string& expected_hash) {
  std::string bytes(kHeaderBytesMax, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  in.clear();
  if (!std::string_view(bytes).starts_with(kMagic))
    refuse(file, "is not an exposure program of this version");

  std::string_view rest = std::string_view(bytes).substr(kMagic.size());
  expected_hash = take_line(rest, kHashKey, file);
  Header header = parse_header(rest, file);
  const std::string text = header_text(header);
  if (!rest.starts_with(text)) refuse(file, "its header is damaged");
  hash.update(text);
  in.seekg(static_cast<std::streamoff>(bytes.size() - rest.size() + text.size()));
  return header;
}

/// Before anything is allocated: the counts must account for every byte of the file.
void check_size(const Header& header, std::istream& in, const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) refuse(file, "cannot be read: " + error.message());
  const auto body = static_cast<std::uintmax_t>(size - static_cast<std::uintmax_t>(in.tellg()));
  constexpr std::uint64_t kCountMax = std::numeric_limits<std::uint32_t>::max();
  if (header.exposure_count > kCountMax || header.via_count > kCountMax ||
      body != header.exposure_count * kExposureBytes + header.via_count * kViaBytes)
    refuse(file, "is cut short or has bytes too many: its header announces " +
                     std::to_string(header.exposure_count) + " exposures and " +
                     std::to_string(header.via_count) + " way-points");
}

void check_vias(const ExposureProgram& program, const std::filesystem::path& file) {
  std::uint32_t previous = 0;
  for (const Via& via : program.vias) {
    if (via.before_exposure < previous || via.before_exposure > program.exposures.size())
      refuse(file, "its way-points are out of order");
    previous = via.before_exposure;
  }
}

}  // namespace

void write_program(const ExposureProgram& program, const std::filesystem::path& file) {
  for (const std::string* text : {&program.provenance.model_sha256, &program.provenance.settings_sha256,
                                  &program.provenance.cell_sha256, &program.provenance.version})
    if (!is_one_line(*text)) refuse(file, "is not written: its provenance is no short line of text");
  PartFile part(file);
  std::ofstream out(part.path(), std::ios::binary | std::ios::trunc);
  if (!out) refuse(file, "cannot be written");

  Sha256 hash;
  const std::string header =
      header_text({program.provenance, program.pitch_m, program.exposures.size(), program.vias.size()});
  hash.update(header);
  out << kMagic << kHashKey << std::string(kHashDigits, '0') << '\n' << header;
  write_records(out, hash, program.exposures, kExposureBytes);
  write_records(out, hash, program.vias, kViaBytes);
  out.seekp(static_cast<std::streamoff>(kMagic.size() + kHashKey.size()));
  out << hash.hex_digest();
  out.close();
  if (!out) refuse(file, "cannot be written completely: is the disk full?");
  part.rename_to(file);
}

ExposureProgram read_program(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) refuse(file, "is no file");
  std::ifstream in(file, std::ios::binary);
  if (!in) refuse(file, "cannot be read");
  Sha256 hash;
  std::string expected_hash;
  const Header header = read_header(in, file, hash, expected_hash);
  check_size(header, in, file);

  ExposureProgram program;
  program.provenance = header.provenance;
  program.pitch_m = header.pitch_m;
  program.exposures = read_records<Exposure>(in, hash, header.exposure_count, kExposureBytes);
  program.vias = read_records<Via>(in, hash, header.via_count, kViaBytes);
  if (!in) refuse(file, "cannot be read to its end");
  if (hash.hex_digest() != expected_hash)
    refuse(file, "is damaged: its SHA-256 is not the one in its header");
  check_vias(program, file);
  return program;
}

}  // namespace hilbrush
