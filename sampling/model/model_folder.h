#pragma once
#include <cstddef>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "sampling/base/result.h"

/// The one way by which a model's readers reach files: only below the folder of the model, whatever a file
/// names or a link points to.
namespace hilbrush {

class ModelFolder {
 public:
  /// The folder that `model_file` stands in. `file_bytes` limits each file, after gunzip.
  /// @throws InputError if there is no such folder.
  ModelFolder(const std::filesystem::path& model_file, std::size_t file_bytes);

  /// Finds the file that `url`, written in a file of folder `base`, means: as written, with \ for / and %20
  /// for a space, and (as exporters like to write paths of their own machine) by ever shorter ends of it. A
  /// failure if it is not there, not a regular file, or not below the model's folder.
  Result<std::filesystem::path> find(const std::filesystem::path& base, const std::string& url) const;

  /// The bytes of a file, gunzipped if they are gzip. @throws InputError naming the file if it cannot be
  /// read, is too large, or all files together are.
  std::string read(const std::filesystem::path& file);

  /// Notes that `file` was read otherwise than by read() (an image).
  void note(const std::filesystem::path& file);

  const std::filesystem::path& path() const { return folder_; }
  /// `file` relative to the folder, for messages.
  std::string name(const std::filesystem::path& file) const;
  /// Everything that was read, in order, each once.
  const std::vector<std::filesystem::path>& files() const { return files_; }

 private:
  bool contains(const std::filesystem::path& canonical) const;

  std::filesystem::path folder_;
  std::size_t file_bytes_;
  std::size_t read_bytes_ = 0;  ///< of all files, unpacked
  std::vector<std::filesystem::path> files_;
  std::set<std::string> noted_;
};

/// Gunzips `bytes`, all members of them. @throws InputError at `file` if they are corrupt or grow beyond
/// `limit`.
std::string gunzip(const std::string& bytes, std::size_t limit, const std::string& file);

}  // namespace hilbrush
