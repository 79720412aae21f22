#include "config/config_folders.h"

#include <system_error>

namespace hilbrush {

namespace fs = std::filesystem;

fs::path shipped_folder(const std::string& name) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  fs::path installed = program.parent_path().parent_path() / "share" / "hilbrush" / name;
  if (!error && fs::is_directory(installed, error)) return installed;
  return fs::path(HILBRUSH_SOURCE_CONFIG) / name;
}

}  // namespace hilbrush
