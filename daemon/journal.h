#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

/// Which exposures are done: the memory of a painting job that must survive everything (DESIGN invariant 3: no dot is exposed twice).
/// Allocated in full before the job starts; arm(i) and done(i) go to memory-mapped storage, so a killed process leaves at most one exposure in
/// doubt; before the first exposure of a window the opening of the window is synced to disk, so a power cut leaves at most one window in doubt.
namespace hilbrush {

enum class ExposureState : std::uint8_t { kRemaining = 0, kArmed = 1, kDone = 2, kInDoubt = 3 };

class Journal {
 public:
  /// For dry runs: nothing is kept.
  static Journal in_memory(std::size_t exposure_count);
  /// @throws std::runtime_error naming the file (exists already, disk full, ...).
  static Journal create(const std::filesystem::path& file, std::size_t exposure_count, const std::string& program_sha256);
  /// Reopens after a stop, kill or power cut: armed exposures become in doubt. @throws std::runtime_error if damaged or of another program.
  static Journal open(const std::filesystem::path& file, const std::string& program_sha256);
  ~Journal();
  Journal(Journal&&) noexcept;

  void arm(std::size_t i);
  void done(std::size_t i);
  /// An exposure whose pulse may have happened, wholly or in part.
  void doubt(std::size_t i);
  /// The operator orders an in-doubt exposure again.
  void expose_again(std::size_t i);

  ExposureState state(std::size_t i) const;
  std::size_t exposure_count() const;
  std::size_t done_count() const;
  std::vector<std::size_t> in_doubt() const;

 private:
  struct Implementation;
  explicit Journal(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
