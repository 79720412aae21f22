#include "tests/pipeline/report_expectations.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace hilbrush::testing_pipeline {
namespace {

using Json = nlohmann::json;

/// The keys that scripts may rely on, as "group.key".
constexpr const char* kNumbers[]{"/mesh/vertices",
                                 "/mesh/faces",
                                 "/mesh/components",
                                 "/mesh/boundary_loops",
                                 "/mesh/area_mm2",
                                 "/dots/requested",
                                 "/dots/placed",
                                 "/dots/exposed",
                                 "/dots/in_doubt",
                                 "/dots/remaining",
                                 "/incidence_deg/mean",
                                 "/incidence_deg/p95",
                                 "/incidence_deg/max",
                                 "/time_s/move",
                                 "/time_s/settle",
                                 "/time_s/expose",
                                 "/time_s/retract",
                                 "/time_s/total",
                                 "/motion/table_poses",
                                 "/motion/retracts",
                                 "/motion/elbow_flips",
                                 "/motion/path_mm",
                                 "/path/length_mm",
                                 "/path/constant",
                                 "/fidelity/s2",
                                 "/fidelity/tone_rms",
                                 "/fidelity/tone_max",
                                 "/fidelity/p999",
                                 "/fidelity/unreachable_share",
                                 "/stages_s/load",
                                 "/stages_s/disk",
                                 "/stages_s/curve",
                                 "/stages_s/dots",
                                 "/stages_s/plan",
                                 "/stages_s/check",
                                 "/stages_s/paint",
                                 "/stages_s/images",
                                 "/peak_rss_mb",
                                 "/seed",
                                 "/hits/max_error_um"};

void expect_counts_add_up(const Json& dots) {
  std::uint64_t skipped = 0;
  for (const auto& [reason, count] : dots.at("skipped").items()) skipped += count.get<std::uint64_t>();
  const std::uint64_t placed = dots.at("placed");
  const std::uint64_t exposed = dots.at("exposed");
  EXPECT_EQ(placed, exposed + dots.at("in_doubt").get<std::uint64_t>() +
                        dots.at("remaining").get<std::uint64_t>() + skipped);
  EXPECT_EQ(dots.at("in_doubt"), 0) << "a dry run is never interrupted";
  EXPECT_EQ(dots.at("remaining"), 0) << "a dry run paints all it planned";
}

}  // namespace

void expect_sound_dry_run(const std::string& report_text, const std::filesystem::path& folder) {
  const Json report = Json::parse(report_text);
  for (const char* pointer : kNumbers) {
    const Json::json_pointer at(pointer);
    ASSERT_TRUE(report.contains(at)) << pointer << " is missing";
    EXPECT_TRUE(report.at(at).is_number()) << pointer << " is " << report.at(at);
  }
  for (const char* pointer :
       {"/mesh/file", "/mesh/genus", "/mesh/repairs", "/mesh/warnings", "/fidelity/f1_db", "/fidelity/f2_db",
        "/version", "/mesh/size_mm", "/mesh/min_mm", "/mesh/max_mm"})
    EXPECT_TRUE(report.contains(Json::json_pointer(pointer))) << pointer << " is missing";

  expect_counts_add_up(report.at("dots"));
  const bool is_blank =
      report.at("mesh").at("warnings").dump().find("there is nothing to paint") != std::string::npos;
  EXPECT_EQ(report.at("dots").at("placed") == 0, is_blank);
  EXPECT_GT(report.at("mesh").at("area_mm2"), 0);
  EXPECT_LE(report.at("incidence_deg").at("max"), 45.001);
  EXPECT_LE(report.at("hits").at("max_error_um"), 10);
  EXPECT_EQ(report.at("hits").at("off_target"), 0);

  EXPECT_FALSE(report.at("files").empty());
  for (const Json& file : report.at("files")) {
    const std::filesystem::path path = folder / file.get<std::string>();
    EXPECT_TRUE(std::filesystem::exists(path) && std::filesystem::file_size(path) > 0)
        << path << " is missing or empty";
  }
  for (const char* file : {"report.json", "dots.ply", "program.ply", "exposure.png"})
    EXPECT_TRUE(std::filesystem::exists(folder / file)) << file;
  EXPECT_FALSE(std::filesystem::is_empty(folder / "views"));
}

}  // namespace hilbrush::testing_pipeline
