// Painting time, incidence and planning cost of the baselines and of every planning mode, for the same number
// of dots and by the same code: dots differ by sampler and curve, plans by PlanOptions, and every program
// passes the same check.
//   plan_bench [--confirm N] MODEL SIZE_MM DOTS [ROW...]
//       rows: laminar space curve thesis fast balanced quality; all unless named. N of
//       the skipped dots of each row are tried by brute force on a grid of poses one degree apart.
//   plan_bench --trade MODEL SIZE_MM DOTS
//       painting time over incidence, by preferred incidence and planning
// Floor: the least possible painting time, as each exposure takes the shortest settling, its pulse and a move
// of one control tick. The shares of steps that take one, two or more ticks show what exceeds it.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "planner/cell_model/time_model.h"
#include "planner/check/program_check.h"
#include "planner/plan.h"
#include "planner/poses/posed_dots.h"
#include "sampling/base/angles.h"
#include "sampling/images/image_file.h"
#include "sampling/laminar/laminar.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"
#include "tests/bench/answer_hash.h"
#include "tests/bench/process_usage.h"
#include "tests/planner/reach/pose_grid.h"

namespace {

using namespace hilbrush;

struct Row {
  const char* name;
  Sampler sampler;
  CurveKind curve;
  PlanOptions options;
  bool is_in_space =
      false;  ///< dots in the order of a Hilbert curve through space instead of the surface's own
};

const std::vector<Row>& rows() {
  static const PlanOptions follow{.policy = PosePolicy::kFollowNormal};
  static const std::vector<Row> all{
      {"laminar", Sampler::kCentroid, CurveKind::kLaminar, follow},
      {"space", Sampler::kCentroid, CurveKind::kHilbert, follow, true},
      {"curve", Sampler::kCentroid, CurveKind::kHilbert, follow},
      {"thesis", Sampler::kJittered, CurveKind::kHilbert, follow},
      {"fast", Sampler::kCentroid, CurveKind::kHilbert, {.planning = Planning::kFast}},
      {"balanced", Sampler::kCentroid, CurveKind::kHilbert, {.planning = Planning::kBalanced}},
      {"quality", Sampler::kCentroid, CurveKind::kHilbert, {.planning = Planning::kQuality}},
  };
  return all;
}

/// Place on the Hilbert curve through the unit cube, ten levels (Skilling 2004, transposed axes to bits).
std::uint64_t place_in_space(const Eigen::Vector3d& p) {
  constexpr int kLevels = 10;
  std::array<std::uint32_t, 3> x;
  for (std::size_t i = 0; i < 3; ++i)
    x[i] =
        static_cast<std::uint32_t>(std::clamp(p[static_cast<Eigen::Index>(i)], 0., .999999) * (1 << kLevels));
  for (std::uint32_t q = 1U << (kLevels - 1); q > 1; q >>= 1)
    for (std::size_t i = 0; i < 3; ++i) {
      if (x[i] & q) {
        x[0] ^= q - 1;
      } else {
        const std::uint32_t t = (x[0] ^ x[i]) & (q - 1);
        x[0] ^= t;
        x[i] ^= t;
      }
    }
  for (std::size_t i = 1; i < 3; ++i) x[i] ^= x[i - 1];
  std::uint32_t t = 0;
  for (std::uint32_t q = 1U << (kLevels - 1); q > 1; q >>= 1)
    if (x[2] & q) t ^= q - 1;
  for (auto& axis : x) axis ^= t;
  std::uint64_t place = 0;
  for (int level = kLevels - 1; level >= 0; --level)
    for (const std::uint32_t axis : x) place = place << 1 | (axis >> level & 1);
  return place;
}

void sort_in_space(DotSequence& dots) {
  Eigen::AlignedBox3d box;
  for (const Dot& dot : dots.dots) box.extend(dot.position_O);
  const double size_m = box.sizes().maxCoeff();
  std::stable_sort(dots.dots.begin(), dots.dots.end(), [&](const Dot& a, const Dot& b) {
    return place_in_space((a.position_O - box.min()) / size_m) <
           place_in_space((b.position_O - box.min()) / size_m);
  });
}

struct Bench {
  Bench(const std::string& model, double size_mm)
      : cell(load_cell(find_cell("default"))), mesh(placed(model, size_mm)), curve(mesh) {}

  static TexturedMesh placed(const std::string& model, double size_mm) {
    PlacementOptions placement;
    placement.size_m = size_mm * 1e-3;
    return repair_mesh(place_on_table(load_model(model, load_image_file), placement)).mesh;
  }
  DotSequence dots(const Row& row, std::uint64_t count) const {
    const ToneField tone(mesh, cell_tone(cell, {.sampler = sampler_name(row.sampler)}).options);
    SampleOptions options;
    options.dot_count = count;
    options.sampler = row.sampler;
    if (row.curve == CurveKind::kLaminar) return place_laminar(mesh, tone, options);
    DotSequence placed = place_dots(curve, tone, options);
    if (row.is_in_space) sort_in_space(placed);
    return placed;
  }
  void run(const Row& row, std::uint64_t count) const;
  void explain_skipped(const Plan& plan, const DotSequence& dots, const Reach& reach) const;

  std::size_t confirmed_by_brute_force = 0;  ///< of the skipped dots
  CellDescription cell;
  TexturedMesh mesh;
  SurfaceCurve curve;
};

struct Incidence {
  double mean = 0, p95 = 0, max = 0;
};

Incidence incidence_of(const ExposureProgram& program) {
  std::vector<float> all;
  double sum = 0;
  for (const Exposure& exposure : program.exposures) {
    all.push_back(exposure.incidence);
    sum += static_cast<double>(exposure.incidence);
  }
  if (all.empty()) return {};
  std::sort(all.begin(), all.end());
  return {sum / static_cast<double>(all.size()) / kDegree,
          static_cast<double>(all[(all.size() - 1) * 95 / 100]) / kDegree,
          static_cast<double>(all.back()) / kDegree};
}

struct Steps {
  std::array<std::size_t, 3> by_ticks{};  ///< one, two, more
  std::size_t table_moves = 0;

  double percent(std::size_t ticks) const {
    return 100. * static_cast<double>(by_ticks[ticks]) /
           static_cast<double>(std::max<std::size_t>(1, by_ticks[0] + by_ticks[1] + by_ticks[2]));
  }
};

Steps steps_of(const CellDescription& cell, const ExposureProgram& program) {
  Steps steps;
  for (std::size_t i = 1; i < program.exposures.size(); ++i) {
    const Joints &from = program.exposures[i - 1].joints, &to = program.exposures[i].joints;
    if (from[kTilt] != to[kTilt] || from[kRotation] != to[kRotation]) ++steps.table_moves;
    const auto ticks = static_cast<std::size_t>(std::lround(move_s(cell, from, to) / cell.timing.tick_s));
    ++steps.by_ticks[std::clamp<std::size_t>(ticks, 1, 3) - 1];
  }
  return steps;
}

/// Reasons, and whether a fine grid of poses agrees that there is none.
void Bench::explain_skipped(const Plan& plan, const DotSequence& dots, const Reach& reach) const {
  std::map<std::string, std::size_t> reasons;
  std::vector<std::uint32_t> out_of_reach;
  for (const SkippedDot& skipped : plan.skipped) {
    ++reasons[std::string(skipped.what)];
    if (skipped.reason != SkipReason::kEnergy && skipped.reason != SkipReason::kNoPath)
      out_of_reach.push_back(skipped.dot_index);
  }
  for (const auto& [what, times] : reasons) std::printf("  skipped: %zu, %s\n", times, what.c_str());
  const std::size_t looks = std::min(confirmed_by_brute_force, out_of_reach.size());
  std::size_t confirmed = 0;
  for (std::size_t k = 0; k < looks; ++k) {
    const std::uint32_t dot = out_of_reach[k * out_of_reach.size() / looks];
    const PoseGridAnswer answer = search_pose_grid(reach, target_of(dots.dots[dot]), kDegree);
    confirmed += !answer.is_reached;
    if (answer.is_reached) std::printf("  dot %u can be reached after all\n", dot);
  }
  if (looks > 0) std::printf("  brute force: %zu of %zu skipped dots confirmed\n", confirmed, looks);
}

void Bench::run(const Row& row, std::uint64_t count) const {
  const DotSequence dot_sequence = dots(row, count);
  const Reach reach(mesh, cell, row.options);
  const auto begin = std::chrono::steady_clock::now();
  const double begin_cpu_s = cpu_s();
  const Plan plan = plan_exposures(reach, dot_sequence);
  const double plan_cpu_s = cpu_s() - begin_cpu_s;
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const auto faults = check_program(plan.program, plan.skipped, dot_sequence, mesh, cell, row.options);
  AnswerHash hash;
  for (const Exposure& exposure : plan.program.exposures)
    for (const double joint : exposure.joints) hash.take(joint);
  const Steps steps = steps_of(cell, plan.program);
  const Incidence incidence = incidence_of(plan.program);
  std::printf(
      "%-9s %8zu %7zu %9.0f %9.0f %6.2f | %6.0f %6.0f %6.0f %6.0f | %4.0f %4.0f %4.0f | %5.1f %5.1f %5.1f | "
      "%6zu %6zu "
      "| %7.2f %7.2f %6.0f %4zu %016llx\n",
      row.name, dot_sequence.dots.size(), plan.skipped.size(), plan.time.total_s(),
      least_time_s(cell, plan.program),
      1e3 * plan.time.total_s() /
          static_cast<double>(std::max<std::size_t>(1, plan.program.exposures.size())),
      plan.time.move_s, plan.time.settle_s, plan.time.expose_s, plan.time.retract_s, steps.percent(0),
      steps.percent(1), steps.percent(2), incidence.mean, incidence.p95, incidence.max, steps.table_moves,
      plan.program.vias.size(), plan_cpu_s, wall_s, peak_mb(), faults.size(), hash.value());
  for (std::size_t i = 0; i < std::min<std::size_t>(faults.size(), 3); ++i)
    std::printf("  fault at %zu: %s\n", faults[i].exposure, faults[i].what.c_str());
  explain_skipped(plan, dot_sequence, reach);
  std::fflush(stdout);
}

void print_heads() {
  std::printf(
      "%-9s %8s %7s %9s %9s %6s | %6s %6s %6s %6s | %4s %4s %4s | %5s %5s %5s | %6s %6s | %7s %7s %6s %4s "
      "%s\n",
      "row", "dots", "skipped", "painting", "floor", "ms/dot", "move", "settle", "expose", "retrct", "1t%",
      "2t%", "3t%", "mean", "p95", "max", "table", "vias", "CPU s", "wall s", "MB", "bad", "answer");
}

void trade(const Bench& bench, std::uint64_t count) {
  for (const double preferred_deg : {5., 10., 15., 20., 25., 30.})
    for (Row row : rows()) {
      if (row.options.policy == PosePolicy::kFollowNormal) continue;
      row.options.preferred_incidence = preferred_deg * kDegree;
      std::printf("%2.0f ", preferred_deg);
      bench.run(row, count);
    }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  const bool is_trade = !arguments.empty() && arguments[0] == "--trade";
  if (is_trade) arguments.erase(arguments.begin());
  std::size_t confirmed = 0;
  if (arguments.size() > 1 && arguments[0] == "--confirm") {
    confirmed = static_cast<std::size_t>(std::atoll(arguments[1].c_str()));
    arguments.erase(arguments.begin(), arguments.begin() + 2);
  }
  if (arguments.size() < 3) {
    std::fprintf(stderr, "usage: plan_bench [--trade | --confirm N] MODEL SIZE_MM DOTS [ROW...]\n");
    return 2;
  }
  try {
    Bench bench(arguments[0], std::stod(arguments[1]));
    bench.confirmed_by_brute_force = confirmed;
    const std::uint64_t count = std::stoull(arguments[2]);
    const std::vector<std::string> wanted(arguments.begin() + 3, arguments.end());
    print_heads();
    if (is_trade) {
      trade(bench, count);
      return 0;
    }
    for (const Row& row : rows())
      if (wanted.empty() || std::find(wanted.begin(), wanted.end(), row.name) != wanted.end())
        bench.run(row, count);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plan_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
