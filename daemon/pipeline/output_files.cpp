#include "daemon/pipeline/output_files.h"

#include <fstream>

#include "sampling/base/input_error.h"

namespace hilbrush {

void make_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder))
    throw InputError(folder.string(),
                     "cannot be made or is not a folder" + (error ? ": " + error.message() : std::string()));
}

void write_text_file(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path temporary = file.string() + ".part";
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out << text;
    out.flush();
    if (!out)
      throw InputError(file.string(),
                       "cannot be written (no such folder, no permission, or the disk is full)");
  }
  std::error_code error;
  std::filesystem::rename(temporary, file, error);
  if (error) throw InputError(file.string(), "cannot be written: " + error.message());
}

}  // namespace hilbrush
