#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "config/job_settings.h"
#include "planner/cell_model/cell_description.h"

/// Runs the stages one after another:
///   load_model -> place_on_table -> repair_mesh -> SurfaceCurve -> place_dots -> plan_exposures ->
///   check_program (plan)
///   -> execute on the simulated cell in virtual time -> Film -> fidelity, pictures (dry_run)
/// Each stage is the entry function of its folder, from a plain value to a plain value; nothing here changes
/// the result of a stage.
namespace hilbrush {

/// The input of a run; the same for every command.
struct PipelineRequest {
  std::filesystem::path model;
  JobSettings settings;
  std::filesystem::path cell_file;
  std::filesystem::path output;  ///< folder, made if absent; nothing is written outside it
};

/// Progress and warnings of a run. Called from the running thread.
struct PipelineListener {
  /// Stages in order: load, disk, curve, dots, plan, check, paint, images.
  std::function<void(const char* stage, double fraction)> on_progress;
  std::function<void(const std::string& sentence)> on_warning;
};

/// Writes program.ply, dots.ply and report.json; returns the text of the report.
/// @throws InputError for a fault of model, settings, cell or output folder;
///         std::logic_error if the finished program fails its independent check (then it is not written).
std::string run_plan(const PipelineRequest& request, const PipelineListener& listener);

/// run_plan(), then runs the program on the simulated cell in virtual time and develops the film: writes also
/// exposure.png and views/.
std::string run_dry_run(const PipelineRequest& request, const PipelineListener& listener);

/// Develops the film from the emissions that a simulated cell recorded while it ran `program`: writes
/// pictures, and report.json with the true counts.
/// @throws InputError also if the program was made for another model, other settings or another cell.
std::string run_develop(const PipelineRequest& request, const std::filesystem::path& program,
                        const std::filesystem::path& emissions, const PipelineListener& listener);

/// The checked way from measured joints to exposure `next`: way-points, possibly none.
std::vector<Joints> run_approach(const PipelineRequest& request, const std::filesystem::path& program,
                                 std::size_t next, const Joints& from);

/// Makes a tone curve from gray wedges on the simulated film of the cell, or from the readings of a real one
/// in `measured` (wedge.h; empty: none). Writes tone_curve.json, an entry for paint.tone_curves of the cell
/// file, and returns its text.
std::string run_calibrate(const PipelineRequest& request, const std::filesystem::path& measured,
                          const PipelineListener& listener);

/// Writes the files for painting and measuring a real wedge (wedge.h): wedge.wrl, wedge.json,
/// wedge_steps.json.
std::string run_wedge(const PipelineRequest& request);

/// All files that the model is read from: the model itself, inlines, material files, images.
std::vector<std::filesystem::path> run_files(const std::filesystem::path& model);

}  // namespace hilbrush
