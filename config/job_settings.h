#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "planner/cell_model/mounting_options.h"
#include "planner/cell_model/plan_options.h"
#include "sampling/base/enum_names.h"
#include "sampling/options/sample_options.h"
#include "sampling/options/tone_options.h"

/// The settings of one job: the keys of a job file, of "settings" in job.submit, and the flags of the command
/// (size_mm:
/// --size-mm).
namespace hilbrush {

/// From wanted tone to asked coverage.
enum class ToneMapping {
  kCalibrated,  ///< by the cell's tone curve
  kLinear       ///< asked = wanted times the cell's asked_max: for a gray wedge that a curve is made from
};

inline constexpr EnumName<ToneMapping> kToneMappingNames[] = {
    {ToneMapping::kCalibrated, "calibrated"},
    {ToneMapping::kLinear, "linear"},
};

inline const char* tone_mapping_name(ToneMapping mapping) {
  return name_of(kToneMappingNames, mapping);
}

/// The post and plate that hold this job's object; unset values are those of the cell.
struct FixtureSettings {
  std::optional<double> post_height_mm, post_radius_mm, plate_radius_mm;
};

/// Where the object stands: turned about the axis of the post, then shifted from the center of the post's
/// top.
struct MountingSettings {
  std::array<double, 3> offset_mm{};
  double turn_deg = 0;
};

struct JobSettings {
  std::optional<double> dpi;          ///< dots per 25.4 mm of full tone; or
  std::optional<std::uint64_t> dots;  ///< exactly this many
  std::optional<double> size_mm;      ///< scale the longest side to this; or
  std::optional<double> units_mm;     ///< millimeters of one unit of the file
  std::optional<std::string> up;      ///< "y" or "z"
  Untextured untextured = Untextured::kAuto;
  Sampler sampler = Sampler::kCentroid;
  CurveKind curve = CurveKind::kHilbert;
  DensitySource density = DensitySource::kTexture;
  std::uint64_t seed = 1;
  int levels = 1;             ///< energies that a dot may have, 1 to 4
  int predictive_rounds = 0;  ///< of the loop that predicts the picture and corrects the tone, 0 to 4
  std::optional<double> largest_gap_pitches;  ///< holes wider than this are filled with dots
  int fine_passes = 24;                       ///< of the sampler "fine", each over all dots
  ToneMapping tone_curve = ToneMapping::kCalibrated;
  double max_incidence_deg = 45;
  double preferred_incidence_deg = 20;
  Planning planning = Planning::kBalanced;
  DotOrder order = DotOrder::kImproved;
  PosePolicy policy = PosePolicy::kSearch;
  FixtureSettings fixture;
  MountingSettings mounting;
  std::string cell = "default";  ///< name of a shipped cell, or a file
  bool dry_run = false;
};

/// Strict: unknown keys, wrong types and values out of range are InputErrors with the JSON path; `origin`
/// names the file, if there is one. `text` is a JSON object; every key may be missing or null. dpi becomes
/// 100 if neither dpi nor dots is given.
JobSettings job_settings_from_json(const std::string& text, const std::string& origin = {});
/// Canonical: all keys in a fixed order (null where nothing is set), so that its hash identifies the
/// settings.
std::string job_settings_to_json(const JobSettings& settings);
/// Names the settings that shape a program. The cell has a hash of its own, and a dry run changes nothing
/// about a program, so neither is part of it. Jobs and programs both carry it: the daemon paints a job only
/// if they agree.
std::string job_settings_sha256(JobSettings settings);

SampleOptions sample_options(const JobSettings& settings);
PlanOptions plan_options(const JobSettings& settings);
MountingOptions mounting_options(const JobSettings& settings);

}  // namespace hilbrush
