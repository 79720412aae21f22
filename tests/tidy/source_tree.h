#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// The project's own files, as the tidy tests read them.
namespace hilbrush::tidy {

struct SourceFile {
  std::string path;  ///< relative to the top, with '/'
  std::string text;

  bool has_ending(std::string_view ending) const { return path.ends_with(ending); }
  bool is_below(std::string_view folder) const { return path.starts_with(std::string(folder) + "/"); }
  bool is_cpp() const { return has_ending(".h") || has_ending(".cpp"); }
  std::vector<std::string> lines() const;
};

/// The whole of a file; empty if it cannot be read.
std::string read_text(const std::filesystem::path& file);
/// Where the project is.
std::filesystem::path top_folder();
/// Whether .gitignore leaves this name at the top out: build folders and what editors drop.
bool is_ignored_name(const std::string& name);
/// Every file of the project but the models, images and corpora that tests read: text that people wrote,
/// sorted by path.
const std::vector<SourceFile>& source_files();
/// Every file of the project, relative to the top, sorted.
std::vector<std::string> all_files();

}  // namespace hilbrush::tidy
