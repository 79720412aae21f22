#include "sampling/parametric/parametric.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>

#include "sampling/base/input_error.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

using test::kPi;

std::vector<ParametricShape> all_shapes() {
  std::vector<ParametricShape> shapes;
  for (const auto& [shape, name] : kParametricShapeNames) shapes.push_back(shape);
  return shapes;
}

const char* name_of(ParametricShape shape) {
  return name_of(kParametricShapeNames, shape);
}

TEST(ParametricSurface, DerivativesAreThoseOfThePosition) {
  for (const ParametricShape shape : all_shapes()) {
    const auto surface = make_surface(shape);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> inside(.02, .98);
    for (int i = 0; i < 200; ++i) {
      const Vector2d uv(inside(random), inside(random));
      const double h = 1e-6;
      const auto central = [&](const Vector2d& step, auto value) -> Vector3d {
        return (value(uv + h * step) - value(uv - h * step)) / (2 * h);
      };
      const Vector2d u(1, 0), v(0, 1);
      const auto position = [&](const Vector2d& p) { return surface->position(p); };
      const Tangents t = surface->tangents(uv);
      // The super-ellipsoid's own parameterization has edges where derivatives are large without bound.
      const double scale = 1e-4 * (1 + std::pow(std::max(t.du.norm(), t.dv.norm()), 2));
      EXPECT_LT((central(u, position) - t.du).norm(), scale) << name_of(shape) << " at " << uv.transpose();
      EXPECT_LT((central(v, position) - t.dv).norm(), scale) << name_of(shape) << " at " << uv.transpose();
      const SecondDerivatives s = surface->second_derivatives(uv);
      const double scale2 = 1e-3 * (1 + std::pow(std::max(s.duu.norm(), s.dvv.norm()), 2));
      const auto du = [&](const Vector2d& p) { return surface->tangents(p).du; };
      const auto dv = [&](const Vector2d& p) { return surface->tangents(p).dv; };
      EXPECT_LT((central(u, du) - s.duu).norm(), scale2) << name_of(shape) << " at " << uv.transpose();
      EXPECT_LT((central(v, du) - s.duv).norm(), scale2) << name_of(shape) << " at " << uv.transpose();
      EXPECT_LT((central(v, dv) - s.dvv).norm(), scale2) << name_of(shape) << " at " << uv.transpose();
    }
  }
}

TEST(ParametricSurface, CurvaturesInClosedForm) {
  const auto sphere = make_surface(ParametricShape::kSphere),
             saddle = make_surface(ParametricShape::kMonkeySaddle),
             plane = make_surface(ParametricShape::kPlane),
             umbrella = make_surface(ParametricShape::kWhitneyUmbrella);
  for (double x = .05; x < 1; x += .09)
    for (double y = .04; y < 1; y += .07) {
      const Vector2d uv(x, y);
      EXPECT_NEAR(sphere->gaussian_curvature(uv), 1, 1e-9);
      EXPECT_NEAR(std::abs(sphere->mean_curvature(uv)), 1, 1e-9);
      EXPECT_EQ(plane->gaussian_curvature(uv), 0);
      EXPECT_EQ(plane->mean_curvature(uv), 0);
      const double u = 2 * x - 1, v = 2 * y - 1, r2 = u * u + v * v;
      EXPECT_NEAR(saddle->gaussian_curvature(uv), -36 * r2 / std::pow(1 + 9 * r2 * r2, 2), 1e-9);
      const double w = u * u + 4 * v * v + 4 * std::pow(v, 4);
      EXPECT_NEAR(umbrella->gaussian_curvature(uv), -4 * v * v / (w * w), 1e-6 * (1 + 4 * v * v / (w * w)));
    }
}

TEST(ParametricSurface, SuperEllipsoidIsOneSurfaceInTwoParameterizations) {
  for (const ParametricShape shape :
       {ParametricShape::kSuperEllipsoid, ParametricShape::kSuperEllipsoidReparameterized})
    for (double x = .01; x < 1; x += .06)
      for (double y = .01; y < 1; y += .06) {
        const Vector3d p = make_surface(shape)->position({x, y});
        EXPECT_NEAR(p.array().pow(6).sum(), 1, 1e-12) << name_of(shape) << " at " << x << " " << y;
      }
  // The power law bounds the derivatives.
  const auto smooth = make_surface(ParametricShape::kSuperEllipsoidReparameterized);
  for (double x = 0; x <= 1; x += .03125)
    for (double y = 0; y <= 1; y += .03125) {
      const Tangents t = smooth->tangents({x, y});
      EXPECT_LT(t.du.norm(), 8);
      EXPECT_LT(t.dv.norm(), 16);
    }
}

TEST(ParametricSurface, NormalsAreUnitEvenAtPolesAndPinches) {
  for (const ParametricShape shape : all_shapes())
    for (double x = 0; x <= 1; x += .125)
      for (double y = 0; y <= 1; y += .125)
        EXPECT_NEAR(make_surface(shape)->normal({x, y}).norm(), 1, 1e-12)
            << name_of(shape) << " at " << x << " " << y;
}

TEST(MeasureParametric, MethodsBAndCAgreeWithTheTrueArea) {
  ParametricOptions options;
  options.dot_count = 5000;
  for (const auto& [shape, area] : {std::pair{ParametricShape::kPlane, 1.},
                                    {ParametricShape::kSphere, 4 * kPi},
                                    {ParametricShape::kEqualAreaSphere, 4 * kPi}})
    for (const CurveKind curve : {CurveKind::kHilbert, CurveKind::kPeano2}) {
      options.curve = curve;
      const ParametricAreas areas = measure_parametric(*make_surface(shape), options);
      EXPECT_NEAR(areas.by_method[1], area, 1e-4 * area) << name_of(shape);
      EXPECT_NEAR(areas.by_method[2], area, 1e-4 * area) << name_of(shape);
    }
  // The reparameterized super-ellipsoid is measured by (c) as well as by (b), the plain one is not:
  // section 4.5.
  options.curve = CurveKind::kHilbert;
  const ParametricAreas smooth =
      measure_parametric(*make_surface(ParametricShape::kSuperEllipsoidReparameterized), options);
  EXPECT_NEAR(smooth.by_method[2], smooth.by_method[1], 1e-3 * smooth.by_method[1]);
  const ParametricAreas plain = measure_parametric(*make_surface(ParametricShape::kSuperEllipsoid), options);
  EXPECT_GT(plain.by_method[1] - plain.by_method[2], .01 * plain.by_method[1]);
}

/// A triangle over three vertices is half a leaf where the curve turns and nothing where it runs straight: in
/// the limit two fifths of the area on the Hilbert curve.
TEST(MeasureParametric, TrianglesSeeTheTurnsOfTheCurve) {
  ParametricOptions options;
  options.minimum_depth = options.maximum_depth = 6;
  EXPECT_NEAR(measure_parametric(*make_surface(ParametricShape::kPlane), options).by_method[0], .4, .001);
}

TEST(SampleParametric, CountIsExactForEverySamplerCurveAreaAndShape) {
  for (const ParametricShape shape : all_shapes())
    for (const Sampler sampler :
         {Sampler::kCentroid, Sampler::kJittered, Sampler::kEven, Sampler::kRandom, Sampler::kHalton,
          Sampler::kHammersley, Sampler::kSobol, Sampler::kNiederreiter})
      for (const CurveKind curve : {CurveKind::kHilbert, CurveKind::kPeano2}) {
        ParametricOptions options;
        options.dot_count = 777;
        options.sampler = sampler;
        options.curve = curve;
        options.maximum_depth = curve == CurveKind::kHilbert ? 7 : 4;
        options.area = static_cast<AreaMethod>((static_cast<int>(sampler) + static_cast<int>(shape)) % 3);
        const auto surface = make_surface(shape);
        const ParametricSamples samples = sample_parametric(*surface, options);
        ASSERT_EQ(samples.dots.size(), 777u);
        for (const ParametricDot& dot : samples.dots) {
          ASSERT_TRUE((dot.uv.array() >= 0).all() && (dot.uv.array() <= 1).all())
              << name_of(shape) << " " << dot.uv.transpose() << " sampler " << static_cast<int>(sampler);
          ASSERT_TRUE(dot.position.isApprox(surface->position(dot.uv)) || dot.position.norm() < 1e-9);
          ASSERT_NEAR(dot.normal.norm(), 1, 1e-12);
        }
      }
}

TEST(SampleParametric, SphereGetsDotsByItsArea) {
  ParametricOptions options;
  options.dot_count = 20'000;
  for (const Sampler sampler : {Sampler::kJittered, Sampler::kCentroid, Sampler::kHalton})
    for (const AreaMethod method :
         {AreaMethod::kTriangle, AreaMethod::kSquare, AreaMethod::kFirstFundamentalForm}) {
      options.sampler = sampler;
      options.area = method;
      const ParametricSamples samples = sample_parametric(*make_surface(ParametricShape::kSphere), options);
      for (const double z : {-.9, -.5, 0., .3, .8, .99}) {
        double below = 0;
        for (const ParametricDot& dot : samples.dots) below += dot.position.z() < z;
        EXPECT_NEAR(below / 20'000, (z + 1) / 2, .004)
            << "sampler " << static_cast<int>(sampler) << " area method " << static_cast<int>(method) << " z "
            << z;
      }
    }
}

TEST(SampleParametric, DensitiesAreFollowed) {
  ParametricOptions options;
  options.dot_count = 10'000;
  const auto plane = make_surface(ParametricShape::kPlane);
  const auto share = [&](ParametricDensity density, auto is_inside) {
    options.density = density;
    double inside = 0;
    for (const ParametricDot& dot : sample_parametric(*plane, options).dots) inside += is_inside(dot.uv);
    return inside / static_cast<double>(options.dot_count);
  };
  for (const Sampler sampler : {Sampler::kJittered, Sampler::kCentroid}) {
    options.sampler = sampler;
    const auto is_left = [](const Vector2d& uv) { return uv.x() < .5; };
    EXPECT_NEAR(share(ParametricDensity::kConstant, is_left), .5, .005);
    EXPECT_NEAR(share(ParametricDensity::kU, is_left), .25, .005);
    EXPECT_NEAR(share(ParametricDensity::kUPlusV, is_left), .375, .005);
    EXPECT_NEAR(share(ParametricDensity::kUPlusV, [](const Vector2d& uv) { return uv.y() < .5; }), .375,
                .005);
  }
  // Total curvature of the sphere is even over its area; on the monkey saddle it follows |K| dA.
  options.density = ParametricDensity::kGaussianCurvature;
  const auto saddle = make_surface(ParametricShape::kMonkeySaddle);
  double inside = 0, mass = 0, mass_inside = 0;
  const auto is_central = [](const Vector2d& uv) { return (uv - Vector2d(.5, .5)).norm() < .25; };
  for (const ParametricDot& dot : sample_parametric(*saddle, options).dots) inside += is_central(dot.uv);
  for (double x = .0025; x < 1; x += .005)
    for (double y = .0025; y < 1; y += .005) {
      const double here = std::abs(saddle->gaussian_curvature({x, y})) * saddle->area_element({x, y});
      mass += here;
      if (is_central({x, y})) mass_inside += here;
    }
  EXPECT_NEAR(inside / 10'000, mass_inside / mass, .01);
}

TEST(SampleParametric, CentroidsOfAFullGridAreItsQuads) {
  ParametricOptions options;
  options.dot_count = 256;
  options.sampler = Sampler::kCentroid;
  for (const ParametricDot& dot : sample_parametric(*make_surface(ParametricShape::kPlane), options).dots)
    for (const double x : {dot.uv.x(), dot.uv.y()}) EXPECT_NEAR(16 * x - std::floor(16 * x), .5, 1e-6);
}

TEST(SampleParametric, OrderFollowsTheCurve) {
  ParametricOptions options;
  options.dot_count = 20'000;
  for (const ParametricShape shape : {ParametricShape::kPlane, ParametricShape::kSphere})
    for (const Sampler sampler : {Sampler::kJittered, Sampler::kCentroid}) {
      options.sampler = sampler;
      const ParametricSamples samples = sample_parametric(*make_surface(shape), options);
      double length = 0;
      for (std::size_t i = 1; i < samples.dots.size(); ++i)
        length += (samples.dots[i].position - samples.dots[i - 1].position).norm();
      EXPECT_LT(length / std::sqrt(20'000 * samples.area), shape == ParametricShape::kPlane ? 1.1 : 1.25);
    }
}

TEST(SampleParametric, SnappedDotsLieOnVertices) {
  ParametricOptions options;
  options.dot_count = 1000;
  options.minimum_depth = options.maximum_depth = 6;
  options.snaps_to_vertices = true;
  for (const ParametricDot& dot : sample_parametric(*make_surface(ParametricShape::kSphere), options).dots)
    for (const double x : {dot.uv.x(), dot.uv.y()}) EXPECT_EQ(64 * x - std::floor(64 * x), .5);
}

TEST(SampleParametric, SameBytesForAnyNumberOfThreads) {
  ParametricOptions options;
  options.dot_count = 5000;
  options.density = ParametricDensity::kMeanCurvature;
  for (const Sampler sampler : {Sampler::kJittered, Sampler::kCentroid, Sampler::kRandom}) {
    options.sampler = sampler;
    const auto surface = make_surface(ParametricShape::kEightSurface);
    const auto sample = [&](std::size_t threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      return sample_parametric(*surface, options).dots;
    };
    const auto one = sample(1), three = sample(3);
    for (std::size_t i = 0; i < one.size(); ++i) ASSERT_EQ(one[i].uv, three[i].uv);
  }
}

/// Division stops at the maximum depth, and where leaves are small; more dots ask for more vertices.
TEST(SampleParametric, CurveIsAdaptive) {
  ParametricOptions options;
  options.dot_count = 1000;
  const auto ellipsoid = make_surface(ParametricShape::kSuperEllipsoid);
  const ParametricSamples adaptive = sample_parametric(*ellipsoid, options);
  EXPECT_EQ(adaptive.deepest, 13) << "the edges are stretched without bound";
  EXPECT_LT(adaptive.vertex_count, std::uint64_t{1} << 20) << "against 2^26 at that depth everywhere";
  EXPECT_EQ(parametric_curve(*ellipsoid, options).size(), adaptive.vertex_count);
  options.maximum_depth = 7;
  EXPECT_EQ(sample_parametric(*ellipsoid, options).deepest, 7);
  options.minimum_depth = 7;
  EXPECT_EQ(sample_parametric(*ellipsoid, options).vertex_count, std::uint64_t{1} << 14);
}

TEST(SampleParametric, RefusesWhatItCannotDo) {
  const auto plane = make_surface(ParametricShape::kPlane);
  const auto refuses = [&](auto change) {
    ParametricOptions options;
    options.dot_count = 10;
    change(options);
    EXPECT_THROW(sample_parametric(*plane, options), InputError);
  };
  refuses([](ParametricOptions& o) { o.sampler = Sampler::kBlue; });
  refuses([](ParametricOptions& o) { o.sampler = Sampler::kFine; });
  refuses([](ParametricOptions& o) { o.curve = CurveKind::kLaminar; });
  refuses([](ParametricOptions& o) { o.maximum_depth = 60; });
  refuses([](ParametricOptions& o) { o.minimum_depth = -1; });
  refuses([](ParametricOptions& o) { o.minimum_depth = 5, o.maximum_depth = 4; });
  refuses([](ParametricOptions& o) { o.omega = 0; });
  refuses([](ParametricOptions& o) { o.density = ParametricDensity::kGaussianCurvature; });
  refuses([](ParametricOptions& o) { o.dot_count = std::uint64_t{1} << 40; });
}

}  // namespace
}  // namespace hilbrush
