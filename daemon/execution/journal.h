#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "daemon/execution/journal_storage.h"

/// Which exposures are done: the record of a painting job that must survive everything (no dot is exposed
/// twice).
///
/// Storage: a header page (magic, version, count, program), a page with the machine's boot id, one 8-byte
/// record a window, one 8-byte record an exposure; every record carries a checksum over its state and index.
/// Written in full before the job starts, so that a full disk is found before the first dot. Afterwards each
/// change is one write to the system before what it announces happens: a killed process leaves every record
/// whole, and at most one exposure armed. Before the first exposure of a window of kWindow is armed, the
/// window's opening is synced to disk; a window is closed only after its records are. So after a power cut
/// (the boot id has changed), whichever of the writes since the last sync were lost or torn, one window is
/// open whose exposures without a durable *done* are in doubt: at most kWindow. A record whose checksum is
/// wrong is in doubt, too. One thread at a time; one process at a time (the file is locked).
namespace hilbrush {

enum class ExposureState : std::uint8_t { kRemaining = 0, kArmed = 1, kDone = 2, kInDoubt = 3 };

class Journal {
 public:
  /// Exposures, about 8 s of painting: two syncs in that time cost nothing.
  static constexpr std::size_t kWindow = 256;

  /// For dry runs: nothing is kept.
  static Journal in_memory(std::size_t exposure_count);
  /// The file appears under its name only when it is whole. @throws std::runtime_error naming the file
  /// (exists already, disk full, ...).
  static Journal create(const std::filesystem::path& file, std::size_t exposure_count,
                        const std::string& program_sha256);
  /// Reopens after a stop, kill or power cut: armed exposures become in doubt. `boot_id` identifies this run
  /// of the machine; tests pass another one to simulate a power cut. @throws std::runtime_error if it cannot
  /// be read, is in use, is damaged in its header, or is of another program.
  static Journal open(const std::filesystem::path& file, const std::string& program_sha256,
                      const std::string& boot_id = current_boot_id());
  /// The same on any storage: of bytes_for() bytes, or what create() has written before.
  static Journal create(std::unique_ptr<JournalStorage> storage, std::size_t exposure_count,
                        const std::string& program_sha256, const std::string& boot_id);
  static Journal open(std::unique_ptr<JournalStorage> storage, const std::string& program_sha256,
                      const std::string& boot_id);
  static std::size_t bytes_for(std::size_t exposure_count);
  /// Of the running kernel; empty if it is unknown, which open() takes for a power cut.
  static std::string current_boot_id();
  /// Syncs and closes the open window.
  ~Journal();
  Journal(Journal&&) noexcept;

  /// Opens the exposure's window on disk if it is not open yet, so that arm() need not wait for the disk:
  /// called while the axes move. @throws std::runtime_error
  void open_window_for(std::size_t i);
  /// The exposure must be kRemaining: no dot is ever exposed twice. @throws
  /// std::runtime_error if it cannot be written or synced; then nothing may be exposed.
  void arm(std::size_t i);
  void done(std::size_t i);
  /// An exposure whose pulse may have happened, wholly or in part.
  void mark_in_doubt(std::size_t i);
  /// The operator orders an in-doubt exposure again.
  void expose_again(std::size_t i);

  /// Makes everything so far survive a power cut, and closes the open window: at every end of a run. @throws
  /// std::runtime_error
  void close_window();

  ExposureState state(std::size_t i) const;
  std::size_t exposure_count() const;
  std::size_t done_count() const;  ///< O(1)
  /// Exposures that may have happened, including one that is armed. Ascending. Cost: O(exposures).
  std::vector<std::size_t> in_doubt() const;

 private:
  struct Implementation;
  explicit Journal(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
