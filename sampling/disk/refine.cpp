#include "sampling/disk/refine.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

namespace hilbrush {
namespace {

/// Rounding makes angles of rectangles sum to a little more than 180 degrees.
constexpr double kMinExcess = 1e-6;
/// No edge is split nearer to its ends than this share of it ...
constexpr double kMinToEnd = .05;
/// ... nor if it is shorter than this share of a mean face's side.
constexpr double kMinSplitLength = .01;
/// Sine over cosine of an angle that counts as 180 degrees.
constexpr double kMinSine = 1e-6;
/// In units of the whole area. A less urgent edge is not split: it changes the map too little.
constexpr double kMinUrgency = 1e-4;
/// Weights worse than this count as this, so that length decides between needles.
constexpr double kMaxDeficit = 10;

/// A queue of the sides whose `urgency` is above 0, most urgent first.
template <class Urgency>
class MostUrgentFirst {
 public:
  MostUrgentFirst(const Disk& disk, Urgency urgency) : disk_(disk), urgency_(urgency) {
    for (std::uint32_t f = 0; f < disk.faces().size(); ++f) push(f);
  }

  /// The next side that is still as urgent, or kNoSide.
  TriangleSide pop() {
    while (!queue_.empty()) {
      const auto [urgency, f, s] = queue_.top();
      queue_.pop();
      if (urgency_(TriangleSide{f, s}) == urgency) return {f, s};
    }
    return kNoSide;
  }

  /// After a split of an edge between two faces: both have changed, and faces were added.
  void push_changed(std::uint32_t face, TriangleSide across, std::size_t first_new) {
    push(face);
    if (across != kNoSide) push(across.triangle);
    for (auto f = static_cast<std::uint32_t>(first_new); f < disk_.faces().size(); ++f) push(f);
  }

 private:
  void push(std::uint32_t f) {
    for (std::uint8_t s = 0; s < 3; ++s)
      if (const double urgency = urgency_(TriangleSide{f, s}); urgency > 0) queue_.push({urgency, f, s});
  }

  const Disk& disk_;
  Urgency urgency_;
  std::priority_queue<std::tuple<double, std::uint32_t, std::uint8_t>> queue_;
};

template <class Urgency, class Share>
void split_most_urgent(Disk& disk, std::size_t face_count, Urgency urgency, Share share) {
  if (disk.faces().size() >= face_count) return;
  MostUrgentFirst queue(disk, urgency);
  while (disk.faces().size() < face_count) {
    const TriangleSide side = queue.pop();
    if (side == kNoSide) return;
    const TriangleSide across = disk.neighbors()[side.triangle][side.side];
    const std::size_t first_new = disk.faces().size();
    disk.split_edge(side, share(side));
    queue.push_changed(side.triangle, across, first_new);
  }
}

/// The corner opposite to a side: its angle as cosine and sine (unscaled), and the foot of its height along
/// the side.
struct Apex {
  double cosine, sine, foot;

  Apex(const Disk& disk, TriangleSide s) {
    const Eigen::Vector3d& a = disk.positions()[disk.from(s)];
    const Eigen::Vector3d& b = disk.positions()[disk.to(s)];
    const Eigen::Vector3d& p = disk.positions()[disk.faces()[s.triangle][(s.side + 2u) % 3]];
    cosine = (a - p).dot(b - p);
    sine = (a - p).cross(b - p).norm();
    foot = (p - a).dot(b - a) / (b - a).squaredNorm();
  }
};

/// How far below 0 the cotan weight of an edge is, times its length squared: what clamping it does to the
/// map's energy.
double negative_energy(const Disk& disk, TriangleSide s) {
  const Apex here(disk, s);
  double cotans = here.cosine / std::max(here.sine, kMinSine * std::abs(here.cosine));
  if (const TriangleSide across = disk.neighbors()[s.triangle][s.side]; across != kNoSide) {
    const Apex there(disk, across);
    cotans += there.cosine / std::max(there.sine, kMinSine * std::abs(there.cosine));
  }
  return cotans < -kMinExcess ? std::min(-cotans, kMaxDeficit) * disk.length(s) * disk.length(s) : 0;
}

double foot_of_blunter(const Disk& disk, TriangleSide s) {
  const Apex here(disk, s);
  double share = here.foot;
  if (const TriangleSide across = disk.neighbors()[s.triangle][s.side]; across != kNoSide) {
    const Apex there(disk, across);
    if (there.cosine * here.sine < here.cosine * there.sine) share = 1 - there.foot;
  }
  return std::clamp(share, kMinToEnd, 1 - kMinToEnd);
}

double mean_side(const Disk& disk) {
  double area = 0;
  for (std::uint32_t f = 0; f < disk.faces().size(); ++f) area += .5 * Apex(disk, {f, 0}).sine;
  return std::sqrt(area / static_cast<double>(disk.faces().size()));
}

}  // namespace

void refine(Disk& disk, std::size_t face_count) {
  split_most_urgent(
      disk, face_count, [&](TriangleSide s) { return disk.length(s); }, [](TriangleSide) { return .5; });
}

void split_towards_delaunay(Disk& disk, std::size_t max_faces) {
  const double side = mean_side(disk), shortest = kMinSplitLength * side;
  const double least = kMinUrgency * side * side * static_cast<double>(disk.faces().size());
  split_most_urgent(
      disk, max_faces,
      [&](TriangleSide s) {
        const double energy = disk.length(s) > shortest ? negative_energy(disk, s) : 0;
        return energy > least ? energy : 0;
      },
      [&](TriangleSide s) { return foot_of_blunter(disk, s); });
}

}  // namespace hilbrush
