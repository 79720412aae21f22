#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

/// The bytes that a journal is kept in. The journal's promises rest on two of this interface: what write()
/// has taken survives the death of the process, and what sync() has taken survives a power cut; of what was
/// written since, any part may be lost or torn. Tests use storages that lose as much as is allowed. One
/// thread.
namespace hilbrush {

class JournalStorage {
 public:
  virtual ~JournalStorage() = default;
  virtual std::size_t size() const = 0;
  /// @throws std::runtime_error naming the file.
  virtual void read(std::size_t offset, std::span<std::uint8_t> bytes) const = 0;
  /// Within size(). @throws std::runtime_error naming the file; then nothing may be taken as written.
  virtual void write(std::size_t offset, std::span<const std::uint8_t> bytes) = 0;
  /// All that was written becomes durable. @throws std::runtime_error naming the file.
  virtual void sync() = 0;
};

/// A file, held by one process at a time. It is written by system calls, not through a mapping: a full disk
/// is then an error before the dot instead of a signal in it, on file systems that copy on write, too.
class JournalFile final : public JournalStorage {
 public:
  /// A file of `bytes` zeroes for which the disk has room. It appears under its name, which must be free, by
  /// publish() only. @throws std::runtime_error naming the file.
  static std::unique_ptr<JournalFile> create(const std::filesystem::path& file, std::size_t bytes);
  /// @throws std::runtime_error naming the file, also if another process holds it.
  static std::unique_ptr<JournalFile> open(const std::filesystem::path& file);
  ~JournalFile() override;
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  /// Syncs the file and its name. @throws std::runtime_error, also if the name is taken.
  void publish();

  std::size_t size() const override { return size_; }
  void read(std::size_t offset, std::span<std::uint8_t> bytes) const override;
  void write(std::size_t offset, std::span<const std::uint8_t> bytes) override;
  void sync() override;

 private:
  explicit JournalFile(std::filesystem::path file) : file_(std::move(file)) {}
  std::filesystem::path file_, temporary_;  ///< temporary_: until it is published
  int fd_ = -1;
  std::size_t size_ = 0;
};

}  // namespace hilbrush
