#pragma once
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

/// Copies a model and everything it refers to into its job's folder, with the rights of the peer who
/// submitted it.
namespace hilbrush {

struct ModelCopy {
  std::filesystem::path model;
  std::string sha256;  ///< over all files' bytes in the order of the list, as programs name their model
};

inline constexpr std::size_t kModelFilesMax = 1000;
inline constexpr std::uintmax_t kModelBytesMax = std::uintmax_t{2} << 30;

/// While it lives, this thread opens files with the rights of `uid` and `gid` (their own groups included);
/// without root's rights it changes nothing, and the daemon's own rights count.
class AsPeer {
 public:
  AsPeer(uid_t uid, gid_t gid);
  ~AsPeer();
  AsPeer(const AsPeer&) = delete;
  AsPeer& operator=(const AsPeer&) = delete;

 private:
  bool is_changed_ = false;
  std::vector<gid_t> own_groups_;
};

/// @throws InputError if that peer cannot read it or it is not a regular file; the sentence says which.
void check_readable(const std::filesystem::path& file, uid_t uid, gid_t gid);

/// `files` as `hilbrush-pipeline files` listed them, the model among them. Each keeps its place relative to
/// the model's folder; one outside that folder is refused. @throws InputError, also when asked to stop; then
/// `target` holds nothing.
ModelCopy copy_model(const std::filesystem::path& model, const std::vector<std::filesystem::path>& files,
                     const std::filesystem::path& target, uid_t uid, gid_t gid,
                     const std::stop_token& stop = {});

}  // namespace hilbrush
