#include "daemon/pipeline/report.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "sampling/base/angles.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegreesPerRadian = 1 / kDegree;
constexpr std::size_t kMaxListedComponents = 32;

/// Rounded to six significant digits, more than the accuracy of any figure. JSON has no infinities: they
/// become null.
Json figure(double value) {
  if (!std::isfinite(value)) return nullptr;
  if (value == 0) return 0.0;
  const double scale = std::pow(10., 5 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

/// The number of components by how the curve orders them, and why.
Json orders_json(const std::vector<ComponentReport>& components) {
  std::map<std::string, std::size_t> by_reason;
  std::size_t mapped = 0;
  for (const auto& component : components) {
    if (component.is_mapped)
      ++mapped;
    else
      ++by_reason[component.order_reason];
  }
  Json orders = Json::array();
  if (mapped > 0) orders.push_back({{"order", "square map"}, {"components", mapped}});
  for (const auto& [reason, count] : by_reason)
    orders.push_back({{"order", "3D Hilbert"}, {"components", count}, {"reason", reason}});
  return orders;
}

Json lengths_json(const Eigen::Vector3d& lengths_m) {
  return {figure(lengths_m.x() * 1e3), figure(lengths_m.y() * 1e3), figure(lengths_m.z() * 1e3)};
}

Json mesh_json(const Report::Mesh& mesh) {
  int genus = 0;
  int loops = 0;
  bool is_genus_known = true;
  for (const auto& component : mesh.components) {
    is_genus_known = is_genus_known && component.genus >= 0;
    genus += std::max(component.genus, 0);
    loops += component.boundary_loops;
  }
  Json repairs = Json::array();
  for (const auto& repair : mesh.repairs) repairs.push_back({{"what", repair.what}, {"count", repair.count}});
  return {{"file", mesh.file},
          {"vertices", mesh.vertices},
          {"faces", mesh.faces},
          {"components", mesh.components.size()},
          {"genus", is_genus_known ? Json(genus) : Json(nullptr)},
          {"boundary_loops", loops},
          {"area_mm2", figure(mesh.area_m2 * 1e6)},
          {"size_mm", mesh.box_O.isEmpty() ? Json(nullptr) : lengths_json(mesh.box_O.sizes())},
          {"min_mm", mesh.box_O.isEmpty() ? Json(nullptr) : lengths_json(mesh.box_O.min())},
          {"max_mm", mesh.box_O.isEmpty() ? Json(nullptr) : lengths_json(mesh.box_O.max())},
          {"orders", orders_json(mesh.components)},
          {"repairs", repairs},
          {"warnings", mesh.warnings}};
}

/// The largest components, each with its part of the path.
Json components_json(const std::vector<ComponentReport>& components,
                     const std::vector<ComponentPath>& paths) {
  std::vector<std::size_t> order(components.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return components[a].area_m2 > components[b].area_m2;
  });
  order.resize(std::min(order.size(), kMaxListedComponents));
  Json list = Json::array();
  for (const std::size_t i : order) {
    const ComponentReport& component = components[i];
    Json entry{{"triangles", component.triangle_count},
               {"genus", component.genus >= 0 ? Json(component.genus) : Json(nullptr)},
               {"boundary_loops", component.boundary_loops},
               {"area_mm2", figure(component.area_m2 * 1e6)},
               {"order", component.is_mapped ? "square map" : "3D Hilbert"}};
    if (!component.order_reason.empty()) entry["reason"] = component.order_reason;
    if (component.is_mapped) {
      entry["pieces"] = component.piece_count;
      entry["cut_length_mm"] = figure(component.cut_length_m * 1e3);
      entry["map_shear"] = figure(component.map_shear);
    }
    if (i < paths.size()) {
      entry["path_length_mm"] = figure(paths[i].path_length_m * 1e3);
      entry["path_constant"] = figure(paths[i].path_constant);
    }
    list.push_back(std::move(entry));
  }
  return list;
}

Json dots_json(const DotCounts& dots) {
  return {{"requested", dots.requested}, {"placed", dots.placed},       {"exposed", dots.exposed},
          {"in_doubt", dots.in_doubt},   {"remaining", dots.remaining}, {"skipped", dots.skipped}};
}

Json skipped_json(const std::vector<SkippedFigures>& skipped) {
  Json list = Json::array();
  for (const auto& figures : skipped) {
    Json entry{{"reason", figures.reason}, {"what", figures.what}, {"count", figures.count}};
    if (!figures.unit.empty()) {
      entry["typical_" + figures.unit] = figure(figures.typical);
      entry["worst_" + figures.unit] = figure(figures.worst);
    }
    entry["text"] = figures.text;
    list.push_back(std::move(entry));
  }
  return list;
}

Json advice_json(const MountingAdvice& advice) {
  return {
      {"post_height_mm", advice.post_height_m ? Json(figure(*advice.post_height_m * 1e3)) : Json(nullptr)},
      {"up", advice.up ? Json(*advice.up == UpAxis::kY ? "y" : "z") : Json(nullptr)},
      {"reached_now", figure(advice.reached_now)},
      {"reached_then", figure(advice.reached_then)},
      {"text", advice_sentence(advice)}};
}

Json predictive_json(const PredictiveReport& predictive) {
  Json errors = Json::array();
  for (const double error : predictive.error_rms) errors.push_back(figure(error));
  return {{"rounds", predictive.error_rms.size()}, {"error_rms", errors}};
}

Json fidelity_json(const FidelityFigures& figures) {
  return {{"f1_db", figure(figures.f1_db)},
          {"f2_db", figure(figures.f2_db)},
          {"s2", figure(figures.s2)},
          {"tone_rms", figure(figures.tone_rms)},
          {"tone_max", figure(figures.tone_max)},
          {"p999", figure(figures.p999)}};
}

Json incidence_json(const IncidenceFigures& incidence) {
  return {{"mean", figure(incidence.mean_deg)},
          {"p95", figure(incidence.p95_deg)},
          {"max", figure(incidence.max_deg)}};
}

Json time_json(const TimeSplit& time, double least_time_s) {
  return {{"move", figure(time.move_s)},     {"settle", figure(time.settle_s)},
          {"expose", figure(time.expose_s)}, {"retract", figure(time.retract_s)},
          {"total", figure(time.total_s())}, {"least", figure(least_time_s)}};
}

Json motion_json(const MotionFigures& motion) {
  return {{"table_poses", motion.table_poses},
          {"retracts", motion.retracts},
          {"elbow_flips", motion.elbow_flips},
          {"path_mm", figure(motion.path_mm)}};
}

Json path_json(const SampleReport& path) {
  Json json{{"length_mm", figure(path.path_length_m * 1e3)},
            {"constant", figure(path.path_constant)},
            {"patches", path.patch_count}};
  json["patches_at_depth"] = path.patches_at_depth;
  return json;
}

Json fidelity_json(const Fidelity& fidelity) {
  Json json = fidelity_json(fidelity.reachable);
  json["unreachable_share"] = figure(fidelity.unreachable_share);
  json["whole"] = fidelity_json(fidelity.whole);
  return json;
}

Json hits_json(const HitFigures& hits) {
  return {{"max_error_um", figure(hits.max_error_um)},
          {"off_target", hits.off_target},
          {"shadowed", hits.shadowed}};
}

Json stages_json(const std::vector<std::pair<std::string, double>>& stages_s) {
  Json json;
  double total_s = 0;
  for (const auto& [stage, seconds] : stages_s) {
    json[stage] = figure(seconds);
    total_s += seconds;
  }
  json["total"] = figure(total_s);
  return json;
}

/// CPU time and peak memory of this process.
void add_resources(Json& json) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  json["cpu_s"] = figure(static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec));
  json["peak_rss_mb"] = figure(static_cast<double>(usage.ru_maxrss) / 1024);
}

}  // namespace

IncidenceFigures incidence_figures(const ExposureProgram& program) {
  if (program.exposures.empty()) return {};
  std::vector<float> incidences;
  incidences.reserve(program.exposures.size());
  double sum = 0;
  for (const auto& exposure : program.exposures) {
    incidences.push_back(exposure.incidence);
    sum += exposure.incidence;
  }
  std::sort(incidences.begin(), incidences.end());
  const std::size_t count = incidences.size();
  return {sum / static_cast<double>(count) * kDegreesPerRadian,
          incidences[(count - 1) * 95 / 100] * kDegreesPerRadian, incidences.back() * kDegreesPerRadian};
}

MotionFigures motion_figures(const ExposureProgram& program) {
  MotionFigures figures;
  const auto& exposures = program.exposures;
  if (!exposures.empty()) figures.table_poses = 1;
  for (std::size_t i = 1; i < exposures.size(); ++i) {
    const Joints& from = exposures[i - 1].joints;
    const Joints& to = exposures[i].joints;
    figures.path_mm += 1e3 * (exposures[i].position_O - exposures[i - 1].position_O).norm();
    if (from[kTilt] != to[kTilt] || from[kRotation] != to[kRotation]) ++figures.table_poses;
    if ((from[kJ2] >= 0) != (to[kJ2] >= 0)) ++figures.elbow_flips;
    if (!program.vias_before(i).empty()) ++figures.retracts;
  }
  return figures;
}

std::string report_to_json(const Report& report) {
  Json json;
  json["mesh"] = mesh_json(report.mesh);
  json["dots"] = dots_json(report.dots);
  json["skipped"] = skipped_json(report.skipped);
  json["suggestion"] = report.advice ? advice_json(*report.advice) : Json(nullptr);
  json["pitch_mm"] = figure(report.pitch_m * 1e3);
  json["incidence_deg"] = incidence_json(report.incidence);
  json["time_s"] = time_json(report.time, report.least_time_s);
  json["motion"] = motion_json(report.motion);
  json["path"] = path_json(report.picture.path);
  json["components"] = components_json(report.mesh.components, report.picture.path.components);
  json["filled"] = report.picture.filled.added;
  json["levels"] = report.picture.dots_of_level;
  json["predictive"] = predictive_json(report.picture.predictive);
  if (report.fidelity) json["fidelity"] = fidelity_json(*report.fidelity);
  if (report.hits) json["hits"] = hits_json(*report.hits);
  json["stages_s"] = stages_json(report.stages_s);
  add_resources(json);
  json["files"] = report.files;
  json["settings"] = Json::parse(report.settings_json);
  json["seed"] = report.seed;
  json["version"] = HILBRUSH_VERSION;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

namespace {

template <class Read>
auto read_report(const std::filesystem::path& report_file, const Read& read) {
  std::ifstream in(report_file);
  if (!in)
    throw InputError(report_file.string(),
                     "cannot be read; `develop` needs the report that `plan` wrote beside the program");
  try {
    return read(Json::parse(in));
  } catch (const Json::exception& error) {
    throw InputError(report_file.string(), std::string("is not a report of this program: ") + error.what());
  }
}

}  // namespace

std::vector<SkippedFigures> skipped_figures_from_report(const std::filesystem::path& report_file) {
  return read_report(report_file, [](const Json& report) {
    std::vector<SkippedFigures> all;
    for (const Json& entry : report.value("skipped", Json::array())) {
      SkippedFigures figures;
      figures.reason = entry.at("reason").get<std::string>();
      figures.what = entry.at("what").get<std::string>();
      figures.count = entry.at("count").get<std::uint64_t>();
      figures.text = entry.at("text").get<std::string>();
      for (const char* unit : {"mm", "deg"})
        if (entry.contains(std::string("typical_") + unit)) {
          figures.unit = unit;
          figures.typical = entry.at("typical_" + figures.unit).get<double>();
          figures.worst = entry.at("worst_" + figures.unit).get<double>();
        }
      all.push_back(std::move(figures));
    }
    return all;
  });
}

DotCounts dot_counts_from_report(const std::filesystem::path& report_file) {
  return read_report(report_file, [](const Json& report) {
    const Json& dots = report.at("dots");
    DotCounts counts;
    counts.requested = dots.at("requested").get<std::uint64_t>();
    counts.placed = dots.at("placed").get<std::uint64_t>();
    for (const auto& [reason, count] : dots.at("skipped").items())
      counts.skipped[reason] = count.get<std::uint64_t>();
    return counts;
  });
}

}  // namespace hilbrush
