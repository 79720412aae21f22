#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sampling/base/enum_names.h"
#include "sampling/dots/dots.h"
#include "sampling/model/textured_mesh.h"
#include "sampling/tone/tone_field.h"

/// Figures for the quality of a placement: discrepancy, spectrum, spacing, holes, path. After chapter 5 and
/// section 6.2.1 of the thesis, with rms values beside its maxima, balls beside its sets of whole triangles,
/// and holes and spacing, which it does not measure. Point sets in the unit square, on the unit sphere, and
/// dots on a mesh. All of it runs in parallel and gives the same bits for any number of threads.
namespace hilbrush {

/// Test shapes are drawn at random; the same seed draws the same shapes.
struct TestShapes {
  std::size_t count = 1000;  ///< L of the thesis's section 5.1.1
  std::uint64_t seed = 1;
};

/// |share of the points - share of the area| (on toned surfaces: of the asked dots) within test shapes.
struct Discrepancy {
  double rms = 0;      ///< over the shapes: steady, so targets are set for this one
  double largest = 0;  ///< equation 5.1: the thesis's measure, noisy by 10 to 20 %
};

/// Section 5.1.1: a rectangle from the origin to a random corner; a quarter circle around a random corner of
/// the square, radius 0 to 1; a triangle of the origin and two random corners.
enum class PlaneShape { kRectangle, kQuarterCircle, kTriangle };
Discrepancy plane_discrepancy(std::span<const Eigen::Vector2d> points, PlaneShape shape,
                              const TestShapes& shapes = {});

/// The same for all three shapes, indexed by PlaneShape; the points are sorted once.
std::array<Discrepancy, 3> plane_discrepancies(std::span<const Eigen::Vector2d> points,
                                               const TestShapes& shapes = {});

/// Spherical triangles of three random corners (equation 5.2); `directions` are points of the unit sphere.
/// Areas after Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983, which keeps its digits
/// on slivers where equation 5.5 loses them.
Discrepancy sphere_discrepancy(std::span<const Eigen::Vector3d> directions, const TestShapes& shapes = {});

/// Slope of the least-squares line through (log count, log value): the figures of tables 5.1 to 5.4 and 6.1.
/// Values that are not positive are left out; 0 if fewer than two are left.
double log_log_slope(std::span<const double> counts, std::span<const double> values);

/// Distances to the nearest neighbor, over that of the densest packing, sqrt(2 A / (sqrt(3) N)).
struct Spacing {
  double smallest = 0;
  double mean = 0;
  double spread = 0;              ///< standard deviation over mean
  std::vector<double> distances;  ///< one for each point, in rising order
};
Spacing plane_spacing(std::span<const Eigen::Vector2d> points);
/// On the unit sphere, along chords.
Spacing sphere_spacing(std::span<const Eigen::Vector3d> directions);

/// Radius of the largest empty disc with its center in the square (on the sphere), over sqrt(A / N); exact to
/// 1e-3 of itself, by branch and bound.
double plane_largest_hole(std::span<const Eigen::Vector2d> points);
double sphere_largest_hole(std::span<const Eigen::Vector3d> directions);

/// Length of the path through the points in their order, over sqrt(N A).
double path_constant(std::span<const Eigen::Vector2d> points, double area = 1);
double path_constant(std::span<const Eigen::Vector3d> points, double area);

/// Power P(f) = |sum_j exp(-2 pi i f.x_j)|^2 / N; 1 is white noise. Frequencies are over the principal
/// frequency sqrt(N / A).
struct Spectrum {
  struct Ring {
    double frequency = 0;  ///< of its middle
    double power = 0;      ///< mean over the ring
    double anisotropy =
        0;  ///< variance over the ring, over the squared mean (Ulichney): 1 for white noise; 0 on surfaces
  };
  std::vector<Ring> rings;
  std::vector<double>
      directions;  ///< mean power at .9 to 1.1 of the principal frequency, in equal sectors of half a
                   ///< turn from +x; empty on surfaces, which have no common direction
  double below_half = 0, below_quarter = 0;  ///< mean power over the disc of frequencies below that share of
                                             ///< the principal one, 0 left out
  double peak = 0;                           ///< largest ring
  double anisotropy = 0;  ///< largest relative deviation of `directions` from their mean; 0 on surfaces
};

/// In the unit square, on the frequencies that have whole periods in it (there a perfectly even density
/// leaves nothing), up to twice the principal frequency. Above 60,000 points the square is divided into equal
/// squares whose spectra are averaged (Bartlett's way, section 5.3). Cost O(N log N): points are spread onto
/// a grid with a Kaiser-Bessel kernel, transformed and corrected; error below 1e-6.
Spectrum plane_spectrum(std::span<const Eigen::Vector2d> points);

/// Mean of spectra with the same rings (section 5.3 averages ten random sets).
Spectrum average(std::span<const Spectrum> spectra);

/// Measures dots on a mesh against the number that each piece of it should get: by its area, or by asked tone
/// times area. Made once for many sets of dots; all members are thread-safe. Lengths are over the local pitch
/// sqrt(A / N) (on toned surfaces: of the tone asked there).
class SurfaceQuality {
 public:
  /// Keeps references to both. @throws InputError if nothing is to be covered.
  explicit SurfaceQuality(const TexturedMesh& mesh, const ToneField* tone = nullptr);
  ~SurfaceQuality();
  SurfaceQuality(SurfaceQuality&&) noexcept;

  /// Area, or asked tone times area.
  double mass_m2() const;

  /// The nearest point of the surface: for dots from a file, which does not keep their triangles.
  SurfacePoint nearest(const Eigen::Vector3d& position_O) const;

  /// Section 6.2.1: contiguous sets of whole triangles, grown in rings around a random vertex until they hold
  /// a random share of the area. It cannot measure anything finer than a triangle, so it favors methods that
  /// distribute dots triangle by triangle. Several sets of dots at once, because growing takes most of the
  /// time.
  std::vector<Discrepancy> triangle_sets(std::span<const std::span<const Dot>> sets,
                                         const TestShapes& shapes = {}) const;
  /// The share of the surface within a ball around a random surface point, radius 0 to half the bounding
  /// box's diagonal. The expected share is exact: closed-form area of disc and triangle; under a texture the
  /// disc is a 64-gon of equal area, whose tone is integrated exactly.
  std::vector<Discrepancy> balls(std::span<const std::span<const Dot>> sets,
                                 const TestShapes& shapes = {}) const;
  /// Expected share of dots within a ball.
  double share_in_ball(const Eigen::Vector3d& center_O, double radius_m) const;

  /// Distances to neighbors, as DotsOnSurface measures them: straight ones across folds and bumps, but around
  /// the edge to the far side of a thin wall.
  Spacing spacing(std::span<const Dot> dots) const;
  /// Radius of the largest empty disc: the part of a ball that is connected with its center on the surface.
  /// Within 1e-3 of itself by branch and bound where the tone is constant; under a texture within 1/8 of a
  /// pitch.
  double largest_hole(std::span<const Dot> dots) const;
  /// Over sqrt(N M), with M = mass_m2().
  double path_constant(std::span<const Dot> dots) const;

  /// Mean over patches around random surface points, about 20 pitches across, each flattened onto the tangent
  /// plane at its center along chords and faded out towards its border by (1 - r^2/R^2)^2. The even density
  /// of the same patch is transformed like the dots and subtracted, so that neither its curvature nor its
  /// border nor its tone counts as power. Frequencies are resolved to about 1/16 of the principal one.
  /// Patches that bend by more than 60 degrees are left out. @throws InputError if none is left or there are
  /// fewer than 100 dots.
  Spectrum spectrum(std::span<const Dot> dots, std::uint64_t seed = 1) const;

  struct Implementation;

 private:
  std::unique_ptr<Implementation> implementation_;
};

/// Section 5.4: distance along a curve through the unit square (as a share of its length) against straight
/// distance, for random pairs of its vertices.
enum class PlaneCurve { kHilbert, kPeano2, kZ, kRows };

inline constexpr EnumName<PlaneCurve> kPlaneCurveNames[] = {
    {PlaneCurve::kHilbert, "hilbert"},
    {PlaneCurve::kPeano2, "peano2"},
    {PlaneCurve::kZ, "z"},
    {PlaneCurve::kRows, "rows"},
};

inline const char* plane_curve_name(PlaneCurve curve) {
  return name_of(kPlaneCurveNames, curve);
}

struct Coherence {
  std::vector<Eigen::Vector2d> pairs;  ///< (straight distance, share of the curve between)
  double correlation = 0;              ///< Pearson's, of the pairs
  double hoelder =
      0;  ///< largest (straight distance)^2 / (share of the curve) among the pairs and 100,000 close ones
};
/// @param depth  levels: 12 for Hilbert and 9 (here at most 10) for Peano II in the thesis.
Coherence spatial_coherence(PlaneCurve curve, int depth, const TestShapes& pairs = {});

}  // namespace hilbrush
