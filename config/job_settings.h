#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "planner/plan_options.h"
#include "sampling/sample_options.h"
#include "sampling/tone.h"

/// What an operator may set for one job: the keys of a job file, of job.submit's "settings", and the flags of the
/// command (size_mm: --size-mm).
namespace hilbrush {

struct JobSettings {
  std::optional<double> dpi;          ///< dots per 25.4 mm of full tone; or
  std::optional<std::uint64_t> dots;  ///< exactly so many
  std::optional<double> size_mm;      ///< scale the longest side to this; or
  std::optional<double> units_mm;     ///< millimetres of one unit of the file
  std::optional<std::string> up;      ///< "y" or "z"
  Untextured untextured = Untextured::kAuto;
  Sampler sampler = Sampler::kCentroid;
  std::string curve = "hilbert";
  std::uint64_t seed = 1;
  double max_incidence_deg = 45;
  double preferred_incidence_deg = 20;
  std::string cell = "default";  ///< name of a shipped cell, or a file
  bool dry_run = false;
};

/// Strict: unknown keys, wrong types and values out of range are InputErrors with the JSON path; `origin` names the
/// file in them, if any. `text` is a JSON object; every key may be left out or null. dpi becomes 100 if neither dpi nor
/// dots is given.
JobSettings job_settings_from_json(const std::string& text, const std::string& origin = {});
/// Canonical: all keys in a fixed order (null where nothing is set), so that its hash identifies the settings.
std::string job_settings_to_json(const JobSettings& settings);

const char* sampler_name(Sampler sampler);           ///< "centroid", "jittered", "even", "random"
const char* untextured_name(Untextured untextured);  ///< "auto", "blank", "material"

SampleOptions sample_options(const JobSettings& settings);
PlanOptions plan_options(const JobSettings& settings);

}  // namespace hilbrush
