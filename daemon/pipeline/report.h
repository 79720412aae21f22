#pragma once
#include <Eigen/Geometry>
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

/// What one run of the pipeline found: report.json, for people and programs. Keys are stable: new ones are
/// added, none is renamed.
namespace hilbrush {

/// placed = exposed + in_doubt + remaining + the sum of skipped.
struct DotCounts {
  std::uint64_t requested = 0;  ///< by the settings: their count, or mass / pitch^2
  std::uint64_t placed = 0;
  std::uint64_t exposed = 0;
  std::uint64_t in_doubt = 0;
  std::uint64_t remaining = 0;
  std::map<std::string, std::uint64_t> skipped;  ///< by reason
};

struct IncidenceFigures {
  double mean_deg = 0;
  double p95_deg = 0;  ///< of 95 % of the dots it is at most this
  double max_deg = 0;
};
IncidenceFigures incidence_figures(const ExposureProgram& program);

/// How the program moves from exposure to exposure.
struct MotionFigures {
  std::uint64_t table_poses = 0;  ///< how often the table stops to expose dots
  std::uint64_t retracts = 0;     ///< moves through way-points, between the first exposure and the last
  std::uint64_t elbow_flips = 0;  ///< changes between left and right elbow
  double path_mm = 0;             ///< on the object, in the order of exposure
};
MotionFigures motion_figures(const ExposureProgram& program);

/// Where the beam landed, compared with the planned positions.
struct HitFigures {
  double max_error_um = 0;
  std::uint64_t off_target = 0;  ///< hits farther than 10 micrometers from their dot, and misses
  std::uint64_t shadowed = 0;    ///< hits with an obstacle between lens and focus
};

struct Report {
  struct Mesh {
    std::string file;
    std::size_t vertices = 0;
    std::size_t faces = 0;
    std::vector<ComponentReport> components;
    double area_m2 = 0;
    Eigen::AlignedBox3d box_O;  ///< m; z = 0 is the top of the post, x = y = 0 its axis
    std::vector<Repair> repairs;
    std::vector<std::string> warnings;
  } mesh;
  DotCounts dots;
  std::vector<SkippedFigures> skipped;  ///< the causes, with amounts
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

/// The JSON text of `report`, indented. Adds CPU time, peak memory and the version of this program.
std::string report_to_json(const Report& report);

/// Reads the counts of `plan` from its report: requested and placed dots, and the skipped ones by reason.
/// @throws InputError naming the file.
DotCounts dot_counts_from_report(const std::filesystem::path& report_file);

/// Reads the causes of skipped dots from the same report; empty if it has none.
/// @throws InputError naming the file.
std::vector<SkippedFigures> skipped_figures_from_report(const std::filesystem::path& report_file);

}  // namespace hilbrush
