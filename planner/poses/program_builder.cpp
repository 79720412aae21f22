#include "planner/poses/program_builder.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "planner/cell_model/dose.h"
#include "planner/reach/transit.h"
#include "sampling/base/check.h"

namespace hilbrush {
namespace {

constexpr std::size_t kWayBlock = 8192;  // dots whose ways are looked for at once

constexpr std::size_t kSearchesFailed = 30;
constexpr const char* kNoWay = "no clear way leads to a pose for it";
constexpr const char* kNoWayOut = "the arm would touch something at home already";
constexpr const char* kNoWayBack = "no clear way leads back from it";

using Way = std::optional<std::vector<Joints>>;

class ProgramBuilder {
 public:
  ProgramBuilder(const Reach::Implementation& reach, const DotSequence& dots, Plan& plan)
      : reach_(reach), dots_(dots), plan_(plan), transit_(reach), now_(home_joints(reach.cell)) {
    add_via(now_);
  }

  /// Dots that nothing leads to from their predecessor are set aside.
  void add_block(const PosedDot* posed, std::size_t count) {
    std::vector<Way> ways(count);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 64), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i)
        ways[i] = transit_.route(i == 0 ? now_ : posed[i - 1].joints, posed[i].joints);
    });
    bool is_as_foreseen = true;  // the arm is where ways[i] begins
    for (std::size_t i = 0; i < count; ++i) {
      const Way way = is_as_foreseen ? std::move(ways[i]) : transit_.route(now_, posed[i].joints);
      is_as_foreseen = way.has_value();
      if (way)
        expose(posed[i], *way);
      else
        stranded_.push_back(posed[i]);
    }
  }

  /// Another attempt for what was set aside: from where the arm is then, or in another pose.
  void add_stranded() {
    const std::vector<PosedDot> stranded = std::move(stranded_);
    stranded_.clear();
    std::size_t failures = 0;
    const bool is_home_clear = transit_.is_clear_at(home_joints(reach_.cell));
    const char* const why = is_home_clear ? kNoWay : kNoWayOut;
    for (const PosedDot& posed : stranded) {
      // Where dots are stranded by the thousand, searching for each of them would take hours.
      const auto way_to = [&](const Joints& joints) {
        return is_home_clear && failures < kSearchesFailed ? transit_.route_by_search(now_, joints)
                                                           : transit_.route(now_, joints);
      };
      if (const Way way = way_to(posed.joints)) {
        expose(posed, *way);
        continue;
      }
      const auto pose = reach_.find_pose(target_of(dots_.dots[posed.dot_index]), now_);
      const Way way = pose ? way_to(pose->joints) : std::nullopt;
      if (way) {
        expose({posed.dot_index, pose->joints}, *way);
      } else {
        ++failures;
        plan_.skipped.push_back({posed.dot_index, SkipReason::kNoWay, why, why});
      }
    }
  }

  /// A dot from which no way leads home is not gone to.
  void go_home() {
    const Joints home = home_joints(reach_.cell);
    std::vector<Exposure>& exposures = plan_.program.exposures;
    std::vector<Via>& vias = plan_.program.vias;
    while (!exposures.empty()) {
      if (const Way way = transit_.route_by_search(now_, home)) {
        for (const Joints& via : *way) add_via(via);
        break;
      }
      plan_.skipped.push_back({exposures.back().dot_index, SkipReason::kNoWay, kNoWayBack, kNoWayBack});
      exposures.pop_back();
      while (vias.size() > 1 && vias.back().before_exposure == exposures.size()) vias.pop_back();
      now_ = exposures.empty() ? home : exposures.back().joints;
    }
    add_via(home);
  }

 private:
  void add_via(const Joints& joints) {
    plan_.program.vias.push_back({static_cast<std::uint32_t>(plan_.program.exposures.size()), joints});
  }

  void expose(const PosedDot& posed, const std::vector<Joints>& way) {
    const Dot& dot = dots_.dots[posed.dot_index];
    Dose dose;
    std::string refusal;
    CHECK(find_dose(reach_.cell, dots_.pitch_m, dot.level, dose, refusal));  // dots that fail this got no pose
    for (const Joints& via : way) add_via(via);
    const Eigen::Vector3d beam_O = reach_.kinematics.tool_pose(posed.joints).beam_O;
    Exposure exposure;
    exposure.position_O = dot.position_O;
    exposure.normal_O = dot.normal_O;
    exposure.tone = dot.tone;
    exposure.energy_j = dose.energy_j;
    exposure.power_w = dose.power_w;
    exposure.pulse_s = dose.pulse_s;
    exposure.joints = posed.joints;
    exposure.incidence =
        static_cast<float>(std::acos(std::clamp(-beam_O.dot(dot.normal_O.cast<double>().normalized()), -1., 1.)));
    exposure.dot_index = posed.dot_index;
    plan_.program.exposures.push_back(exposure);
    now_ = posed.joints;
  }

  const Reach::Implementation& reach_;
  const DotSequence& dots_;
  Plan& plan_;
  Transit transit_;
  Joints now_;
  std::vector<PosedDot> stranded_;
};

}  // namespace

void build_program(const Reach::Implementation& reach, const DotSequence& dots, const PosedDots& posed, Plan& plan,
                   const Progress& progress) {
  const std::size_t count = posed.sequence.size();
  plan.program.exposures.reserve(count);
  ProgramBuilder builder(reach, dots, plan);
  for (std::size_t first = 0; first < count; first += kWayBlock) {
    builder.add_block(posed.sequence.data() + first, std::min(kWayBlock, count - first));
    progress.step(std::min(count, first + kWayBlock), count);
  }
  builder.add_stranded();
  builder.go_home();
}

}  // namespace hilbrush
