#include "daemon/pipeline/pipeline.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "config/cell_file.h"
#include "daemon/execution/executor.h"
#include "daemon/pipeline/job_sampling.h"
#include "daemon/pipeline/output_files.h"
#include "daemon/pipeline/painted_dots.h"
#include "daemon/pipeline/planning_pictures.h"
#include "daemon/pipeline/report.h"
#include "planner/cell_model/program_file.h"
#include "planner/check/program_check.h"
#include "planner/mounting.h"
#include "planner/mounting_advice.h"
#include "planner/plan.h"
#include "sampling/base/input_error.h"
#include "sampling/base/sha256.h"
#include "sampling/curve/curvature.h"
#include "sampling/curve/surface_curve.h"
#include "sampling/dots/dots_file.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sim/devices/sim_cell.h"
#include "sim/film/calibrate.h"
#include "sim/film/fidelity.h"
#include "sim/film/film.h"
#include "sim/film/picture_means.h"
#include "sim/film/views.h"

namespace hilbrush {
namespace {

/// Runs stages: reports their progress and measures their time.
class Stages {
 public:
  explicit Stages(const PipelineListener& listener) : listener_(listener) {}

  template <class Work>
  auto run(const char* stage, Work work) {
    const auto begin = std::chrono::steady_clock::now();
    report_progress(stage, 0);
    auto result = work([this, stage](double fraction) { report_progress(stage, fraction); });
    seconds_.emplace_back(stage,
                          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    return result;
  }
  void warn(const std::string& sentence) const {
    if (listener_.on_warning) listener_.on_warning(sentence);
  }
  const std::vector<std::pair<std::string, double>>& seconds() const { return seconds_; }

 private:
  void report_progress(const char* stage, double fraction) const {
    if (listener_.on_progress) listener_.on_progress(stage, fraction);
  }

  const PipelineListener& listener_;
  std::vector<std::pair<std::string, double>> seconds_;
};

std::string hash_of_files(const std::vector<std::filesystem::path>& files) {
  Sha256 hash;
  for (const auto& file : files)
    if (!hash.update_from_file(file)) throw InputError(file.string(), "cannot be read");
  return hash.hex_digest();
}

/// The object on the table: what later stages read but never change. Members refer to each other, so it is
/// not moved.
struct Workpiece {
  Workpiece(const PipelineRequest& request, Stages& stages)
      : cell(with_fixture(load_cell(request.cell_file), mounting_options(request.settings))),
        settings(request.settings) {
    Model model =
        stages.run("load", [&](const Progress&) { return load_model(request.model, load_image_file); });
    report.mesh.file = request.model.filename().string();
    report.mesh.warnings = model.warnings;
    report.settings_json = job_settings_to_json(settings);
    report.seed = settings.seed;
    up = placement_options(settings).up.value_or(model.up);
    provenance = {hash_of_files(model.files), job_settings_sha256(settings), cell.sha256, HILBRUSH_VERSION};

    auto repaired = stages.run("disk", [&](const Progress&) {
      return repair_mesh(
          mounted(place_on_table(model, placement_options(settings)), mounting_options(settings)));
    });
    mesh = with_curvature_density(std::move(repaired.mesh), settings.density);
    report.mesh.repairs = std::move(repaired.repairs);
    report.mesh.vertices = mesh.vertices.size();
    report.mesh.faces = mesh.triangle_count();
    report.mesh.area_m2 = mesh.area_m2();
    for (const Eigen::Vector3d& p_O : mesh.vertices) report.mesh.box_O.extend(p_O);

    const CellTone cell_tone = job_tone(cell, settings, mesh);
    tone_options = cell_tone.options;
    if (!cell_tone.warning.empty()) report.mesh.warnings.push_back(cell_tone.warning);
    for (const auto& sentence : report.mesh.warnings) stages.warn(sentence);
    tone.emplace(mesh, tone_options);
  }

  CellDescription cell;
  JobSettings settings;
  Provenance provenance;
  TexturedMesh mesh;
  UpAxis up = UpAxis::kZ;
  ToneOptions tone_options;
  std::optional<ToneField> tone;
  Report report;
};

struct PlannedWork {
  DotSequence dots;
  Plan plan;
};

std::vector<std::string> skip_reason_names() {
  std::vector<std::string> names{"exposed"};
  for (int r = 0; r < kSkipReasonCount; ++r) names.emplace_back(skip_reason_name(static_cast<SkipReason>(r)));
  return names;
}

void save_dots(const PlannedWork& work, const std::filesystem::path& file) {
  std::vector<std::uint8_t> reasons(work.dots.dots.size(), 0);
  for (const auto& skipped : work.plan.skipped)
    reasons[skipped.dot_index] = static_cast<std::uint8_t>(1 + static_cast<int>(skipped.reason));
  const auto names = skip_reason_names();
  write_dots(work.dots, reasons, names, file);
}

void refuse_faulty_program(const std::vector<ProgramFault>& faults) {
  if (faults.empty()) return;
  std::string sentence = "the finished program fails its check and is not written:";
  for (std::size_t i = 0; i < std::min<std::size_t>(faults.size(), 5); ++i)
    sentence += "\n  exposure " + std::to_string(faults[i].exposure) + ": " + faults[i].what;
  throw std::logic_error(sentence);
}

DotSequence sample_dots(Workpiece& piece, Stages& stages) {
  const auto curve = stages.run("curve", [&](const Progress& progress) {
    // Laminar slices need no curve, but the report's figures about the surface come from one.
    const CurveKind kind =
        piece.settings.curve == CurveKind::kLaminar ? CurveKind::kHilbert : piece.settings.curve;
    return std::make_unique<SurfaceCurve>(piece.mesh, kind, progress);
  });
  piece.report.mesh.components = curve->components();
  auto dots = stages.run("dots", [&](const Progress& progress) {
    return place_picture(*curve, *piece.tone, piece.tone_options, picture_options(piece.cell, piece.settings),
                         film_predictor(piece.cell, *piece.tone), &piece.report.picture, progress);
  });
  if (dots.dots.empty()) {
    piece.report.mesh.warnings.emplace_back(
        "there is nothing to paint: the surface is white, blank or transparent everywhere");
    stages.warn(piece.report.mesh.warnings.back());
  }
  return dots;
}

/// A picture of which most is missing is probably not what was wanted, and why is in its report only.
void warn_of_skipped(Report& report, const Stages& stages) {
  std::uint64_t skipped = 0;
  for (const SkippedFigures& figures : report.skipped) skipped += figures.count;
  if (report.dots.placed == 0 || 2 * skipped <= report.dots.placed) return;
  const std::string placed = std::to_string(report.dots.placed);
  const std::string begin = skipped == report.dots.placed
                                ? "none of the " + placed + " dots can be exposed"
                                : std::to_string(skipped) + " of " + placed + " dots cannot be exposed";
  const SkippedFigures& main = report.skipped.front();
  report.mesh.warnings.push_back(begin + "; " + std::to_string(main.count) + " of them: " + main.text);
  stages.warn(report.mesh.warnings.back());
}

PlannedWork plan_work(Workpiece& piece, const Reach& reach, const std::filesystem::path& output,
                      Stages& stages) {
  PlannedWork work;
  work.dots = sample_dots(piece, stages);
  Report& report = piece.report;
  report.pitch_m = work.dots.pitch_m;

  work.plan = stages.run(
      "plan", [&](const Progress& progress) { return plan_exposures(reach, work.dots, progress); });
  work.plan.program.provenance = piece.provenance;
  refuse_faulty_program(stages.run("check", [&](const Progress& progress) {
    return check_program(work.plan.program, work.plan.skipped, work.dots, piece.mesh, piece.cell,
                         plan_options(piece.settings), 20, progress, &piece.provenance);
  }));

  report.dots.placed = work.dots.dots.size();
  report.dots.requested = piece.settings.dots.value_or(report.dots.placed);
  report.dots.remaining = work.plan.program.exposures.size();
  for (const auto& skipped : work.plan.skipped) ++report.dots.skipped[skip_reason_name(skipped.reason)];
  report.skipped = skipped_figures(work.plan.skipped);
  warn_of_skipped(report, stages);
  report.advice =
      advise_mounting(piece.mesh, piece.cell, {mounting_options(piece.settings), piece.up},
                      plan_options(piece.settings), work.dots, work.plan.skipped, piece.settings.seed);
  report.incidence = incidence_figures(work.plan.program);
  report.motion = motion_figures(work.plan.program);
  report.time = work.plan.time;
  report.least_time_s = least_time_s(piece.cell, work.plan.program);

  write_program(work.plan.program, output / "program.ply");
  save_dots(work, output / "dots.ply");
  report.files = {"report.json", "program.ply", "dots.ply"};
  for (const auto& file : write_planning_pictures(piece.mesh, work.dots, work.plan, piece.cell, output))
    report.files.push_back(file.filename().string());
  return work;
}

/// Runs the program on a simulated cell in virtual time; returns what its laser recorded.
std::vector<Emission> paint_in_simulation(const ExposureProgram& program, CellDescription description,
                                          const Progress& progress) {
  description.simulation.time_scale = 0;
  SimCell sim(description);
  std::vector<Emission> emissions;
  emissions.reserve(program.exposures.size());
  sim.set_emission_sink([&emissions](const Emission& emission) { emissions.push_back(emission); });
  const Cell cell = sim.cell();
  bring_up(cell);

  Journal journal = Journal::in_memory(program.exposures.size());
  ExecutionControl control;
  std::vector<Joints> approach;  // from home, as the program has it
  for (const Via& via : program.vias_before(0)) approach.push_back(via.joints);
  const auto total = static_cast<double>(std::max<std::size_t>(program.exposures.size(), 1));
  const ExecutionResult result =
      execute(program, approach, cell, description, journal, control,
              [&](std::size_t done) { progress(static_cast<double>(done) / total); });
  cell.laser.disable();
  if (result.outcome != ExecutionOutcome::kFinished)
    throw std::logic_error("the simulated cell did not finish the program: " + result.reason);
  return emissions;
}

std::vector<Eigen::Vector3d> positions_of_unexposed(const DotSequence& dots, const ExposureProgram& program) {
  std::vector<bool> is_exposed(dots.dots.size(), false);
  for (const auto& exposure : program.exposures)
    if (exposure.dot_index < is_exposed.size()) is_exposed[exposure.dot_index] = true;
  std::vector<Eigen::Vector3d> positions;
  for (std::size_t i = 0; i < dots.dots.size(); ++i)
    if (!is_exposed[i]) positions.push_back(dots.dots[i].position_O);
  return positions;
}

/// Film, fidelity and pictures from the recorded emissions; completes the report.
void develop_and_judge(Workpiece& piece, const Reach& reach, const PlannedWork& work,
                       std::span<const Emission> emissions, const std::filesystem::path& output,
                       Stages& stages) {
  Report& report = piece.report;
  const ExposureProgram& program = work.plan.program;
  Film film(piece.mesh, piece.cell, program.pitch_m);
  const auto hits =
      stages.run("paint", [&](const Progress& progress) { return film.expose(emissions, progress); });

  const PaintedDots painted = match_emissions(program, emissions, hits);
  report.dots.exposed = painted.exposed;
  report.dots.in_doubt = painted.in_doubt;
  report.dots.remaining = program.exposures.size() - painted.exposed - painted.in_doubt;
  report.hits = painted.hits;
  if (painted.foreign > 0)
    report.mesh.warnings.push_back(std::to_string(painted.foreign) +
                                   " recorded emissions belong to no exposure of the program");
  if (painted.repeated > 0)
    report.mesh.warnings.push_back(std::to_string(painted.repeated) +
                                   " exposures were emitted more than once");

  const auto files = stages.run("images", [&](const Progress& progress) {
    const ReachTest is_reachable = [&](const SurfacePoint& point) {
      return reach.is_reachable(position(piece.mesh, point), face_normal(piece.mesh, point));
    };
    report.fidelity =
        measure_fidelity(film, *piece.tone, is_reachable, piece.settings.seed, progress.part(0, .5));
    return write_pictures(film, *piece.tone, positions_of_unexposed(work.dots, program), output,
                          progress.part(.5, 1));
  });
  for (const auto& file : files) report.files.push_back(std::filesystem::relative(file, output).string());
}

std::string save_report(Workpiece& piece, const Stages& stages, const std::filesystem::path& output) {
  piece.report.stages_s = stages.seconds();
  const std::string text = report_to_json(piece.report);
  write_text_file(output / "report.json", text);
  return text;
}

/// A record that was lost or damaged is the caller's input, no failure of the program.
std::vector<Emission> read_given_record(const std::filesystem::path& file) {
  try {
    return read_emission_record(file);
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    const std::string begin = file.string() + ": ";
    throw InputError(file.string(), text.starts_with(begin) ? text.substr(begin.size()) : text);
  }
}

ExposureProgram read_own_program(const Workpiece& piece, const std::filesystem::path& file) {
  ExposureProgram program = read_program(file);
  const std::string mismatch = provenance_mismatch(program.provenance, piece.provenance);
  if (!mismatch.empty())
    throw InputError(file.string(),
                     "was made for " + mismatch + "; it is not run or developed with this one");
  return program;
}

}  // namespace

std::string run_plan(const PipelineRequest& request, const PipelineListener& listener) {
  make_output_folder(request.output);
  Stages stages(listener);
  Workpiece piece(request, stages);
  const Reach reach(piece.mesh, piece.cell, plan_options(piece.settings));
  plan_work(piece, reach, request.output, stages);
  return save_report(piece, stages, request.output);
}

std::string run_dry_run(const PipelineRequest& request, const PipelineListener& listener) {
  make_output_folder(request.output);
  Stages stages(listener);
  Workpiece piece(request, stages);
  const Reach reach(piece.mesh, piece.cell, plan_options(piece.settings));
  const PlannedWork work = plan_work(piece, reach, request.output, stages);
  const auto emissions = stages.run("execute", [&](const Progress& progress) {
    return paint_in_simulation(work.plan.program, piece.cell, progress);
  });
  develop_and_judge(piece, reach, work, emissions, request.output, stages);
  return save_report(piece, stages, request.output);
}

std::string run_develop(const PipelineRequest& request, const std::filesystem::path& program_file,
                        const std::filesystem::path& emissions_file, const PipelineListener& listener) {
  make_output_folder(request.output);
  Stages stages(listener);
  Workpiece piece(request, stages);
  PlannedWork work;
  work.plan.program = read_own_program(piece, program_file);
  const DotCounts planned = dot_counts_from_report(program_file.parent_path() / "report.json");
  piece.report.skipped = skipped_figures_from_report(program_file.parent_path() / "report.json");
  const auto emissions = read_given_record(emissions_file);

  // Sampling is deterministic: placing the dots again, instead of reading them, completes the report of the
  // mesh too.
  work.dots = sample_dots(piece, stages);
  piece.report.dots = planned;
  piece.report.pitch_m = work.plan.program.pitch_m;
  piece.report.incidence = incidence_figures(work.plan.program);
  piece.report.motion = motion_figures(work.plan.program);
  piece.report.time = estimate_time(piece.cell, work.plan.program);
  piece.report.least_time_s = least_time_s(piece.cell, work.plan.program);
  piece.report.files = {"report.json"};
  const Reach reach(piece.mesh, piece.cell, plan_options(piece.settings));
  develop_and_judge(piece, reach, work, emissions, request.output, stages);
  return save_report(piece, stages, request.output);
}

std::vector<Joints> run_approach(const PipelineRequest& request, const std::filesystem::path& program_file,
                                 std::size_t next, const Joints& from) {
  const PipelineListener silent;
  Stages stages(silent);
  const Workpiece piece(request, stages);
  const ExposureProgram program = read_own_program(piece, program_file);
  if (next >= program.exposures.size())
    throw InputError("--next", "is " + std::to_string(next) + ", but the program has " +
                                   std::to_string(program.exposures.size()) + " exposures");
  const Reach reach(piece.mesh, piece.cell, plan_options(piece.settings));
  return plan_approach(reach, program, next, from);
}

std::vector<std::filesystem::path> run_files(const std::filesystem::path& model) {
  return load_model(model, load_image_file).files;
}

}  // namespace hilbrush
