#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/skipped_figures.h"
#include "planner/mounting_advice.h"
#include "planner/plan.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/place_picture.h"
#include "sim/film/fidelity.h"

/// What one run of the pipeline found, as people and programs read it: report.json. Keys are stable: added, never
/// renamed.
namespace hilbrush {

/// Counts that add up: placed = exposed + in_doubt + remaining + the skipped ones.
struct DotCounts {
  std::uint64_t requested = 0;  ///< what the settings ask for: the count, or mass / pitch^2
  std::uint64_t placed = 0, exposed = 0, in_doubt = 0, remaining = 0;
  std::map<std::string, std::uint64_t> skipped;  ///< by reason
};

struct IncidenceFigures {
  double mean_deg = 0, p95_deg = 0, max_deg = 0;
};
IncidenceFigures incidence_figures(const ExposureProgram& program);

/// How the program moves from exposure to exposure.
struct MotionFigures {
  std::uint64_t table_poses = 0;  ///< in which the table stands while dots are exposed, each time counted
  std::uint64_t retracts = 0;     ///< moves led around by way-points, between the first exposure and the last
  std::uint64_t elbow_flips = 0;
  double path_mm = 0;  ///< on the object, in the order of exposure
};
MotionFigures motion_figures(const ExposureProgram& program);

/// Where the beam landed against where planning wanted it.
struct HitFigures {
  double max_error_um = 0;
  std::uint64_t off_target = 0;  ///< hits farther than 10 micrometers from their dot, and misses
  std::uint64_t shadowed = 0;    ///< something stood between lens and focus
};

struct Report {
  struct Mesh {
    std::string file;
    std::size_t vertices = 0, faces = 0;
    std::vector<ComponentReport> components;
    double area_m2 = 0;
    std::vector<Repair> repairs;
    std::vector<std::string> warnings;
  } mesh;
  DotCounts dots;
  std::vector<SkippedFigures> skipped;  ///< why, with amounts
  std::optional<MountingAdvice> advice;
  double pitch_m = 0;
  IncidenceFigures incidence;
  MotionFigures motion;
  TimeSplit time;
  double least_time_s = 0;  ///< see plan.h
  PictureReport picture;
  std::optional<Fidelity> fidelity;
  std::optional<HitFigures> hits;
  std::vector<std::pair<std::string, double>> stages_s;
  std::vector<std::string> files;  ///< written, relative to the output folder
  std::string settings_json;
  std::uint64_t seed = 0;
};

/// The JSON text of `report`, indented; peak memory and version are filled in here.
std::string report_to_json(const Report& report);

/// What `plan` counted, read back from its report: the skipped dots by reason and what the settings requested.
/// @throws InputError naming the file.
DotCounts dot_counts_from_report(const std::filesystem::path& report_file);

/// Why dots were skipped, read back from the same report; empty where it does not say.
/// @throws InputError naming the file.
std::vector<SkippedFigures> skipped_figures_from_report(const std::filesystem::path& report_file);

}  // namespace hilbrush
