#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "tests/tidy/source_tree.h"

/// Who may include whom: the house's floor plan, one row a library. The link targets in the CMakeLists.txt files hold
/// the same rules for symbols.
namespace hilbrush::tidy {
namespace fs = std::filesystem;

struct LibraryRule {
  const char* name;
  const char* files;   ///< regex over the path of the including file; the first row that matches counts
  const char* ours;    ///< regex over our own headers that it may include
  const char* others;  ///< regex over other people's headers, beside the standard library
};

// What is plain enough for everybody below daemon/: options and nouns of std and Eigen only.
constexpr const char* kOptionHeaders =
    "sim/wire/(fault_script|cell_phase|endpoints)\\.h|sampling/(sample_options|tone|input_error|check)\\.h|planner/"
    "(angles|plan_options|mounting_options|cell_description|sha256)\\.h|"
    "drivers/device_options\\.h";
constexpr const char* kCellModelHeaders =
    "planner/(angles|cell_description|exposure_program|program_file|sha256|time_model|plan_options|"
    "mounting_options)\\.h";
constexpr const char* kPosix =
    "(unistd|fcntl|poll|netdb|sched|termios|signal|pthread|dirent|spawn|pwd|grp)\\.h|(sys|netinet|arpa|linux)/"
    "[a-z_]+\\.h";

const LibraryRule kRules[]{
    {"sampling_images", "sampling/images/.*", "sampling/[^/]+\\.h|sampling/images/.*",
     "OpenImageIO/.*|Eigen/.*|zlib\\.h"},
    // What meets bytes from outside knows nothing of what is done with a mesh.
    {"models",
     "sampling/((files|vrml)/.*|(model_file|model_folder|textured_mesh|mesh_repair|renumber|placement)\\.(h|cpp)|disk/"
     "edges\\.(h|cpp))",
     "sampling/((files|vrml)/.*|(model_file|model_folder|textured_mesh|mesh_repair|renumber|placement|input_error|"
     "check)\\.h|disk/edges\\.h)",
     "Eigen/.*|OpenMesh/.*|zlib\\.h"},
    {"sampling", "sampling/.*",
     "sampling/([^/]+|(files|vrml|tone|disk|curve|parametric|laminar|gaps|relax|quality)/.*)\\.h",
     "(unsupported/)?Eigen/.*|tbb/.*|oneapi/.*|boost/polygon/.*|metis\\.h"},
    {"cell_model", "planner/(cell_description|exposure_program|program_file|sha256|time_model)\\.(h|cpp)",
     "planner/(cell_description|exposure_program|program_file|sha256|time_model)\\.h", "Eigen/.*"},
    {"planner", "planner/.*", "planner/.*|sampling/[^/]+\\.h", "Eigen/.*|embree3/.*|tbb/.*|oneapi/.*"},
    {"drivers", "drivers/.*", "drivers/.*", "modbus/.*|modbus\\.h|libserialport\\.h"},
    {"sim_devices", "sim/devices/.*", "sim/devices/.*|drivers/.*", "Eigen/.*"},
    {"sim_wire", "sim/wire/.*", "sim/wire/.*|sim/devices/[^/]+\\.h|drivers/(clock|steady_clock)\\.h", ""},
    {"film", "sim/film/.*", "sim/film/.*|sim/devices/emission_record\\.h|sampling/[^/]+\\.h|sampling/images/.*",
     "Eigen/.*|embree3/.*|tbb/.*|oneapi/.*"},
    {"config", "config/.*", "config/.*", "nlohmann/.*|Eigen/.*"},
    // The light half of daemon/: starts in milliseconds, never sees a mesh or an image.
    {"light programs",
     "daemon/(server|commands)/.*|daemon/"
     "(executor|journal|journal_storage|duration_histogram|motion_times|program_limits|hilbrush_main|"
     "hilbrushd_main)\\.(h|cpp)",
     "daemon/(server|commands)/.*|daemon/"
     "(executor|journal|journal_storage|duration_histogram|motion_times|program_limits)\\.h|"
     "config/.*|drivers/.*|sim/devices/.*",
     ".*"},
    {"daemon", "daemon/.*", "(daemon|config|drivers|sim|planner|sampling)/.*", ".*"},
    {"tests", "tests/.*", "(tests|daemon|config|drivers|sim|planner|sampling)/.*", ".*"},
};

/// The libraries whose files may also use the option headers of all folders, and those that may use the cell's
/// description and programs.
bool may_use_options(std::string_view library) {
  return library == "config" || library == "light programs";
}
bool may_use_cell_model(std::string_view library) {
  return library == "sim_devices" || library == "sim_wire" || library == "film" || library == "light programs";
}
bool may_use_posix(std::string_view library) {
  return library == "drivers" || library == "sim_devices" || library == "sim_wire" || library == "cell_model";
}

const LibraryRule* rule_of(const std::string& path) {
  for (const LibraryRule& rule : kRules) {
    if (std::regex_match(path, std::regex(rule.files))) return &rule;
  }
  return nullptr;
}

bool is_standard_header(const std::string& header) {
  return std::regex_match(header, std::regex("[a-z_0-9]+"));
}

bool is_allowed(const LibraryRule& rule, const std::string& header, bool is_ours) {
  const auto matches = [&](const char* pattern) { return std::regex_match(header, std::regex(pattern)); };
  if (!is_ours)
    return is_standard_header(header) || matches(rule.others) || (may_use_posix(rule.name) && matches(kPosix));
  return matches(rule.ours) || (may_use_options(rule.name) && matches(kOptionHeaders)) ||
         (may_use_cell_model(rule.name) && matches(kCellModelHeaders));
}

struct Include {
  std::string header;
  bool is_quoted = false;
};

std::vector<std::pair<std::size_t, Include>> includes_of(const SourceFile& file) {
  static const std::regex kInclude(R"(\s*#\s*include\s*([<"])([^>"]+)[>"].*)");
  std::vector<std::pair<std::size_t, Include>> found;
  const std::vector<std::string> lines = file.lines();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::smatch match;
    if (std::regex_match(lines[i], match, kInclude)) found.push_back({i + 1, {match[2], match[1] == "\""}});
  }
  return found;
}

TEST(Includes, EveryFileKeepsToItsLibrarysRule) {
  std::size_t count = 0;
  for (const SourceFile& file : source_files()) {
    if (!file.is_cpp()) continue;
    const LibraryRule* rule = rule_of(file.path);
    ASSERT_NE(rule, nullptr) << file.path << ": belongs to no library of the table";
    for (const auto& [line, include] : includes_of(file)) {
      ++count;
      EXPECT_TRUE(is_allowed(*rule, include.header, include.is_quoted))
          << file.path << ":" << line << ": " << rule->name << " may not include " << include.header;
    }
  }
  EXPECT_GT(count, 100u);
}

TEST(Includes, OwnHeadersAreNamedFromTheTopAndExist) {
  for (const SourceFile& file : source_files()) {
    if (!file.is_cpp()) continue;
    for (const auto& [line, include] : includes_of(file)) {
      if (include.is_quoted) {
        EXPECT_TRUE(fs::exists(top_folder() / include.header))
            << file.path << ":" << line << ": no such file from the top: " << include.header;
      } else {
        EXPECT_FALSE(fs::exists(top_folder() / include.header))
            << file.path << ":" << line << ": our own headers go in quotes";
      }
    }
  }
}

TEST(Includes, HeavyHeadersStayInSourceFiles) {
  // Shared by the source files of one library, and never included from another folder.
  const std::set<std::string> kPrivate{"sampling/model/files/polygon_importer.h"};
  static const std::regex kHeavy(
      "OpenMesh/.*|OpenImageIO/.*|boost/.*|nlohmann/json\\.hpp|spdlog/.*|CLI/.*|embree3/.*|SQLiteCpp/.*");
  for (const SourceFile& file : source_files()) {
    if (!file.has_ending(".h") || file.is_below("tests") || file.is_below("daemon") || kPrivate.contains(file.path))
      continue;
    for (const auto& [line, include] : includes_of(file)) {
      EXPECT_FALSE(std::regex_match(include.header, kHeavy))
          << file.path << ":" << line << ": keep " << include.header << " in a .cpp file";
    }
  }
}

TEST(Includes, TheTableRefusesWhatItShould) {
  // The rules themselves, tried on includes that must not pass.
  const auto refused = [](const char* path, const char* header, bool is_ours) {
    return !is_allowed(*rule_of(path), header, is_ours);
  };
  EXPECT_TRUE(refused("sampling/dots.cpp", "planner/plan.h", true));
  EXPECT_TRUE(refused("sampling/model/vrml/parser.cpp", "sampling/curve/stream_dots.h", true));
  EXPECT_TRUE(refused("sampling/dots.cpp", "sampling/images/image_file.h", true));
  EXPECT_TRUE(refused("sampling/dots.cpp", "OpenImageIO/imageio.h", false));
  EXPECT_TRUE(refused("sampling/base/sha256.cpp", "sampling/dots/dots.h", true));
  EXPECT_TRUE(refused("drivers/laser.h", "planner/cell_model/cell_description.h", true));
  EXPECT_TRUE(refused("drivers/laser.h", "Eigen/Core", false));
  EXPECT_TRUE(refused("sim/devices/sim_cell.cpp", "sampling/model/textured_mesh.h", true));
  EXPECT_TRUE(refused("sim/film/film.cpp", "planner/plan.h", true));
  EXPECT_TRUE(refused("sim/wire/dobot_controller.cpp", "drivers/dobot/dobot_codec.h", true));
  EXPECT_TRUE(refused("config/cell_file.cpp", "sampling/model/textured_mesh.h", true));
  EXPECT_TRUE(refused("daemon/server/server.cpp", "sim/film/film.h", true));
  EXPECT_TRUE(refused("daemon/hilbrushd_main.cpp", "planner/plan.h", true));
  EXPECT_TRUE(refused("planner/plan.cpp", "tests/tidy/source_tree.h", true));
  EXPECT_FALSE(refused("sim/film/film.cpp", "planner/cell_model/cell_description.h", true));
  EXPECT_FALSE(refused("config/job_settings.cpp", "planner/cell_model/plan_options.h", true));
}

}  // namespace hilbrush::tidy
