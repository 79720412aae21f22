#include "tests/support/hostile_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "sampling/disk/chain.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/place_dots.h"

namespace hilbrush {
namespace {

/// What repair and the map must say of a mesh.
struct Hostile {
  const char* name;
  TexturedMesh (*make)();
  std::vector<std::pair<std::string, std::size_t>> repairs;  ///< exactly these; a count of 0 stands for any
  std::vector<std::pair<int, int>> shapes;                   ///< genus and boundary loops of the components
};

const char* const kWelded = "vertices welded";
const char* const kSplit = "vertices split where parts only touch";
const char* const kDegenerate = "degenerate triangles dropped";
const char* const kDuplicate = "duplicate triangles dropped";
const char* const kTurned = "triangles turned over";
const char* const kCrowded = "edges split where more than two triangles meet";
const char* const kOneSided = "edges cut where the surface has one side only";

std::vector<Hostile> hostiles() {
  return {
      {"bow_tie", test::bow_tie, {{kSplit, 1}}, {{0, 1}, {0, 1}}},
      {"moebius_strip",
       [] { return test::moebius_strip(); },
       {{kWelded, 3}, {kOneSided, 0}, {kTurned, 0}, {kSplit, 0}},
       {{0, 1}}},
      {"klein_bottle",
       [] { return test::klein_bottle(); },
       {{kWelded, 24}, {kOneSided, 0}, {kTurned, 0}, {kSplit, 0}},
       {{0, 2}}},
      {"needle_fan", [] { return test::needle_fan(); }, {}, {{0, 1}}},
      {"duplicate_faces", test::duplicate_faces, {{kDuplicate, 12}}, {{0, 0}}},
      {"t_junction", test::t_junction, {{kSplit, 2}}, {{0, 1}, {0, 1}}},
      {"inside_out_cube", test::inside_out_cube, {{kTurned, 12}}, {{0, 0}}},
      {"three_pages", test::three_pages, {{kCrowded, 2}, {kSplit, 0}}, {}},
      {"pinched_torus", test::pinched_torus, {{kWelded, 23}, {kDegenerate, 48}, {kSplit, 1}}, {{0, 0}}},
      {"double_torus", test::double_torus, {}, {{2, 0}}},
      {"sliver_1e6", test::sliver_1e6, {}, {{0, 1}}},
      {"open_cylinder", [] { return test::cylinder(.02, .05, 48, 24); }, {}, {{0, 2}}},
      {"many_holes", [] { return test::many_holes(); }, {}, {{0, 82}}},
      {"chord_trap", [] { return test::chord_trap(); }, {}, {{0, 1}}},
      {"zero_area_cap", test::zero_area_cap, {{kDegenerate, 1}, {kSplit, 2}}, {{0, 1}, {0, 1}}},
      {"single_triangle", test::single_triangle, {}, {{0, 1}}},
      {"frayed_pole", test::frayed_pole, {{kWelded, 0}, {kDegenerate, 0}}, {{0, 0}}},
      {"long_finger", test::long_finger, {}, {{0, 2}}},
      {"bag", test::bag, {}, {{0, 1}}},
  };
}

void PrintTo(const Hostile& hostile, std::ostream* out) {
  *out << hostile.name;
}

class HostileMesh : public testing::TestWithParam<Hostile> {};

void expect_on_surface(const TexturedMesh& mesh, const Dot& dot) {
  const Eigen::Vector3d a = mesh.corner(dot.triangle, 0), b = mesh.corner(dot.triangle, 1),
                        c = mesh.corner(dot.triangle, 2);
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  EXPECT_NEAR((dot.position_O - a).dot(normal.normalized()), 0, 1e-12);
  const auto share = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
    return (q - p).cross(dot.position_O - p).dot(normal) / normal.squaredNorm();
  };
  EXPECT_GE(std::min({share(a, b), share(b, c), share(c, a)}), -1e-9);
}

TEST_P(HostileMesh, IsRepairedMappedAndSampled) {
  const Hostile& hostile = GetParam();
  const RepairedMesh repaired = repair_mesh(hostile.make());
  const TexturedMesh& mesh = repaired.mesh;
  std::vector<std::string> names, expected;
  for (const Repair& repair : repaired.repairs) {
    names.push_back(repair.what);
    for (const auto& [what, count] : hostile.repairs)
      if (what == repair.what && count > 0) {
        EXPECT_EQ(repair.count, count) << what;
      }
  }
  for (const auto& [what, count] : hostile.repairs) expected.push_back(what);
  std::sort(names.begin(), names.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(names, expected);

  const SurfaceCurve curve(mesh);
  std::vector<std::pair<int, int>> shapes;
  for (const ComponentReport& component : curve.components()) {
    EXPECT_TRUE(component.is_mapped) << component.order_reason;
    EXPECT_GE(component.map_shear, 1);
    shapes.emplace_back(component.genus, component.boundary_loops);
    const bool must_be_cut = component.genus > 0 || component.boundary_loops == 0;
    EXPECT_TRUE(component.cut_length_m > 0 || !must_be_cut);
  }
  if (!hostile.shapes.empty()) {
    EXPECT_EQ(shapes, hostile.shapes);
  }

  const ToneField tone(mesh, {});
  SampleOptions options;
  options.dot_count = 3000;
  SampleReport report;
  const DotSequence sequence = place_dots(curve, tone, options, &report);
  ASSERT_EQ(sequence.dots.size(), 3000u);
  for (const Dot& dot : sequence.dots) expect_on_surface(mesh, dot);
  EXPECT_NEAR(report.painted_area_m2, mesh.area_m2(), 1e-9 * mesh.area_m2());
  EXPECT_LT(report.path_constant, 1.1);
}

INSTANTIATE_TEST_SUITE_P(Named, HostileMesh, testing::ValuesIn(hostiles()),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(HostileMeshes, TenThousandSpecksAreChained) {
  const TexturedMesh mesh = repair_mesh(test::specks()).mesh;
  const SurfaceCurve curve(mesh);
  ASSERT_EQ(curve.components().size(), 10'000u);
  const ToneField tone(mesh, {});
  SampleOptions options;
  options.dot_count = 10'000;
  SampleReport report;
  ASSERT_EQ(place_dots(curve, tone, options, &report).dots.size(), 10'000u);
  EXPECT_LT(report.path_length_m, 1.6 * 10'000 * .05 / 100)
      << "from speck to speck it is a step of .05 / 100";
}

/// A square, and beside it a triangle whose sides are as long as the last digit of its coordinates.
TexturedMesh with_speck() {
  TexturedMesh mesh = test::rectangle(.02, .02, 2, 2);
  const double digit = std::ldexp(1, -52);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{1, 1 + digit, 1}, {1 + digit, 1, 1}, {1, 1, 1}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  return test::finish(std::move(mesh));
}

TEST(HostileMeshes, APartAsSmallAsTheLastDigitsIsOrderedInSpace) {
  const TexturedMesh mesh = with_speck();
  const SurfaceCurve curve(mesh);
  ASSERT_EQ(curve.components().size(), 2u);
  EXPECT_TRUE(curve.components()[0].is_mapped);
  EXPECT_FALSE(curve.components()[1].is_mapped);
  EXPECT_NE(curve.components()[1].order_reason.find("too small for the precision"), std::string::npos)
      << curve.components()[1].order_reason;
  const ToneField tone(mesh, {});
  SampleOptions options;
  options.dot_count = 1000;
  EXPECT_EQ(place_dots(curve, tone, options).dots.size(), 1000u);
}

TEST(Chain, VisitsEachPieceOnceAtAnyDistance) {
  std::vector<ChainPiece> pieces;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d place(i * 1e200, 0, 0);  // squared distances overflow
    pieces.push_back({{place, place, place, place}, 1, Turns::kMirrors});
  }
  std::vector<char> is_seen(pieces.size(), 0);
  for (const ChainLink& link : chain_pieces(pieces)) EXPECT_FALSE(std::exchange(is_seen[link.piece], 1));
}

TEST(Chain, RunsPiecesBackwardsWhereThatIsShorter) {
  // Bars side by side, each from left to right: every other one is walked backwards.
  std::vector<ChainPiece> pieces;
  for (int i = 0; i < 50; ++i)
    pieces.push_back({{Eigen::Vector3d(0, i, 0), Eigen::Vector3d(30, i, 0), Eigen::Vector3d(30, i + .5, 0),
                       Eigen::Vector3d(0, i + .5, 0)},
                      1,
                      Turns::kMirrors});
  const auto chain = chain_pieces(pieces);
  ASSERT_EQ(chain.size(), pieces.size());
  EXPECT_LE(total_jump(pieces, chain), 49);
  std::vector<char> is_seen(pieces.size(), 0);
  for (const ChainLink& link : chain) EXPECT_FALSE(std::exchange(is_seen[link.piece], 1));
  for (ChainPiece& piece : pieces) piece.turns = Turns::kNone;
  EXPECT_GT(total_jump(pieces, chain_pieces(pieces)), 49 * 29) << "the test would not notice mirrors";
}

}  // namespace
}  // namespace hilbrush
