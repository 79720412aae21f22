#include "daemon/commands/given_files.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "config/json_reader.h"
#include "daemon/commands/text_output.h"
#include "sampling/base/input_error.h"

namespace hilbrush {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string existing_file(const std::string& file, const char* what) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) throw InputError(file, std::string("no such ") + what);
  if (fs::is_directory(status)) throw InputError(file, std::string("is a folder, not a ") + what);
  return fs::absolute(file).lexically_normal().string();
}

std::string settings_beside(const std::string& file) {
  const fs::path report = fs::path(file).parent_path() / "report.json";
  std::error_code error;
  if (!fs::exists(report, error)) return {};
  const Json json = Json::parse(read_text_file(report.string(), kReportBytesMax), nullptr, false);
  const Json& settings = member(json, "settings");
  return settings.is_object() ? settings.dump() : std::string();
}

}  // namespace hilbrush
