#include "tests/tidy/source_tree.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>

namespace hilbrush::tidy {
namespace fs = std::filesystem;

std::vector<std::string> SourceFile::lines() const {
  std::vector<std::string> result;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) result.push_back(line);
  return result;
}

fs::path top_folder() {
  return HILBRUSH_SOURCE_DIR;
}

bool is_ignored_name(const std::string& name) {
  return name == ".git" || name.starts_with("build") || name == "compile_commands.json" ||
         name.ends_with(".swp");
}

std::vector<std::string> all_files() {
  std::vector<std::string> paths;
  for (const fs::directory_entry& entry : fs::directory_iterator(top_folder())) {
    if (is_ignored_name(entry.path().filename())) continue;
    if (entry.is_regular_file()) paths.push_back(entry.path().filename());
    if (!entry.is_directory()) continue;
    for (const fs::directory_entry& below : fs::recursive_directory_iterator(entry)) {
      const bool is_leftover = below.path().extension() == ".swp" ||
                               below.path().string().find("/__pycache__/") != std::string::npos;
      if (below.is_regular_file() && !is_leftover)
        paths.push_back(fs::relative(below, top_folder()).generic_string());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

namespace {

bool is_text_of_people(const std::string& path) {
  if (path.find("/corpus") != std::string::npos || path.find("/golden/") != std::string::npos) return false;
  if (path.starts_with("tests/data/")) return path.ends_with(".py");
  static constexpr std::array kBinary{".png", ".jpg", ".gif", ".tga", ".bmp", ".tif", ".gz"};
  return std::none_of(kBinary.begin(), kBinary.end(),
                      [&](const char* ending) { return path.ends_with(ending); });
}

std::vector<SourceFile> read_source_files() {
  std::vector<SourceFile> files;
  for (const std::string& path : all_files()) {
    if (!is_text_of_people(path)) continue;
    files.push_back({path, read_text(top_folder() / path)});
  }
  return files;
}

}  // namespace

const std::vector<SourceFile>& source_files() {
  static const std::vector<SourceFile> files = read_source_files();
  return files;
}

}  // namespace hilbrush::tidy
