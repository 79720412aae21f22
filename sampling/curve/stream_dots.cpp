#include "sampling/curve/stream_dots.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/curve/chart.h"
#include "sampling/curve/dot_block.h"

namespace hilbrush {
namespace {

/// Dots are made in blocks whose size depends on nothing but their number, so that the result does not depend
/// on the threads.
constexpr std::uint64_t kMaxDotsInBlock = 4096;
constexpr std::uint64_t kMinDotsInBlock = 128;
constexpr std::uint64_t kMinBlocks = 64;
/// This many blocks are made at once, while the visitor has as many.
constexpr std::uint64_t kBlocksAtOnce = 32;

/// A report on the curve as a whole, before its dots.
SampleReport report_areas(const CurveMass& mass) {
  const SurfaceCurve& curve = mass.curve();
  SampleReport report;
  report.components.resize(curve.components().size());
  for (std::size_t c = 0; c < curve.charts().size(); ++c) {
    report.painted_area_m2 += mass.painted_area_m2(c);
    report.components[curve.charts()[c].component].painted_area_m2 += mass.painted_area_m2(c);
  }
  return report;
}

void count_patches(SampleReport& report, const DotBlock& block) {
  auto& depths = report.patches_at_depth;
  depths.resize(std::max(depths.size(), block.patches_at_depth.size()));
  for (std::size_t depth = 0; depth < block.patches_at_depth.size(); ++depth) {
    depths[depth] += block.patches_at_depth[depth];
    report.patch_count += block.patches_at_depth[depth];
  }
}

/// Makes blocks in parallel, a batch at a time; while the caller has one batch the next is made.
class BlockStream {
 public:
  explicit BlockStream(const DotPlan& plan)
      : plan_(plan),
        makers_([&plan] { return BlockMaker(plan); }),
        block_size_(std::clamp(plan.strata.count / kMinBlocks, kMinDotsInBlock, kMaxDotsInBlock)),
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
      if (begin + kBlocksAtOnce < block_count_)
        waiter.group.run([&] { make_batch(begin + kBlocksAtOnce, next_); });
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
  std::uint64_t block_size_;
  std::uint64_t block_count_;
  std::vector<DotBlock> ready_;  ///< its memory and that of next_ is used again
  std::vector<DotBlock> next_;
};

}  // namespace

std::uint64_t count_dots(const CurveMass& curve_mass, const SampleOptions& options) {
  check_pitch_or_count(options);
  const double mass = curve_mass.total_m2();
  if (!(mass > 0)) {
    if (options.dot_count)
      throw InputError("",
                       "the surface asks for no dots at all: it is blank, white or transparent everywhere");
    return 0;
  }
  const double count = options.pitch_m
                           ? std::max(1., std::round(mass / (*options.pitch_m * *options.pitch_m)))
                           : static_cast<double>(*options.dot_count);
  check_dot_limit(options, count);
  return static_cast<std::uint64_t>(count);
}

double pitch_of(const CurveMass& mass, const SampleOptions& options, std::uint64_t count) {
  return options.pitch_m.value_or(std::sqrt(mass.total_m2() / static_cast<double>(count)));
}

void stream_dots(const CurveMass& mass, const SampleOptions& options, const DotVisitor& visit,
                 SampleReport* report, const Progress& progress) {
  CHECK(options.sampler != Sampler::kBlue);
  const std::uint64_t count = count_dots(mass, options);
  SampleReport figures = report_areas(mass);
  PathMeter meter(figures);
  if (count > 0) {
    const DotPlan plan(mass, options, count);
    BlockStream(plan).run([&](const DotBlock& block, std::uint64_t done) {
      meter.follow(block.dots);
      count_patches(figures, block);
      visit(block.dots);
      progress.step(done, count);
    });
  }
  meter.finish();
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
      [&](std::span<const Dot> dots) { sequence.dots.insert(sequence.dots.end(), dots.begin(), dots.end()); },
      report, progress);
  return sequence;
}

}  // namespace hilbrush
