#include "planner/poses/program_builder.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "planner/cell_model/dose.h"
#include "planner/reach/transit.h"
#include "sampling/base/batches.h"
#include "sampling/base/check.h"

namespace hilbrush {
namespace {

constexpr std::size_t kPathBlock = 8192;  // dots whose paths are searched together

constexpr std::size_t kMaxFailedSearches = 30;
constexpr const char* kNoPathTo = "no clear path leads to a pose for it";
constexpr const char* kNoPathFromHome = "the arm would touch something already at home";
constexpr const char* kNoPathBack = "no clear path leads back from it";

using Path = std::optional<std::vector<Joints>>;

class ProgramBuilder {
 public:
  ProgramBuilder(const Reach& reach, const DotSequence& dots, ExposureProgram& program,
                 std::vector<SkippedDot>& skipped)
      : reach_(reach),
        dots_(dots),
        program_(program),
        skipped_(skipped),
        transit_(reach),
        now_(home_joints(reach.cell())) {
    add_via(now_);
  }

  /// Dots that no path leads to from their predecessor are set aside.
  void add_block(const PosedDot* posed, std::size_t count) {
    std::vector<Path> paths(count);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 64), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i)
        paths[i] = transit_.route(i == 0 ? now_ : posed[i - 1].joints, posed[i].joints);
    });
    bool is_as_foreseen = true;  // the arm is where paths[i] begins
    for (std::size_t i = 0; i < count; ++i) {
      const Path path = is_as_foreseen ? std::move(paths[i]) : transit_.route(now_, posed[i].joints);
      is_as_foreseen = path.has_value();
      if (path)
        expose(posed[i], *path);
      else
        stranded_.push_back(posed[i]);
    }
  }

  /// Another attempt for what was set aside: from where the arm is then, or in another pose.
  void add_stranded() {
    const std::vector<PosedDot> stranded = std::move(stranded_);
    stranded_.clear();
    std::size_t failures = 0;
    const bool is_home_clear = transit_.is_clear_at(home_joints(reach_.cell()));
    const char* const why = is_home_clear ? kNoPathTo : kNoPathFromHome;
    for (const PosedDot& posed : stranded) {
      // Where dots are stranded by the thousand, searching for each of them would take hours.
      const auto path_to = [&](const Joints& joints) {
        return is_home_clear && failures < kMaxFailedSearches ? transit_.route_by_search(now_, joints)
                                                              : transit_.route(now_, joints);
      };
      if (const Path path = path_to(posed.joints)) {
        expose(posed, *path);
        continue;
      }
      const auto pose = reach_.find_pose(target_of(dots_.dots[posed.dot_index]), now_).pose;
      const Path path = pose ? path_to(pose->joints) : std::nullopt;
      if (path) {
        expose({posed.dot_index, pose->joints}, *path);
      } else {
        ++failures;
        skipped_.push_back({posed.dot_index, SkipReason::kNoPath, why, why});
      }
    }
  }

  /// Dots at the end of the program from which no path leads home are skipped.
  void go_home() {
    const Joints home = home_joints(reach_.cell());
    std::vector<Exposure>& exposures = program_.exposures;
    std::vector<Via>& vias = program_.vias;
    while (!exposures.empty()) {
      if (const Path path = transit_.route_by_search(now_, home)) {
        for (const Joints& via : *path) add_via(via);
        break;
      }
      skipped_.push_back({exposures.back().dot_index, SkipReason::kNoPath, kNoPathBack, kNoPathBack});
      exposures.pop_back();
      while (vias.size() > 1 && vias.back().before_exposure == exposures.size()) vias.pop_back();
      now_ = exposures.empty() ? home : exposures.back().joints;
    }
    add_via(home);
  }

 private:
  void add_via(const Joints& joints) {
    program_.vias.push_back({static_cast<std::uint32_t>(program_.exposures.size()), joints});
  }

  void expose(const PosedDot& posed, const std::vector<Joints>& path) {
    const Dot& dot = dots_.dots[posed.dot_index];
    const auto dose = find_dose(reach_.cell(), dots_.pitch_m, dot.level).dose;
    CHECK(dose.has_value());  // dots without a dose got no pose
    for (const Joints& via : path) add_via(via);
    const Eigen::Vector3d beam_O = reach_.kinematics().tool_pose(posed.joints).beam_O;
    Exposure exposure;
    exposure.position_O = dot.position_O;
    exposure.normal_O = dot.normal_O;
    exposure.tone = dot.tone;
    exposure.energy_j = dose->energy_j;
    exposure.power_w = dose->power_w;
    exposure.pulse_s = dose->pulse_s;
    exposure.joints = posed.joints;
    exposure.incidence = static_cast<float>(
        std::acos(std::clamp(-beam_O.dot(dot.normal_O.cast<double>().normalized()), -1., 1.)));
    exposure.dot_index = posed.dot_index;
    program_.exposures.push_back(exposure);
    now_ = posed.joints;
  }

  const Reach& reach_;
  const DotSequence& dots_;
  ExposureProgram& program_;
  std::vector<SkippedDot>& skipped_;
  Transit transit_;
  Joints now_;
  std::vector<PosedDot> stranded_;
};

}  // namespace

void build_program(const Reach& reach, const DotSequence& dots, const PosedDots& posed,
                   ExposureProgram& program, std::vector<SkippedDot>& skipped, const Progress& progress) {
  const std::size_t count = posed.sequence.size();
  program.exposures.reserve(count);
  ProgramBuilder builder(reach, dots, program, skipped);
  for_batches(count, kPathBlock, progress, [&](std::size_t begin, std::size_t end) {
    builder.add_block(posed.sequence.data() + begin, end - begin);
  });
  builder.add_stranded();
  builder.go_home();
}

}  // namespace hilbrush
