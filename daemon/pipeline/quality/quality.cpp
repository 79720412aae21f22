#include "daemon/pipeline/quality/quality.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "config/json_reader.h"
#include "daemon/pipeline/output_files.h"
#include "daemon/pipeline/quality/figures.h"
#include "daemon/pipeline/quality/measured_set.h"
#include "daemon/pipeline/quality/plots.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kMaxMeasuredDots = 20'000'000;
constexpr std::size_t kMaxCounts = 64;

Json json_of(const QualityRequest& request, const MeasuredSet& set) {
  Json json{{"kind", set.kind}, {"set", std::filesystem::path(request.set).filename().string()}};
  const auto put = [&json](const char* key, const std::string& value) {
    if (!value.empty()) json[key] = value;
  };
  put("model", std::filesystem::path(request.model).filename().string());
  put("sampler", request.sampler);
  put("curve", request.curve);
  put("area", request.area);
  put("density", request.density);
  put("points", request.points);
  json["seed"] = request.seed;
  json["shapes"] = request.shapes;
  return json;
}

std::string title_of(const QualityRequest& request) {
  std::string title = std::filesystem::path(request.set).filename().string();
  for (const std::string& part : {request.curve, request.sampler, request.points, request.density})
    if (!part.empty()) title += ", " + part;
  return title;
}

/// Section 5.4 of the thesis: the coherence of the curves through the square.
Json measure_coherence(const QualityRequest& request, const std::filesystem::path& output,
                       std::vector<std::string>& files) {
  Json json = Json::object();
  for (const PlaneCurve curve :
       {PlaneCurve::kHilbert, PlaneCurve::kPeano2, PlaneCurve::kZ, PlaneCurve::kRows}) {
    const int depth = curve == PlaneCurve::kPeano2 ? 9 : 12;  // as in the thesis
    const Coherence coherence = spatial_coherence(curve, depth, {request.shapes, request.seed});
    json[plane_curve_name(curve)] = {{"correlation", coherence.correlation}, {"hoelder", coherence.hoelder}};
    files.push_back(write_coherence(curve, coherence, output));
  }
  return json;
}

std::vector<std::uint64_t> counts_of(const QualityRequest& request, const MeasuredSet& set) {
  std::vector<std::uint64_t> counts = request.counts.empty() ? set.default_counts() : request.counts;
  std::sort(counts.begin(), counts.end());
  return counts;
}

}  // namespace

QualityRequest quality_request_from_json(const std::string& text) {
  QualityRequest request;
  read_json_object(text, {}, [&](JsonObject& json) {
    constexpr std::size_t kPathLength = 4096;
    const auto text_of = [&](const char* key, std::size_t length = 100) {
      return json.optional_text(key, length).value_or("");
    };
    request.set = json.text("set", kPathLength);
    request.model = text_of("model", kPathLength);
    request.settings_json = text_of("settings", 64u << 10);
    request.sampler = text_of("sampler");
    request.curve = text_of("curve");
    request.area = text_of("area");
    request.density = text_of("density");
    request.points = text_of("points");
    request.seed = json.optional_integer("seed", 0, ~std::uint64_t{0} >> 1).value_or(1);
    request.shapes = json.optional_integer("shapes", 1, 1'000'000).value_or(1000);
    if (json.has("count"))
      for (const double count :
           json.numbers("count", 1, kMaxCounts, {1, static_cast<double>(kMaxMeasuredDots)}))
        request.counts.push_back(static_cast<std::uint64_t>(count));
  });
  return request;
}

std::string run_quality(const QualityRequest& request, const std::filesystem::path& output,
                        const PipelineListener& listener) {
  const auto report_progress = [&](const char* stage, double fraction) {
    if (listener.on_progress) listener.on_progress(stage, fraction);
  };
  report_progress("load", 0);
  const std::unique_ptr<MeasuredSet> set = make_measured_set(request);
  make_output_folder(output);
  for (const std::string& note : set->notes)
    if (listener.on_warning) listener.on_warning(note);

  const std::vector<std::uint64_t> counts = counts_of(request, *set);
  const TestShapes shapes{request.shapes, request.seed};
  std::vector<SizedFigures> sizes;
  MeasuredDots dots;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    report_progress("measure", static_cast<double>(i) / static_cast<double>(counts.size()));
    dots = set->place(counts[i]);
    sizes.push_back(measure(*set, dots, shapes));
  }

  report_progress("images", 0);
  Json json{{"set", json_of(request, *set)}, {"sizes", Json::array()}};
  for (const SizedFigures& figures : sizes)
    json["sizes"].push_back(json_of(figures, &figures == &sizes.back()));
  if (const Json slopes = slopes_of(sizes); !slopes.empty()) json["slopes"] = slopes;
  std::vector<std::string> files = write_plots(title_of(request), sizes, dots, output);
  if (!dots.plane_points.empty()) json["coherence"] = measure_coherence(request, output, files);
  json["notes"] = set->notes;
  files.insert(files.begin(), "quality.json");
  json["files"] = files;
  json["version"] = HILBRUSH_VERSION;
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  write_text_file(output / "quality.json", text + "\n");
  return text;
}

std::unique_ptr<MeasuredSet> make_measured_set(const QualityRequest& request) {
  if (!request.model.empty()) return make_dots_set(request);
  const std::vector<std::string> names = all_names(kParametricShapeNames);
  if (const auto found = std::find(names.begin(), names.end(), request.set); found != names.end())
    return make_parametric_set(request, kParametricShapeNames[found - names.begin()].value);
  std::error_code error;
  if (std::filesystem::exists(request.set, error)) return make_model_set(request);
  std::string known;
  for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
  throw InputError(
      "$.set", "there is no file \"" + request.set + "\" and no surface of that name; known are " + known);
}

std::size_t choice_of(const std::string& name, const std::vector<std::string>& names, std::size_t otherwise,
                      const std::string& path) {
  if (name.empty()) return otherwise;
  if (const auto found = std::find(names.begin(), names.end(), name); found != names.end())
    return static_cast<std::size_t>(found - names.begin());
  std::string known;
  for (std::size_t i = 0; i < names.size(); ++i)
    known += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + ("\"" + names[i] + "\"");
  throw InputError(path, "expected " + known + ", found \"" + name + "\"");
}

Sampler sampler_choice(const std::string& name, std::span<const Sampler> choices) {
  std::vector<std::string> names;
  for (const Sampler sampler : choices) names.emplace_back(sampler_name(sampler));
  return choices[choice_of(name, names, 0, "$.sampler")];
}

CurveKind curve_choice(const std::string& name) {
  constexpr std::array kCurves{CurveKind::kHilbert, CurveKind::kPeano2};
  return kCurves[choice_of(name, {curve_name(kCurves[0]), curve_name(kCurves[1])}, 0, "$.curve")];
}

}  // namespace hilbrush
