#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "config/job_settings.h"
#include "planner/cell_model/cell_description.h"

/// Strings the stages together:
///   load_model -> place_on_table -> repair_mesh -> SurfaceCurve -> place_dots -> plan_exposures -> check_program
///   (plan)
///   -> execute on the simulated cell in virtual time -> Film -> fidelity, pictures (dry_run)
/// Each stage is one entry function of its folder, from a plain value to a plain value; nothing here edits a stage's
/// result.
namespace hilbrush {

/// What a run is about; the same for every command.
struct PipelineRequest {
  std::filesystem::path model;
  JobSettings settings;
  std::filesystem::path cell_file;
  std::filesystem::path output;  ///< folder; made if absent; nothing is written outside it
};

/// How a run talks while it works. Called from the running thread.
struct PipelineListener {
  /// Stages in order: load, disk, curve, dots, plan, check, paint, images.
  std::function<void(const char* stage, double fraction)> on_progress;
  std::function<void(const std::string& sentence)> on_warning;
};

/// Writes program.ply, dots.ply and report.json; returns the report's text.
/// @throws InputError for anything the model, settings, cell or output folder are to blame for;
///         std::logic_error if the finished program fails its independent check (the program is then not written).
std::string run_plan(const PipelineRequest& request, const PipelineListener& listener);

/// run_plan, then the program is run on the simulated cell in virtual time and developed: also exposure.png and views/.
std::string run_dry_run(const PipelineRequest& request, const PipelineListener& listener);

/// Develops what a simulated cell recorded while it ran `program`: pictures, and report.json with the true counts.
/// @throws InputError also if the program was made for another model, other settings or another cell.
std::string run_develop(const PipelineRequest& request, const std::filesystem::path& program,
                        const std::filesystem::path& emissions, const PipelineListener& listener);

/// The checked way from measured joints to exposure `next`: way-points, possibly none.
std::vector<Joints> run_approach(const PipelineRequest& request, const std::filesystem::path& program, std::size_t next,
                                 const Joints& from);

/// Paints gray wedges on the cell's simulated film, or takes the readings of a real one from `measured` (wedge.h;
/// empty: none); writes tone_curve.json (an entry for paint.tone_curves of the cell file) and returns its text.
std::string run_calibrate(const PipelineRequest& request, const std::filesystem::path& measured,
                          const PipelineListener& listener);

/// Writes what painting and measuring a real wedge needs (wedge.h): wedge.wrl, wedge.json, wedge_steps.json.
std::string run_wedge(const PipelineRequest& request);

/// Every file that reading the model reads: the model, inlines, material files, images.
std::vector<std::filesystem::path> run_files(const std::filesystem::path& model);

}  // namespace hilbrush
