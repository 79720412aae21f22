#include "daemon/execution/journal.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>

#include "sampling/base/check.h"
#include "sampling/base/random.h"

namespace hilbrush {
namespace {

constexpr std::size_t kPage = 4096;
constexpr char kMagic[8] = {'H', 'B', 'J', 'O', 'U', 'R', 'N', '\n'};
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kCountMax = std::size_t{1} << 32;  ///< dot indices are 32 bits wide
constexpr std::size_t kNoWindow = std::numeric_limits<std::size_t>::max();

/// Written once, when the journal is made. Native byte order: a journal never leaves its machine, and a
/// foreign one fails its checksum.
struct Header {
  char magic[8];
  std::uint32_t version;
  std::uint32_t window;
  std::uint64_t count;
  char program_sha256[64];
  std::uint64_t checksum;
};
/// In a page of its own, written at each opening: torn, it counts as another boot's.
struct Boot {
  char id[64];
  std::uint64_t checksum;
};
constexpr std::size_t kBootOffset = kPage;
constexpr std::size_t kTables = 2 * kPage;
static_assert(sizeof(Header) <= kPage && sizeof(Boot) <= kPage);

/// A record: the state in the low byte, 56 bits of checksum over state, index and table above it. All-zero
/// storage is not a valid record.
std::uint64_t make_record(std::uint64_t table_seed, std::size_t index, std::uint8_t state) {
  return (splitmix64(splitmix64(table_seed ^ index) + state) << 8 | state);
}

std::optional<std::uint8_t> record_state(std::uint64_t table_seed, std::size_t index, std::uint64_t record) {
  const auto state = static_cast<std::uint8_t>(record & 0xff);
  if (record != make_record(table_seed, index, state)) return std::nullopt;
  return state;
}

constexpr std::uint64_t kExposureSeed = 0x65787073ull << 32;
constexpr std::uint64_t kWindowSeed = 0x77696e64ull << 32;
constexpr std::uint8_t kClosed = 0;
constexpr std::uint8_t kOpen = 1;

/// Over everything before the checksum at its end.
template <class Block>
std::uint64_t block_checksum(const Block& block) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(&block);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < offsetof(Block, checksum); ++i) sum = splitmix64(sum ^ bytes[i]);
  return sum;
}

void copy_text(std::span<char> field, const std::string& text) {
  std::fill(field.begin(), field.end(), '\0');
  std::copy_n(text.begin(), std::min(text.size(), field.size()), field.begin());
}

std::string field_text(std::span<const char> field) {
  return {field.data(), strnlen(field.data(), field.size())};
}

std::size_t window_count(std::size_t count) {
  return (count + Journal::kWindow - 1) / Journal::kWindow;
}
std::size_t round_up(std::size_t bytes) {
  return (bytes + kPage - 1) / kPage * kPage;
}
std::size_t records_offset(std::size_t count) {
  return kTables + round_up(window_count(count) * sizeof(std::uint64_t));
}
std::size_t storage_bytes(std::size_t count) {
  return records_offset(count) + round_up(count * sizeof(std::uint64_t));
}

template <class Block>
std::span<std::uint8_t> bytes_of(Block& block) {
  return {reinterpret_cast<std::uint8_t*>(&block), sizeof block};
}
std::span<std::uint8_t> bytes_of(std::vector<std::uint64_t>& table) {
  return {reinterpret_cast<std::uint8_t*>(table.data()), table.size() * sizeof(std::uint64_t)};
}

}  // namespace

struct Journal::Implementation {
  std::unique_ptr<JournalStorage> storage;  ///< none: in memory
  std::size_t count = 0;
  std::size_t done_count = 0;
  std::size_t open_window = kNoWindow;
  std::vector<std::uint64_t> windows, records;  ///< as they stand in the storage
  bool is_broken = false;  ///< a sync failed: what is durable is no longer known, so nothing more is armed

  void put(std::size_t offset, std::uint64_t& kept, std::uint64_t record) {
    if (storage) {
      std::uint64_t copy = record;
      storage->write(offset, bytes_of(copy));
    }
    kept = record;
  }
  void set(std::size_t i, ExposureState state) {
    put(records_offset(count) + i * sizeof(std::uint64_t), records[i],
        make_record(kExposureSeed, i, static_cast<std::uint8_t>(state)));
  }
  void set_window(std::size_t w, std::uint8_t state) {
    put(kTables + w * sizeof(std::uint64_t), windows[w], make_record(kWindowSeed, w, state));
  }

  ExposureState get(std::size_t i) const {
    const auto state = record_state(kExposureSeed, i, records[i]);
    return state && *state <= static_cast<std::uint8_t>(ExposureState::kInDoubt)
               ? static_cast<ExposureState>(*state)
               : ExposureState::kInDoubt;
  }

  void refuse_if_broken() const {
    if (is_broken)
      throw std::runtime_error("the journal could not be synced to disk before: the job must be resumed");
  }
  void sync() {
    if (!storage) return;
    refuse_if_broken();
    is_broken = true;  // unless it succeeds
    storage->sync();
    is_broken = false;
  }

  /// The records first: a closed window must never stand before what it says is durable.
  void close_window() {
    if (!storage || open_window == kNoWindow) return;
    sync();
    set_window(open_window, kClosed);
    sync();
    open_window = kNoWindow;
  }

  /// One sync for the records of the window before, one for both windows' states.
  void enter_window(std::size_t w) {
    refuse_if_broken();
    if (!storage || w == open_window) return;
    if (open_window != kNoWindow) {
      sync();
      set_window(open_window, kClosed);
    }
    set_window(w, kOpen);
    open_window = w;
    sync();
  }

  void write_boot(const std::string& boot_id) {
    Boot boot{};
    copy_text(boot.id, boot_id);
    boot.checksum = block_checksum(boot);
    storage->write(kBootOffset, bytes_of(boot));
  }

  void fill();
  void load(const std::string& program_sha256);
  void recover(const std::string& boot_id);
};

/// Every exposure remaining, every window closed.
void Journal::Implementation::fill() {
  windows.resize(storage ? window_count(count) : 0);
  records.resize(count);
  for (std::size_t w = 0; w < windows.size(); ++w) windows[w] = make_record(kWindowSeed, w, kClosed);
  for (std::size_t i = 0; i < count; ++i)
    records[i] = make_record(kExposureSeed, i, static_cast<std::uint8_t>(ExposureState::kRemaining));
}

void Journal::Implementation::load(const std::string& program_sha256) {
  const auto refuse = [](const char* sentence) {
    throw std::runtime_error(std::string("the journal ") + sentence);
  };
  Header header{};
  if (storage->size() < kTables) refuse("is not a journal: it is too short");
  storage->read(0, bytes_of(header));
  if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0) refuse("is not a journal");
  if (header.version != kVersion || header.window != kWindow) refuse("was written by another version");
  if (header.checksum != block_checksum(header)) refuse("is damaged: its header fails its checksum");
  if (header.count >= kCountMax || storage_bytes(header.count) != storage->size())
    refuse("is damaged: its length does not fit its header");
  if (field_text(header.program_sha256) != program_sha256) refuse("belongs to another program");
  count = header.count;
  windows.resize(window_count(count));
  records.resize(count);
  storage->read(kTables, bytes_of(windows));
  storage->read(records_offset(count), bytes_of(records));
}

/// After a kill the storage is as it was: only what was armed is in doubt. After a power cut an open window's
/// dots may have been exposed without a trace. Everything is written again, because pages that an earlier
/// sync failed to write count as clean in the system's cache.
void Journal::Implementation::recover(const std::string& boot_id) {
  Boot boot{};
  storage->read(kBootOffset, bytes_of(boot));
  const bool is_same_boot =
      !boot_id.empty() && boot.checksum == block_checksum(boot) && field_text(boot.id) == boot_id;
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_closed = record_state(kWindowSeed, i / kWindow, windows[i / kWindow]) == kClosed;
    auto state = get(i);
    const bool is_lost = !is_closed && !is_same_boot && state == ExposureState::kRemaining;
    if (state == ExposureState::kArmed || is_lost) state = ExposureState::kInDoubt;
    if (state == ExposureState::kDone) ++done_count;
    records[i] = make_record(kExposureSeed, i, static_cast<std::uint8_t>(state));
  }
  storage->write(records_offset(count), bytes_of(records));
  sync();
  for (std::size_t w = 0; w < windows.size(); ++w) windows[w] = make_record(kWindowSeed, w, kClosed);
  storage->write(kTables, bytes_of(windows));
  write_boot(boot_id);
  sync();
}

Journal::Journal(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
Journal::Journal(Journal&&) noexcept = default;
Journal::~Journal() {
  if (!implementation_) return;
  try {
    implementation_->close_window();
  } catch (...) {  // the window stays open: after a power cut its dots will be in doubt, which is true
  }
}

Journal Journal::in_memory(std::size_t exposure_count) {
  auto journal = std::make_unique<Implementation>();
  journal->count = exposure_count;
  journal->fill();
  return Journal(std::move(journal));
}

std::size_t Journal::bytes_for(std::size_t exposure_count) {
  return storage_bytes(exposure_count);
}

Journal Journal::create(std::unique_ptr<JournalStorage> storage, std::size_t exposure_count,
                        const std::string& program_sha256, const std::string& boot_id) {
  CHECK_LT(exposure_count, kCountMax);
  CHECK_EQ(storage->size(), storage_bytes(exposure_count));
  auto journal = std::make_unique<Implementation>();
  journal->storage = std::move(storage);
  journal->count = exposure_count;
  journal->fill();
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.version = kVersion;
  header.window = kWindow;
  header.count = exposure_count;
  copy_text(header.program_sha256, program_sha256);
  header.checksum = block_checksum(header);
  journal->storage->write(0, bytes_of(header));
  journal->write_boot(boot_id);
  journal->storage->write(kTables, bytes_of(journal->windows));
  journal->storage->write(records_offset(exposure_count), bytes_of(journal->records));
  journal->sync();
  return Journal(std::move(journal));
}

Journal Journal::open(std::unique_ptr<JournalStorage> storage, const std::string& program_sha256,
                      const std::string& boot_id) {
  auto journal = std::make_unique<Implementation>();
  journal->storage = std::move(storage);
  journal->load(program_sha256);
  journal->recover(boot_id);
  return Journal(std::move(journal));
}

Journal Journal::create(const std::filesystem::path& file, std::size_t exposure_count,
                        const std::string& program_sha256) {
  CHECK_LT(exposure_count, kCountMax);
  auto storage = JournalFile::create(file, storage_bytes(exposure_count));
  JournalFile& made = *storage;
  Journal journal = create(std::move(storage), exposure_count, program_sha256, current_boot_id());
  made.publish();
  return journal;
}

Journal Journal::open(const std::filesystem::path& file, const std::string& program_sha256,
                      const std::string& boot_id) {
  auto storage = JournalFile::open(file);
  try {
    return open(std::move(storage), program_sha256, boot_id);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

std::string Journal::current_boot_id() {
  std::ifstream in("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(in, id);
  return id.substr(0, sizeof(Boot::id));
}

void Journal::open_window_for(std::size_t i) {
  CHECK_LT(i, implementation_->count);
  implementation_->enter_window(i / kWindow);
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

void Journal::mark_in_doubt(std::size_t i) {
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
    if (const auto state = implementation_->get(i);
        state == ExposureState::kInDoubt || state == ExposureState::kArmed)
      found.push_back(i);
  return found;
}

}  // namespace hilbrush
