#include "sampling/curve/stream_dots.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cmath>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/blue/blue.h"
#include "sampling/curve/curve_mass.h"
#include "sampling/curve/dot_block.h"

namespace hilbrush {
namespace {

/// Dots are made in blocks whose size depends on nothing but their number, so that the result does not depend on the
/// threads.
constexpr std::uint64_t kMaxDotsInBlock = 4096, kMinDotsInBlock = 128, kBlocksAtLeast = 64;
/// So many blocks are made at once, while the visitor has as many.
constexpr std::uint64_t kBlocksAtOnce = 32;

/// Follows the dots for the report.
class PathMeter {
 public:
  PathMeter(const CurveMass::Implementation& mass, SampleReport& report) : mass_(mass), report_(report) {
    report_ = {};
    report_.components.resize(mass.curve.components.size());
  }

  void follow(const DotBlock& block) {
    for (const Dot& dot : block.dots) {
      ComponentPath& component = report_.components[dot.component];
      ++component.dot_count;
      if (has_last_) {
        const double step = (dot.position_O - last_O_).norm();
        report_.path_length_m += step;
        if (dot.component == last_component_) component.path_length_m += step;
      }
      last_O_ = dot.position_O;
      last_component_ = dot.component;
      has_last_ = true;
    }
    auto& depths = report_.patches_at_depth;
    depths.resize(std::max(depths.size(), block.patches_at_depth.size()));
    for (std::size_t depth = 0; depth < block.patches_at_depth.size(); ++depth) {
      depths[depth] += block.patches_at_depth[depth];
      report_.patch_count += block.patches_at_depth[depth];
    }
  }

  void finish(std::uint64_t count) {
    for (std::size_t s = 0; s < mass_.curve.charts.size(); ++s) {
      report_.painted_area_m2 += mass_.painted_area_m2[s];
      report_.components[mass_.curve.charts[s].component].painted_area_m2 += mass_.painted_area_m2[s];
    }
    if (count > 1) report_.path_constant = constant(report_.path_length_m, count, report_.painted_area_m2);
    for (ComponentPath& component : report_.components)
      if (component.dot_count > 1)
        component.path_constant = constant(component.path_length_m, component.dot_count, component.painted_area_m2);
  }

 private:
  static double constant(double length, std::uint64_t count, double area) {
    return area > 0 ? length / std::sqrt(static_cast<double>(count) * area) : 0;
  }

  const CurveMass::Implementation& mass_;
  SampleReport& report_;
  Eigen::Vector3d last_O_ = Eigen::Vector3d::Zero();
  std::uint32_t last_component_ = 0;
  bool has_last_ = false;
};

/// Makes blocks in parallel, a batch at a time; while the caller has one batch the next is made.
class BlockStream {
 public:
  explicit BlockStream(const DotPlan& plan)
      : plan_(plan),
        makers_([&plan] { return BlockMaker(plan); }),
        block_size_(std::clamp(plan.strata.count / kBlocksAtLeast, kMinDotsInBlock, kMaxDotsInBlock)),
        block_count_((plan.strata.count + block_size_ - 1) / block_size_) {}

  template <class Visit>
  void run(Visit visit) {
    make_batch(0, ready_);
    for (std::uint64_t begin = 0; begin < block_count_; begin += kBlocksAtOnce) {
      // Should the visitor throw, the batch under way is waited for.
      struct Waiter {
        tbb::task_group group;
        ~Waiter() { group.wait(); }
      } waiter;
      if (begin + kBlocksAtOnce < block_count_) waiter.group.run([&] { make_batch(begin + kBlocksAtOnce, next_); });
      for (std::size_t i = 0; i < blocks_from(begin); ++i)
        visit(ready_[i], std::min(plan_.strata.count, (begin + i + 1) * block_size_));
      waiter.group.wait();
      std::swap(ready_, next_);
    }
  }

 private:
  std::size_t blocks_from(std::uint64_t begin) const { return std::min(kBlocksAtOnce, block_count_ - begin); }

  void make_batch(std::uint64_t begin, std::vector<DotBlock>& blocks) {
    blocks.resize(kBlocksAtOnce);
    tbb::parallel_for(
        std::size_t{0}, blocks_from(begin),
        [&](std::size_t i) {
          const std::uint64_t first = (begin + i) * block_size_;
          makers_.local().make(first, std::min(first + block_size_, plan_.strata.count), blocks[i]);
        },
        tbb::simple_partitioner());
  }

  const DotPlan& plan_;
  tbb::enumerable_thread_specific<BlockMaker> makers_;
  std::uint64_t block_size_, block_count_;
  std::vector<DotBlock> ready_, next_;  ///< what they take is used again
};

}  // namespace

std::uint64_t count_dots(const CurveMass& curve_mass, const SampleOptions& options) {
  const double mass = curve_mass.total_m2();
  if (options.pitch_m.has_value() == options.dot_count.has_value())
    throw InputError("", "give either dpi or the number of dots, not both and not neither");
  if (!(mass > 0)) {
    if (options.dot_count)
      throw InputError("", "the surface asks for no dots at all: it is blank, white or transparent everywhere");
    return 0;
  }
  double count = 0;
  if (options.pitch_m) {
    if (!(*options.pitch_m > 0) || !std::isfinite(*options.pitch_m))
      throw InputError("", "the pitch must be more than 0 mm");
    count = std::max(1., std::round(mass / (*options.pitch_m * *options.pitch_m)));
  } else {
    count = static_cast<double>(*options.dot_count);
    if (count < 1) throw InputError("", "the number of dots must be at least 1");
  }
  if (count > static_cast<double>(options.dot_limit))
    throw InputError("", "the object would need " + std::to_string(static_cast<std::uint64_t>(std::min(count, 1e18))) +
                             " dots, more than the limit of " + std::to_string(options.dot_limit) +
                             ": lower the dpi or the size");
  return static_cast<std::uint64_t>(count);
}

double pitch_of(const CurveMass& mass, const SampleOptions& options, std::uint64_t count) {
  return options.pitch_m.value_or(std::sqrt(mass.total_m2() / static_cast<double>(count)));
}

void stream_dots(const CurveMass& mass, const SampleOptions& options, const DotVisitor& visit, SampleReport* report,
                 const Progress& progress) {
  CHECK(options.sampler != Sampler::kBlue);
  const std::uint64_t count = count_dots(mass, options);
  SampleReport figures;
  PathMeter meter(mass.implementation(), figures);
  if (count > 0) {
    const DotPlan plan(mass.implementation(), options, count);
    BlockStream(plan).run([&](const DotBlock& block, std::uint64_t done) {
      meter.follow(block);
      visit(block.dots);
      progress.step(done, count);
    });
  }
  meter.finish(count);
  if (report) *report = std::move(figures);
}

DotSequence place_dots(const CurveMass& mass, const SampleOptions& options, SampleReport* report,
                       const Progress& progress) {
  DotSequence sequence;
  const std::uint64_t count = count_dots(mass, options);
  sequence.pitch_m = pitch_of(mass, options, count);
  sequence.dots.reserve(count);
  stream_dots(
      mass, options,
      [&](std::span<const Dot> dots) { sequence.dots.insert(sequence.dots.end(), dots.begin(), dots.end()); }, report,
      progress);
  return sequence;
}

DotSequence place_dots(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report, const Progress& progress) {
  if (options.sampler == Sampler::kBlue) return place_blue(curve, tone, options, report, progress);
  return place_dots(CurveMass(curve, tone), options, report, progress);
}

}  // namespace hilbrush
