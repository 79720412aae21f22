#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <regex>

#include "tests/support/shell.h"
#include "tests/tidy/source_tree.h"

/// Who may include whom: the house's floor plan, one row a library or a folder of one. The link targets in
/// the CMakeLists.txt files hold the same rules for symbols; tests/tidy/draw_floor_plan prints what is really
/// included.
namespace hilbrush::tidy {
namespace fs = std::filesystem;

struct FolderRule {
  const char* folder;  ///< and all below it; the longest one that fits a file counts
  std::vector<const char*>
      ours;  ///< folders whose headers it may include; "folder/." is the folder without what is below
  const char* others;  ///< regex over other people's headers, beside the standard library
};

constexpr const char* kRays = "Eigen/.*|embree3/.*|tbb/.*|oneapi/.*";
constexpr const char* kPosix =
    "(unistd|fcntl|poll|netdb|sched|termios|signal|pthread|dirent|spawn|pwd|grp)\\.h|(sys|netinet|arpa|linux)"
    "/"
    "[a-z_]+\\.h";

const std::vector<FolderRule>& folder_rules() {
  static const std::vector<FolderRule> rules{
      {"sampling/base", {"sampling/base"}, "Eigen/.*|fmt/.*|POSIX"},
      {"sampling/options", {"sampling/options", "sampling/base"}, ""},
      // What meets bytes from outside knows nothing of what is done with a mesh.
      {"sampling/model", {"sampling/model", "sampling/base"}, "Eigen/.*|OpenMesh/.*|zlib\\.h|fmt/.*"},
      {"sampling/images",
       {"sampling/images", "sampling/model", "sampling/base"},
       "OpenImageIO/.*|Eigen/.*|zlib\\.h"},
      {"sampling",
       {"sampling/.", "sampling/base", "sampling/options", "sampling/model", "sampling/dots", "sampling/disk",
        "sampling/tone", "sampling/curve", "sampling/blue", "sampling/fine", "sampling/predictive",
        "sampling/gaps", "sampling/laminar", "sampling/parametric", "sampling/quality"},
       "(unsupported/)?Eigen/.*|tbb/.*|oneapi/.*|boost/polygon/.*|metis\\.h|fmt/.*"},
      {"planner/cell_model", {"planner/cell_model", "sampling/base"}, "Eigen/.*|POSIX|fmt/.*"},
      {"planner",
       {"planner", "sampling/base", "sampling/model", "sampling/dots"},
       "Eigen/.*|fmt/.*|tbb/.*|embree3/.*"},
      {"drivers", {"drivers"}, "modbus/.*|modbus\\.h|libserialport\\.h|POSIX"},
      {"sim/script", {"sim/script"}, ""},
      {"sim/devices",
       {"sim/devices", "drivers/.", "planner/cell_model", "sampling/base"},
       "Eigen/.*|fmt/.*|POSIX"},
      // The wires of real devices, with tables of their own: the drivers' codecs are what they test.
      {"sim/wire",
       {"sim/wire", "sim/script", "sim/devices", "drivers/.", "planner/cell_model", "sampling/base"},
       "fmt/.*|POSIX"},
      {"sim/film",
       {"sim/film", "sim/devices", "sampling/.", "sampling/base", "sampling/options", "sampling/model",
        "sampling/dots", "sampling/tone", "sampling/predictive", "sampling/images", "planner/cell_model"},
       kRays},
      {"config",
       {"config", "drivers/.", "sim/script", "planner/cell_model", "sampling/base", "sampling/options"},
       "nlohmann/.*|Eigen/.*|fmt/.*"},
      // The light half of daemon/: starts in milliseconds, never sees a mesh or an image.
      {"daemon/execution",
       {"daemon/execution", "config", "drivers", "sim/devices", "planner/cell_model", "sampling/base"},
       ".*"},
      {"daemon/server",
       {"daemon/server", "daemon/execution", "config", "drivers", "sim/devices", "planner/cell_model",
        "sampling/base", "sampling/options"},
       ".*"},
      {"daemon/commands",
       {"daemon/commands", "daemon/execution", "config", "drivers", "planner/cell_model", "sampling/base",
        "sampling/options"},
       ".*"},
      {"daemon/pipeline",
       {"daemon/pipeline", "daemon/execution", "config", "drivers", "sim", "planner", "sampling"},
       ".*"},
      {"daemon", {"daemon", "config", "drivers", "sim", "planner", "sampling"}, ".*"},
      {"tests", {"tests", "daemon", "config", "drivers", "sim", "planner", "sampling"}, ".*"},
  };
  return rules;
}

bool is_below(const std::string& path, std::string_view folder) {
  return path.starts_with(std::string(folder) + "/");
}

const FolderRule* rule_of(const std::string& path) {
  const FolderRule* found = nullptr;
  for (const FolderRule& rule : folder_rules()) {
    const bool is_longer = found == nullptr || std::strlen(rule.folder) > std::strlen(found->folder);
    if (is_below(path, rule.folder) && is_longer) found = &rule;
  }
  return found;
}

bool is_standard_header(const std::string& header) {
  return std::regex_match(header, std::regex("[a-z_0-9]+"));
}

bool is_own_allowed(const FolderRule& rule, const std::string& header) {
  return std::any_of(rule.ours.begin(), rule.ours.end(), [&](std::string_view folder) {
    if (!folder.ends_with("/.")) return is_below(header, folder);
    folder.remove_suffix(2);
    return is_below(header, folder) && header.find('/', folder.size() + 1) == std::string::npos;
  });
}

bool is_allowed(const FolderRule& rule, const std::string& header, bool is_ours) {
  if (is_ours) return is_own_allowed(rule, header);
  const bool may_use_posix = std::string_view(rule.others).find("POSIX") != std::string_view::npos;
  return is_standard_header(header) || std::regex_match(header, std::regex(rule.others)) ||
         (may_use_posix && std::regex_match(header, std::regex(kPosix)));
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

TEST(Includes, EveryFileKeepsToItsFoldersRule) {
  std::size_t count = 0;
  for (const SourceFile& file : source_files()) {
    if (!file.is_cpp()) continue;
    const FolderRule* rule = rule_of(file.path);
    ASSERT_NE(rule, nullptr) << file.path << ": belongs to no folder of the table";
    for (const auto& [line, include] : includes_of(file)) {
      ++count;
      EXPECT_TRUE(is_allowed(*rule, include.header, include.is_quoted))
          << file.path << ":" << line << ": " << rule->folder << " may not include " << include.header;
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

TEST(Includes, NoFolderIncludesOneThatIncludesIt) {
  const testing_support::CommandResult plan =
      testing_support::run_command((top_folder() / "tests/tidy/draw_floor_plan").string());
  EXPECT_EQ(plan.exit_code, 0) << plan.output;
  EXPECT_NE(plan.output.find("sampling/base ->\n"), std::string::npos) << plan.output;
  // The front page shows the plan as it is.
  EXPECT_NE(read_text(top_folder() / "README.md").find("```\n" + plan.output + "```\n"), std::string::npos)
      << "README.md shows another floor plan than\n"
      << plan.output;
}

TEST(Includes, HeavyHeadersStayInSourceFiles) {
  static const std::regex kHeavy(
      "OpenMesh/.*|OpenImageIO/.*|boost/.*|nlohmann/json\\.hpp|spdlog/.*|CLI/.*|embree3/.*|SQLiteCpp/.*");
  for (const SourceFile& file : source_files()) {
    if (!file.has_ending(".h") || file.is_below("tests") || file.is_below("daemon")) continue;
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
  EXPECT_TRUE(refused("sampling/dots/dots.cpp", "planner/plan.h", true));
  EXPECT_TRUE(refused("sampling/model/vrml/parser.cpp", "sampling/curve/stream_dots.h", true));
  EXPECT_TRUE(refused("sampling/dots/dots.cpp", "sampling/images/image_file.h", true));
  EXPECT_TRUE(refused("sampling/dots/dots.cpp", "OpenImageIO/imageio.h", false));
  EXPECT_TRUE(refused("sampling/base/sha256.cpp", "sampling/dots/dots.h", true));
  EXPECT_TRUE(refused("drivers/laser.h", "planner/cell_model/cell_description.h", true));
  EXPECT_TRUE(refused("drivers/laser.h", "Eigen/Core", false));
  EXPECT_TRUE(refused("sim/devices/sim_cell.cpp", "sampling/model/textured_mesh.h", true));
  EXPECT_TRUE(refused("sim/film/film.cpp", "planner/plan.h", true));
  EXPECT_TRUE(refused("sim/wire/dobot_controller.cpp", "drivers/dobot/dobot_codec.h", true));
  EXPECT_TRUE(refused("config/cell_file.cpp", "sampling/model/textured_mesh.h", true));
  EXPECT_TRUE(refused("daemon/server/server.cpp", "sim/film/film.h", true));
  EXPECT_TRUE(refused("daemon/commands/watch.cpp", "daemon/server/server.h", true));
  EXPECT_TRUE(refused("planner/plan.cpp", "tests/tidy/source_tree.h", true));
  EXPECT_FALSE(refused("sim/film/film.cpp", "planner/cell_model/cell_description.h", true));
  EXPECT_FALSE(refused("config/job_settings.cpp", "planner/cell_model/plan_options.h", true));
}

}  // namespace hilbrush::tidy
