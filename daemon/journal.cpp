#include "daemon/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>

#include "sampling/check.h"

namespace hilbrush {
namespace {

constexpr std::size_t kPage = 4096;
constexpr char kMagic[8] = {'H', 'B', 'J', 'O', 'U', 'R', 'N', '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kCountMax = std::size_t{1} << 32;  ///< dot indices are 32 bits wide
constexpr std::size_t kNoWindow = std::numeric_limits<std::size_t>::max();

/// Native byte order: a journal never leaves its machine, and a foreign one fails its checksum.
struct Header {
  char magic[8];
  std::uint32_t version;
  std::uint32_t window;
  std::uint64_t count;
  char program_sha256[64];
  char boot_id[64];
  std::uint64_t checksum;
};
static_assert(sizeof(Header) <= kPage);
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

/// splitmix64's finaliser: every input bit reaches every output bit.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// A record: the state in the low byte, 56 bits of checksum over state, place and table above it. All-zero storage is
/// no valid record.
std::uint64_t make_record(std::uint64_t table_seed, std::size_t place, std::uint8_t state) {
  return (mix(mix(table_seed ^ place) + state) << 8 | state);
}

std::optional<std::uint8_t> record_state(std::uint64_t table_seed, std::size_t place, std::uint64_t record) {
  const auto state = static_cast<std::uint8_t>(record & 0xff);
  if (record != make_record(table_seed, place, state)) return std::nullopt;
  return state;
}

constexpr std::uint64_t kExposureSeed = 0x65787073ull << 32;
constexpr std::uint64_t kWindowSeed = 0x77696e64ull << 32;
constexpr std::uint8_t kClosed = 0, kOpen = 1;

std::uint64_t header_checksum(const Header& header) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(&header);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < offsetof(Header, checksum); ++i) sum = mix(sum ^ bytes[i]);
  return sum;
}

void copy_text(std::span<char> field, const std::string& text) {
  std::fill(field.begin(), field.end(), '\0');
  std::copy_n(text.begin(), std::min(text.size(), field.size()), field.begin());
}

std::string field_text(std::span<const char> field) {
  return {field.data(), strnlen(field.data(), field.size())};
}

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& sentence) {
  throw std::runtime_error(file.string() + ": " + sentence);
}
[[noreturn]] void fail_errno(const std::filesystem::path& file, const std::string& what) {
  fail(file, what + ": " + std::strerror(errno));
}

std::size_t window_count(std::size_t count) {
  return (count + Journal::kWindow - 1) / Journal::kWindow;
}
std::size_t round_up(std::size_t bytes) {
  return (bytes + kPage - 1) / kPage * kPage;
}
std::size_t window_table_bytes(std::size_t count) {
  return round_up(window_count(count) * sizeof(std::uint64_t));
}
std::size_t file_bytes(std::size_t count) {
  return kPage + window_table_bytes(count) + round_up(count * sizeof(std::uint64_t));
}

/// A process that was forked a moment ago shares our locks until it executes its program or dies: a lock is given a
/// second to become free.
bool lock_exclusively(int fd) {
  for (int attempt = 0; attempt < 100; ++attempt) {
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) return true;
    if (errno != EWOULDBLOCK && errno != EINTR) return false;
    ::usleep(10000);
  }
  return false;
}

void sync_folder(const std::filesystem::path& file) {
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) fail_errno(folder, "can't be opened");
  const int result = ::fsync(fd);
  ::close(fd);
  if (result != 0) fail_errno(folder, "can't be synced");
}

}  // namespace

struct Journal::Implementation {
  std::filesystem::path file;  ///< empty: in memory
  int fd = -1;
  std::uint8_t* bytes = nullptr;  ///< the mapped file
  std::size_t byte_count = 0;
  std::vector<std::uint64_t> kept;  ///< in memory: the records
  std::uint64_t* records = nullptr;
  std::uint64_t* windows = nullptr;  ///< null in memory
  std::size_t count = 0;
  std::size_t done_count = 0;
  std::size_t open_window = kNoWindow;

  Implementation() = default;
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  ~Implementation() {
    if (bytes != nullptr) ::munmap(bytes, byte_count);
    if (fd >= 0) ::close(fd);
  }

  Header& header() { return *reinterpret_cast<Header*>(bytes); }

  void map() {
    void* address = ::mmap(nullptr, byte_count, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (address == MAP_FAILED) fail_errno(file, "can't be mapped");
    bytes = static_cast<std::uint8_t*>(address);
  }
  void find_tables() {
    windows = reinterpret_cast<std::uint64_t*>(bytes + kPage);
    records = reinterpret_cast<std::uint64_t*>(bytes + kPage + window_table_bytes(count));
  }

  /// One aligned store: whole or not at all, and not before what was stored earlier.
  static void store(std::uint64_t& place, std::uint64_t record) {
    std::atomic_ref(place).store(record, std::memory_order_release);
  }
  void set(std::size_t i, ExposureState state) {
    store(records[i], make_record(kExposureSeed, i, static_cast<std::uint8_t>(state)));
  }
  void set_window(std::size_t w, std::uint8_t state) { store(windows[w], make_record(kWindowSeed, w, state)); }

  ExposureState get(std::size_t i) const {
    const auto state = record_state(kExposureSeed, i, records[i]);
    return state && *state <= static_cast<std::uint8_t>(ExposureState::kInDoubt) ? static_cast<ExposureState>(*state)
                                                                                 : ExposureState::kInDoubt;
  }

  void sync(const void* first, std::size_t length) {
    const auto begin = static_cast<std::size_t>(static_cast<const std::uint8_t*>(first) - bytes);
    const std::size_t page = begin / kPage * kPage;
    if (::msync(bytes + page, begin + length - page, MS_SYNC) != 0) fail_errno(file, "can't be synced to disk");
  }

  std::size_t window_end(std::size_t w) const { return std::min(count, (w + 1) * kWindow); }

  void close_window() {
    if (windows == nullptr || open_window == kNoWindow) return;
    const std::size_t first = open_window * kWindow;
    sync(records + first, (window_end(open_window) - first) * sizeof(std::uint64_t));
    set_window(open_window, kClosed);
    sync(windows + open_window, sizeof(std::uint64_t));
    open_window = kNoWindow;
  }

  void enter_window(std::size_t w) {
    if (windows == nullptr || w == open_window) return;
    close_window();
    set_window(w, kOpen);
    sync(windows + w, sizeof(std::uint64_t));
    open_window = w;
  }

  void recover(const std::string& boot_id);
};

/// After a kill the mapped storage is as it was: only what was armed is in doubt. After a power cut an open window's
/// dots may have been exposed without a trace.
void Journal::Implementation::recover(const std::string& boot_id) {
  const bool is_same_boot = !boot_id.empty() && field_text(header().boot_id) == boot_id;
  for (std::size_t w = 0; w < window_count(count); ++w) {
    const bool is_closed = record_state(kWindowSeed, w, windows[w]) == kClosed;
    for (std::size_t i = w * kWindow; i < window_end(w); ++i) {
      const auto state = get(i);
      const bool is_lost = !is_closed && !is_same_boot && state == ExposureState::kRemaining;
      if (state == ExposureState::kArmed || state == ExposureState::kInDoubt || is_lost)
        set(i, ExposureState::kInDoubt);
      if (state == ExposureState::kDone) ++done_count;
    }
  }
  // The records first: a closed window must never stand before what it says is durable.
  sync(bytes, byte_count);
  for (std::size_t w = 0; w < window_count(count); ++w) set_window(w, kClosed);
  copy_text(header().boot_id, boot_id);
  header().checksum = header_checksum(header());
  sync(bytes, byte_count);
}

Journal::Journal(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
Journal::Journal(Journal&&) noexcept = default;
Journal::~Journal() {
  if (!implementation_) return;
  try {
    implementation_->close_window();
  } catch (
      const std::exception&) {  // the window stays open: after a power cut its dots will be in doubt, which is true
  }
}

Journal Journal::in_memory(std::size_t exposure_count) {
  auto journal = std::make_unique<Implementation>();
  journal->count = exposure_count;
  journal->kept.resize(exposure_count);
  journal->records = journal->kept.data();
  for (std::size_t i = 0; i < exposure_count; ++i) journal->set(i, ExposureState::kRemaining);
  return Journal(std::move(journal));
}

Journal Journal::create(const std::filesystem::path& file, std::size_t exposure_count,
                        const std::string& program_sha256) {
  CHECK_LT(exposure_count, kCountMax);
  const std::filesystem::path temporary = file.string() + ".part";
  std::error_code ignored;
  std::filesystem::remove(temporary, ignored);
  auto journal = std::make_unique<Implementation>();
  journal->file = file;
  journal->count = exposure_count;
  journal->byte_count = file_bytes(exposure_count);
  journal->fd = ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (journal->fd < 0) fail_errno(file, "can't be created");
  try {
    if (const int error = ::posix_fallocate(journal->fd, 0, static_cast<off_t>(journal->byte_count)); error != 0)
      fail(file, std::string("no room for the journal: ") + std::strerror(error));
    if (!lock_exclusively(journal->fd)) fail_errno(file, "is in use");
    journal->map();
    journal->find_tables();
    Header header{};
    std::memcpy(header.magic, kMagic, sizeof kMagic);
    header.version = kVersion;
    header.window = kWindow;
    header.count = exposure_count;
    copy_text(header.program_sha256, program_sha256);
    copy_text(header.boot_id, current_boot_id());
    header.checksum = header_checksum(header);
    std::memcpy(journal->bytes, &header, sizeof header);
    for (std::size_t w = 0; w < window_count(exposure_count); ++w) journal->set_window(w, kClosed);
    for (std::size_t i = 0; i < exposure_count; ++i) journal->set(i, ExposureState::kRemaining);
    journal->sync(journal->bytes, journal->byte_count);
    if (::fsync(journal->fd) != 0) fail_errno(file, "can't be synced to disk");
    // link, unlike rename, refuses to replace a journal that is already there.
    if (::link(temporary.c_str(), file.c_str()) != 0) fail_errno(file, "can't be created");
    ::unlink(temporary.c_str());
    sync_folder(file);
  } catch (...) {
    std::filesystem::remove(temporary, ignored);
    throw;
  }
  return Journal(std::move(journal));
}

Journal Journal::open(const std::filesystem::path& file, const std::string& program_sha256,
                      const std::string& boot_id) {
  auto journal = std::make_unique<Implementation>();
  journal->file = file;
  journal->fd = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (journal->fd < 0) fail_errno(file, "can't be opened");
  if (!lock_exclusively(journal->fd)) fail(file, "is in use by another program");
  struct stat status {};
  if (::fstat(journal->fd, &status) != 0) fail_errno(file, "can't be read");
  if (status.st_size < static_cast<off_t>(kPage)) fail(file, "is no journal: it is too short");
  journal->byte_count = static_cast<std::size_t>(status.st_size);
  journal->map();
  const Header& header = journal->header();
  if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0) fail(file, "is no journal");
  if (header.checksum != header_checksum(header)) fail(file, "is damaged: its header fails its checksum");
  if (header.version != kVersion || header.window != kWindow) fail(file, "was written by another version");
  if (header.count >= kCountMax || file_bytes(header.count) != journal->byte_count)
    fail(file, "is damaged: its length does not fit its header");
  if (field_text(header.program_sha256) != program_sha256) fail(file, "belongs to another program");
  journal->count = header.count;
  journal->find_tables();
  journal->recover(boot_id);
  return Journal(std::move(journal));
}

std::string Journal::current_boot_id() {
  std::ifstream in("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(in, id);
  return id.substr(0, sizeof(Header::boot_id));
}

void Journal::arm(std::size_t i) {
  CHECK_LT(i, implementation_->count);
  CHECK(implementation_->get(i) == ExposureState::kRemaining);
  implementation_->enter_window(i / kWindow);
  implementation_->set(i, ExposureState::kArmed);
}

void Journal::done(std::size_t i) {
  CHECK_LT(i, implementation_->count);
  CHECK(implementation_->get(i) == ExposureState::kArmed);
  implementation_->set(i, ExposureState::kDone);
  ++implementation_->done_count;
}

void Journal::doubt(std::size_t i) {
  CHECK_LT(i, implementation_->count);
  CHECK(implementation_->get(i) == ExposureState::kArmed);
  implementation_->set(i, ExposureState::kInDoubt);
}

void Journal::expose_again(std::size_t i) {
  CHECK_LT(i, implementation_->count);
  CHECK(implementation_->get(i) == ExposureState::kInDoubt);
  implementation_->set(i, ExposureState::kRemaining);
}

void Journal::close_window() {
  implementation_->close_window();
}

ExposureState Journal::state(std::size_t i) const {
  CHECK_LT(i, implementation_->count);
  return implementation_->get(i);
}

std::size_t Journal::exposure_count() const {
  return implementation_->count;
}
std::size_t Journal::done_count() const {
  return implementation_->done_count;
}

std::vector<std::size_t> Journal::in_doubt() const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < implementation_->count; ++i)
    if (implementation_->get(i) == ExposureState::kInDoubt) found.push_back(i);
  return found;
}

}  // namespace hilbrush
