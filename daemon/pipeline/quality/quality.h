#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/pipeline/pipeline.h"

/// `hilbrush quality`: places dots on a named surface or a model, or takes those of a dry run, and measures
/// how evenly they lie, as figures (JSON) and plots (SVG).
namespace hilbrush {

struct QualityRequest {
  std::string set;    ///< name of a parametric surface, a model file, or (if `model` is given) a dots file
  std::string model;  ///< the model that the dots of `set` lie on
  std::string settings_json;                  ///< of the job that placed those dots
  std::string sampler, curve, area, density;  ///< how dots are placed; empty: the default
  std::string points;  ///< instead: a set made for the plane (by equation 5.3: the sphere), see point_sets.h
  std::vector<std::uint64_t> counts;  ///< one or more; more than one give slopes
  std::uint64_t seed = 1;
  std::uint64_t shapes = 1000;  ///< test shapes of each kind
};

/// Strict: unknown keys, wrong types and values out of range are InputErrors with the JSON path.
QualityRequest quality_request_from_json(const std::string& text);

/// Writes quality.json and plots into `output` (made if absent) and returns the text of quality.json.
/// @throws InputError for a fault of the request, its files or the output folder.
std::string run_quality(const QualityRequest& request, const std::filesystem::path& output,
                        const PipelineListener& listener);

}  // namespace hilbrush
