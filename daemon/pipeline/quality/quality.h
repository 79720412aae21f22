#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/pipeline/pipeline.h"

/// `hilbrush quality`: places dots on a named surface or a model, or takes those of a dry run, and says how good they
/// are, in figures (JSON) and plots (SVG).
namespace hilbrush {

struct QualityRequest {
  std::string set;            ///< a parametric surface by name, a model file, or with `model` a dots file
  std::string model;          ///< the model that the dots of `set` lie on
  std::string settings_json;  ///< of the job that placed those dots
  std::string sampler, curve, area, density;  ///< how dots are placed; empty: not said
  std::string points;  ///< instead: a set made for the plane (by equation 5.3: the sphere), see point_sets.h
  std::vector<std::uint64_t> counts;  ///< one or several; several give slopes
  std::uint64_t seed = 1;
  std::uint64_t shapes = 1000;  ///< test shapes of each kind
};

/// Strict: unknown keys, wrong types and values out of range are InputErrors with the JSON path.
QualityRequest quality_request_from_json(const std::string& text);

/// Writes quality.json and plots into `output` (made if absent) and returns the text of quality.json.
/// @throws InputError for anything that the request, its files or the output folder are to blame for.
std::string run_quality(const QualityRequest& request, const std::filesystem::path& output,
                        const PipelineListener& listener);

}  // namespace hilbrush
