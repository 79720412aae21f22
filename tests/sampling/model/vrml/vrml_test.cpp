#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sampling/model/files/face_list.h"
#include "tests/sampling/model/model_on_disk.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::string shape(const std::string& geometry,
                  const std::string& appearance = "Appearance { material Material { } }") {
  return "Shape { appearance " + appearance + " geometry " + geometry + " }\n";
}
std::string textured(const std::string& geometry) {
  return shape(geometry, "Appearance { texture PixelTexture { image 1 1 3 0x808080 } }");
}
void expect_near(const Vector2d& a, const Vector2d& b, double tolerance = 1e-9) {
  EXPECT_LT((a - b).norm(), tolerance) << a.transpose() << " against " << b.transpose();
}

TEST(VrmlSolids, HaveTheirVolumeAndFaceOutwards) {
  const ModelOnDisk disk;
  EXPECT_NEAR(signed_volume(disk.load_vrml(shape("Box { size 1 2 3 }")).mesh), 6, 1e-12);
  EXPECT_NEAR(signed_volume(disk.load_vrml(shape("Sphere { radius 2 }")).mesh), 4. / 3 * std::numbers::pi * 8,
              .15);
  EXPECT_NEAR(signed_volume(disk.load_vrml(shape("Cylinder { radius 1 height 3 }")).mesh),
              3 * std::numbers::pi, .02);
  EXPECT_NEAR(signed_volume(disk.load_vrml(shape("Cone { bottomRadius 1 height 3 }")).mesh), std::numbers::pi,
              .01);
}

TEST(VrmlSolids, LeaveOutThePartsThatAreFalse) {
  const ModelOnDisk disk;
  const double disc = std::numbers::pi;
  EXPECT_NEAR(area(disk.load_vrml(shape("Cylinder { radius 1 height 2 side FALSE bottom FALSE }")).mesh),
              disc, .01);
  EXPECT_NEAR(area(disk.load_vrml(shape("Cylinder { radius 1 height 2 top FALSE bottom FALSE }")).mesh),
              4 * disc, .01);
  EXPECT_NEAR(area(disk.load_vrml(shape("Cone { bottomRadius 1 height 2 side FALSE }")).mesh), disc, .01);
}

TEST(VrmlSolids, ShowTheTextureUprightAndUnmirroredOnEachSideOfABox) {
  const ModelOnDisk disk;
  const TexturedMesh mesh = disk.load_vrml(textured("Box { size 2 2 2 }")).mesh;
  // Seen from outside: u to the right, v up. The top is upright when tipped towards the viewer in front, the
  // bottom when tipped away.
  struct Side {
    Vector3d middle, right, up;
  };
  for (const Side& side : {Side{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}, Side{{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}},
                           Side{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, Side{{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
                           Side{{0, 1, 0}, {1, 0, 0}, {0, 0, -1}}, Side{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}}) {
    expect_near(uv_at(mesh, side.middle), {.5, .5});
    expect_near(uv_at(mesh, side.middle + .8 * side.right), {.9, .5});
    expect_near(uv_at(mesh, side.middle + .8 * side.up), {.5, .9});
  }
}

TEST(VrmlSolids, WrapTheTextureAroundFromTheBack) {
  const ModelOnDisk disk;
  const TexturedMesh ball = disk.load_vrml(textured("Sphere { radius 1 }")).mesh;
  expect_near(uv_at(ball, {0, 0, 1}), {.5, .5}, .02);
  expect_near(uv_at(ball, {-1, 0, 0}), {.25, .5}, .02);
  expect_near(uv_at(ball, {1, 0, 0}), {.75, .5}, .02);
  EXPECT_GT(uv_at(ball, Vector3d(0, .7, .7))[1], .7);
  const TexturedMesh can = disk.load_vrml(textured("Cylinder { radius 1 height 2 }")).mesh;
  expect_near(uv_at(can, {1, .5, 0}), {.75, .75}, .01);
  expect_near(uv_at(can, {.6, 1, 0}), {.8, .5}, .01);
  expect_near(uv_at(can, {0, 1, -.6}), {.5, .8}, .01);
  expect_near(uv_at(can, {0, -1, .6}), {.5, .8}, .01);
}

TEST(VrmlFaces, AreCutWhateverTheirShape) {
  const ModelOnDisk disk;
  // A U of area 10 with a flat corner, a point visited twice in a row, and no -1 at the end.
  const std::string u =
      "IndexedFaceSet { coord Coordinate { point [ 0 0 0, 2 0 0, 4 0 0, 4 4 0, 3 4 0, 3 1 0, 1 1 0, 1 4 0, 0 "
      "4 0 ] } "
      "coordIndex [ 0 1 2 3 3 4 5 6 7 8 ] convex FALSE }";
  const TexturedMesh mesh = disk.load_vrml(shape(u)).mesh;
  EXPECT_EQ(mesh.triangle_count(), 7u);
  EXPECT_NEAR(area(mesh), 10, 1e-12);
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    EXPECT_GT(mesh.area_vector(t).z(), 1e-6) << "a triangle without area tears the mesh";
}

TEST(VrmlFaces, WithBadIndicesAreDroppedAndCounted) {
  const ModelOnDisk disk;
  const Model model = disk.load_vrml(
      shape("IndexedFaceSet { coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 ] } coordIndex [ 0 1 2 -1 0 "
            "1 3 -1 -1 0 1 0 -1 0 0 1 2 -1 ] }"));
  EXPECT_EQ(model.mesh.triangle_count(), 2u);
  EXPECT_TRUE(
      warns(model, "model.wrl:2: 1 faces were dropped: they name points that do not exist (there are 3)"));
  EXPECT_TRUE(warns(model, "1 faces with fewer than three different corners"));
}

TEST(VrmlFaces, RunTheWayCcwAndMirrorsSay) {
  const ModelOnDisk disk;
  const std::string points = "coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 ] } coordIndex [ 0 1 2 -1 ]";
  const auto z = [&](const std::string& body) { return disk.load_vrml(body).mesh.area_vector(0).z(); };
  EXPECT_GT(z(shape("IndexedFaceSet { " + points + " }")), 0);
  EXPECT_LT(z(shape("IndexedFaceSet { ccw FALSE " + points + " }")), 0);
  EXPECT_GT(
      z("Transform { scale -1 1 1 children " + shape("IndexedFaceSet { ccw TRUE " + points + " }") + "}"), 0)
      << "mirrored in x, the front stays in front";
  EXPECT_NEAR(
      signed_volume(
          disk.load_vrml("Transform { scale -1 2 1 children " + shape("Box { size 1 1 1 }") + "}").mesh),
      2, 1e-12);
}

TEST(VrmlColors, ComeFromTextureThenColorsThenMaterial) {
  const ModelOnDisk disk;
  disk.write("rgb.png", "x");
  disk.write("gray.png", "x");
  const std::string faces =
      "IndexedFaceSet { coord Coordinate { point [ 0 0 0 1 0 0 1 1 0 0 1 0 ] } coordIndex [ 0 1 2 -1 0 2 3 "
      "-1 ] ";
  const std::string per_face = faces + "color Color { color [ 1 1 1, 0 0 0 ] } colorPerVertex FALSE }";

  TexturedMesh mesh = disk.load_vrml("Shape { geometry " + faces + "} }").mesh;
  EXPECT_EQ(mesh.materials[0].source, ColorSource::kNone);
  EXPECT_EQ(mesh.corner_luminance[0][0], 1);
  mesh = disk.load_vrml(shape(faces + "}",
                              "Appearance { material Material { diffuseColor .5 .5 .5 transparency .25 } }"))
             .mesh;
  EXPECT_EQ(mesh.materials[0].source, ColorSource::kMaterial);
  EXPECT_NEAR(mesh.corner_luminance[0][0], .21404, 1e-4) << "sRGB .5 in linear light";
  EXPECT_DOUBLE_EQ(mesh.materials[0].opacity, .75);
  mesh = disk.load_vrml(shape(per_face)).mesh;
  EXPECT_EQ(mesh.materials[0].source, ColorSource::kColors);
  EXPECT_EQ(mesh.corner_luminance[0][2], 1);
  EXPECT_EQ(mesh.corner_luminance[1][0], 0);
  mesh =
      disk.load_vrml(shape(per_face, "Appearance { texture ImageTexture { url \"rgb.png\" repeatS FALSE } }"))
          .mesh;
  EXPECT_EQ(mesh.materials[0].source, ColorSource::kTexture);
  EXPECT_EQ(mesh.textures.at(0).channels, 3);
  EXPECT_FALSE(mesh.materials[0].repeat_u);
  EXPECT_TRUE(mesh.materials[0].repeat_v);
  mesh = disk.load_vrml(shape(per_face, "Appearance { texture ImageTexture { url \"gray.png\" } }")).mesh;
  EXPECT_EQ(mesh.textures.at(0).channels, 1);
  EXPECT_EQ(mesh.corner_luminance[1][0], 0) << "a gray image multiplies the colors, so they must be there";
}

TEST(VrmlColors, AreFoundPerVertexAndPerFaceWithAndWithoutIndex) {
  const ModelOnDisk disk;
  const std::string faces =
      "IndexedFaceSet { coord Coordinate { point [ 0 0 0 1 0 0 1 1 0 ] } coordIndex [ 2 0 1 -1 0 2 1 -1 ] "
      "color Color "
      "{ color [ 0 0 0, 1 1 1, 1 1 1 ] } ";
  const auto load = [&](const std::string& rest) {
    return disk.load_vrml(shape(faces + rest + " }")).mesh.corner_luminance;
  };
  EXPECT_EQ(load("")[0], (std::array<float, 3>{1, 0, 1})) << "colors go with the points";
  EXPECT_EQ(load("colorIndex [ 0 1 2 -1 1 1 0 -1 ]")[1], (std::array<float, 3>{1, 1, 0}));
  EXPECT_EQ(load("colorPerVertex FALSE")[0], (std::array<float, 3>{0, 0, 0}));
  EXPECT_EQ(load("colorPerVertex FALSE colorIndex [ 1 0 ]")[0], (std::array<float, 3>{1, 1, 1}));
  EXPECT_EQ(load("colorPerVertex FALSE colorIndex [ 1 0 ]")[1], (std::array<float, 3>{0, 0, 0}));
}

TEST(VrmlTexture, CoordinatesAreIndexedGivenOrMappedToTheBox) {
  const ModelOnDisk disk;
  const std::string faces =
      "IndexedFaceSet { coord Coordinate { point [ 1 2 0 5 2 0 5 4 0 1 4 0 ] } coordIndex [ 0 1 2 3 -1 ] ";
  const std::string coordinates = "texCoord TextureCoordinate { point [ 0 0 1 0 1 1 0 1 ] } ";
  expect_near(uv_at(disk.load_vrml(textured(faces + coordinates + "}")).mesh, {5, 2, 0}), {1, 0});
  expect_near(
      uv_at(disk.load_vrml(textured(faces + coordinates + "texCoordIndex [ 1 2 3 0 -1 ] }")).mesh, {5, 2, 0}),
      {1, 1});
  // The longest side of the bounding box is 1 wide in u, the second one in the same units.
  expect_near(uv_at(disk.load_vrml(textured(faces + "}")).mesh, {5, 4, 0}), {1, .5});
}

TEST(VrmlTexture, TransformIsAppliedInTheStandardsOrder) {
  const ModelOnDisk disk;
  const auto uv = [&](const std::string& transform) {
    return uv_at(
        disk
            .load_vrml(shape(
                "IndexedFaceSet { coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 ] } coordIndex [ 0 1 2 ] "
                "texCoord "
                "TextureCoordinate { point [ 0 0 1 0 0 1 ] } }",
                "Appearance { texture PixelTexture { image 1 1 1 0 } textureTransform TextureTransform { " +
                    transform + " } }"))
            .mesh,
        {1, 0, 0});
  };
  expect_near(uv("translation .25 .5"), {1.25, .5});
  expect_near(uv("scale 2 3"), {2, 0});
  expect_near(uv("rotation 1.5707963267948966"), {0, 1});
  // -C S R C T: (1,0) + T(.5,0) + C(.5,.5) = (2,.5); R: (-.5,2); S: (-1,2); - C = (-1.5,1.5)
  expect_near(uv("translation .5 0 center .5 .5 rotation 1.5707963267948966 scale 2 1"), {-1.5, 1.5});
}

TEST(VrmlTexture, OfPixelsStartsAtTheLowerLeft) {
  const ModelOnDisk disk;
  const Texture texture = disk.load_vrml(shape("Box { }",
                                               "Appearance { texture PixelTexture { image 2 2 4 0xFF0000FF "
                                               "0x00FF0080 0x0000FF00 0xFFFFFFFF } }"))
                              .mesh.textures.at(0);
  EXPECT_EQ(texture.channels, 4);
  EXPECT_NEAR(texture.luminance[0], .2126, 1e-4);
  EXPECT_NEAR(texture.luminance[1], .7152, 1e-4);
  EXPECT_NEAR(texture.luminance[2], .0722, 1e-4);
  EXPECT_NEAR(texture.opacity[1], 128 / 255., 1e-6);
  EXPECT_EQ(texture.opacity[2], 0);
}

TEST(VrmlTransform, AppliesAllItsFieldsInOrder) {
  const ModelOnDisk disk;
  // P' = T C R SR S -SR -C P, on a tetrahedron whose first point is watched.
  const auto moved = [&](const std::string& fields) {
    return disk
        .load_vrml(
            "Transform { " + fields + " children " +
            shape(
                "IndexedFaceSet { coord Coordinate { point [ 2 0 0 0 1 0 0 0 1 ] } coordIndex [ 0 1 2 ] }") +
            "}")
        .mesh.vertices[0];
  };
  EXPECT_LT((moved("translation 1 2 3") - Vector3d(3, 2, 3)).norm(), 1e-12);
  EXPECT_LT((moved("rotation 0 0 9 1.5707963267948966") - Vector3d(0, 2, 0)).norm(), 1e-12)
      << "the axis need not be a unit vector";
  EXPECT_LT((moved("center 1 0 0 scale 3 1 1") - Vector3d(4, 0, 0)).norm(), 1e-12);
  EXPECT_LT((moved("scaleOrientation 0 0 1 1.5707963267948966 scale 3 5 1") - Vector3d(10, 0, 0)).norm(),
            1e-12)
      << "scaled along the turned axes";
  EXPECT_LT(
      (moved("translation 0 0 7 center 1 0 0 rotation 0 0 1 3.141592653589793") - Vector3d(0, 0, 7)).norm(),
      1e-12);
}

TEST(VrmlSurfaces, ElevationGridStandsUpAndMapsItsTexture) {
  const ModelOnDisk disk;
  const TexturedMesh mesh =
      disk
          .load_vrml(textured(
              "ElevationGrid { xDimension 3 zDimension 2 xSpacing 2 zSpacing 3 height [ 1 1 1 1 1 1 ] }"))
          .mesh;
  EXPECT_EQ(mesh.triangle_count(), 4u);
  EXPECT_NEAR(area(mesh), 12, 1e-12);
  EXPECT_GT(mesh.area_vector(0).y(), 0);
  expect_near(uv_at(mesh, {4, 1, 3}), {1, 1});
  expect_near(uv_at(mesh, {1, 1, 0}), {.25, 0});
  EXPECT_NE(disk.vrml_refusal(shape("ElevationGrid { xDimension 3 zDimension 3 height [ 0 0 ] }"))
                .find("model.wrl:2: xDimension"),
            std::string::npos);
  EXPECT_NE(disk.vrml_refusal(shape("ElevationGrid { xDimension 1e300 zDimension 1e300 height [ 0 0 ] }")),
            "");
}

TEST(VrmlSurfaces, ExtrusionIsClosedAndTurnsItsCornersAsTheStandardSays) {
  const ModelOnDisk disk;
  EXPECT_NEAR(signed_volume(disk.load_vrml(shape("Extrusion { }")).mesh), 4, 1e-12)
      << "the default: 2 x 2 x 1";
  EXPECT_NEAR(signed_volume(disk.load_vrml(shape("Extrusion { scale [ 1 1, .5 .5 ] }")).mesh), 7. / 3, 1e-12)
      << "a truncated pyramid";
  EXPECT_NEAR(signed_volume(disk.load_vrml(shape("Extrusion { spine [ 0 0 0 3 0 0 ] }")).mesh), 12, 1e-12);
  EXPECT_NEAR(signed_volume(disk.load_vrml(shape("Extrusion { spine [ 0 0 0 0 -1 0 ] }")).mesh), 4, 1e-12);
  EXPECT_NEAR(area(disk.load_vrml(shape("Extrusion { beginCap FALSE endCap FALSE }")).mesh), 8, 1e-12);
  // A mitred square ring: the cross-section planes halve its corners.
  const TexturedMesh ring =
      disk.load_vrml(shape("Extrusion { crossSection [ .1 .1 .1 -.1 -.1 -.1 -.1 .1 .1 .1 ] spine "
                           "[ 1 0 0 0 0 -1 -1 0 0 0 0 1 1 0 0 ] }"))
          .mesh;
  EXPECT_EQ(ring.triangle_count(), 32u) << "no caps inside the ring";
  EXPECT_GT(signed_volume(ring), .1);
}

TEST(VrmlSurfaces, ExtrusionWrapsItsTextureAroundAndCutsItForTheCaps) {
  const ModelOnDisk disk;
  const TexturedMesh mesh = disk.load_vrml(textured("Extrusion { }")).mesh;
  expect_near(uv_at(mesh, {1, .25, 0}), {.125, .25});
  expect_near(uv_at(mesh, {.5, 1, .5}), {.75, .75});
}

TEST(VrmlGroups, ChooseWhatTheyShow) {
  const ModelOnDisk disk;
  const std::string small = shape("Box { size 1 1 1 }");
  const std::string large = shape("Box { size 2 2 2 }");
  const auto volume = [&](const std::string& body) { return signed_volume(disk.load_vrml(body).mesh); };
  EXPECT_NEAR(volume("Switch { whichChoice 1 choice [ " + small + large + "] }"), 8, 1e-12);
  EXPECT_NEAR(volume("LOD { level [ " + small + large + "] }"), 1, 1e-12);
  EXPECT_NEAR(volume("Collision { proxy " + large + " children " + small + "}"), 1, 1e-12);
  EXPECT_NEAR(volume("Anchor { children [ Billboard { children " + small + "} Group { children [ " + large +
                     "] } ] }"),
              9, 1e-12);
  EXPECT_NE(disk.vrml_refusal("Switch { choice [ " + small + "] }").find("there is no surface to paint"),
            std::string::npos);
}

TEST(VrmlNames, DefUseRedefinitionAndCycles) {
  const ModelOnDisk disk;
  const std::string one = "DEF A " + shape("Box { size 1 1 1 }");
  const std::string two = "DEF A " + shape("Box { size 2 2 2 }");
  EXPECT_NEAR(signed_volume(disk.load_vrml(one + "USE A " + two + "USE A").mesh), 1 + 1 + 8 + 8, 1e-12);
  EXPECT_NE(
      disk.vrml_refusal("DEF A Group { children [\n USE A ] }").find("model.wrl:3: USE A inside its own DEF"),
      std::string::npos);
  EXPECT_TRUE(warns(disk.load_vrml(one + "USE Nothing"), "never defined: Nothing"));
}

TEST(VrmlNames, AScriptMayNameItselfAndWhatItStandsIn) {
  const ModelOnDisk disk;
  const std::string script =
      "DEF T Transform { children [ DEF S Script { field SFNode me USE S field MFNode all [ USE T ] "
      "directOutput TRUE "
      "} "
      "Shape { geometry Box { size 1 1 1 } } ] }";
  EXPECT_NEAR(signed_volume(disk.load_vrml(script).mesh), 1, 1e-12);
}

TEST(VrmlFaces, IgnoreNormalsThatAreNotNumbers) {
  const ModelOnDisk disk;
  const std::string faces =
      "IndexedFaceSet { coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 ] } coordIndex [ 0 1 2 -1 ] normal "
      "Normal { "
      "vector "
      "[ nan -nan(ind) 0, 1 nan 0 ] } normalIndex [ 0 0 0 -1 ] }";
  EXPECT_EQ(disk.load_vrml(shape(faces)).mesh.triangle_count(), 1u);
  EXPECT_NE(disk.vrml_refusal(shape("IndexedFaceSet { coord Coordinate { point [ nan 0 0 ] } }")), "");
}

/// Small enough that tests reach the limits.
ModelLimits small_limits() {
  ModelLimits limits;
  limits.triangles = 10'000;
  return limits;
}

std::string repeated(const std::string& text, int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out += text;
  return out;
}

TEST(VrmlLimits, CountWorkThatManyUsesOfALargeNodeMake) {
  const ModelOnDisk disk;
  const auto refusal = [&](const std::string& body) { return disk.vrml_refusal(body, small_limits()); };
  const std::string words = "more geometry";
  const std::string fields = "DEF A Group { " + repeated("made 1 ", 5000) + "}\n";
  EXPECT_EQ(refusal(fields + shape("Box { }")), "");
  EXPECT_NE(refusal(fields + repeated("USE A\n", 500) + shape("Box { }")).find(words), std::string::npos);
  const std::string triangle =
      "IndexedFaceSet { coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 ] } coordIndex [ 0 1 2 ] ";
  const std::string colors =
      "DEF A " + shape(triangle + "color Color { color [ " + repeated("1 0 0 ", 3000) + "] } }");
  EXPECT_EQ(refusal(colors), "");
  EXPECT_NE(refusal(colors + repeated("USE A\n", 500)).find(words), std::string::npos);
  const std::string uv =
      "DEF A " + shape(triangle + "texCoord TextureCoordinate { point [ " + repeated("1 0 ", 5000) + "] } }");
  EXPECT_NE(refusal(uv + repeated("USE A\n", 500)).find(words), std::string::npos);
  const std::string urls =
      "DEF A " + shape("Box { }", "Appearance { texture ImageTexture { url [ " +
                                      repeated("\"" + std::string(1000, 'x') + "\" ", 50) + "] } }");
  EXPECT_EQ(refusal(urls), "");
  EXPECT_NE(refusal(urls + repeated("USE A\n", 500)).find(words), std::string::npos);
}

TEST(VrmlLimits, EndChainsOfPrototypes) {
  const ModelOnDisk disk;
  std::string chain = "PROTO P0 [ field SFVec3f size 1 1 1 ] { Shape { geometry Box { size IS size } } }\n";
  for (int i = 1; i < 100; ++i)
    chain += "PROTO P" + std::to_string(i) + " [ field SFVec3f size 1 1 1 ] { P" + std::to_string(i - 1) +
             " { size IS size } }\n";
  EXPECT_NEAR(signed_volume(disk.load_vrml(chain + "P20 { size 2 1 1 }").mesh), 2, 1e-12);
  EXPECT_NE(disk.vrml_refusal(chain + "P99 { }").find("nested more than 64 deep"), std::string::npos);
}

TEST(Vrml1, StringsNeedNoQuotes) {
  const ModelOnDisk disk;
  disk.write("textures/2wood.jpg", "x");
  for (const char* file : {"textures/2wood.jpg", "./textures/2wood.jpg", "../model/textures/2wood.jpg"}) {
    const Model model =
        disk.load("old.wrl",
                  std::string("#VRML V1.0 ascii\nSeparator { Texture2 { filename ") + file + " } Cube { } }");
    EXPECT_EQ(model.mesh.textures.size(), 1u) << file;
  }
  disk.write("2wood.jpg", "x");
  EXPECT_EQ(disk.load("old.wrl", "#VRML V1.0 ascii\nSeparator { Texture2 { filename 2wood.jpg } Cube { } }")
                .mesh.textures.size(),
            1u);
  EXPECT_NE(disk.refusal("old.wrl", "#VRML V1.0 ascii\nSeparator { Cube { width 1.2.3 } }"), "");
}

TEST(VrmlProto, BindsFieldsThroughInstances) {
  const ModelOnDisk disk;
  const std::string proto =
      "PROTO Block [ field SFVec3f size 1 1 1 field MFNode more [ ] ] { Group { children [ Shape { geometry "
      "Box { size "
      "IS size } } Group { children IS more } ] } Script { field SFBool x TRUE } }\n"
      "PROTO Tall [ field SFVec3f measure 1 4 1 ] { Block { size IS measure more [ Block { } ] } }\n";
  EXPECT_NEAR(signed_volume(disk.load_vrml(proto + "Block { }").mesh), 1, 1e-12);
  EXPECT_NEAR(signed_volume(disk.load_vrml(proto + "Block { size 2 2 2 more Block { size 1 1 3 } }").mesh),
              11, 1e-12);
  EXPECT_NEAR(signed_volume(disk.load_vrml(proto + "Tall { }").mesh), 5, 1e-12);
  EXPECT_NEAR(signed_volume(disk.load_vrml(proto + "Tall { measure 2 2 2 }").mesh), 9, 1e-12);
  const Model model = disk.load_vrml(
      "EXTERNPROTO Far [ field SFVec3f size ] \"far.wrl\"\nFar { size 1 2 3 }\n" + shape("Box { }"));
  EXPECT_TRUE(warns(model, "model.wrl:2: EXTERNPROTO Far is not read"));
  EXPECT_NE(disk.vrml_refusal("PROTO Self [ ] { Self { } } Self { }").find("no surface"), std::string::npos);
}

TEST(VrmlSkips, WhatMakesNoSurface) {
  const ModelOnDisk disk;
  const Model model = disk.load_vrml(
      "DEF S Script { eventIn SFBool go field SFNode me USE S2 field MFString words [ \"}\" ] url "
      "\"javascript: { }\" "
      "directOutput TRUE }\n"
      "DEF T TimeSensor { loop TRUE } ROUTE T.fraction_changed TO S.go\n"
      "Mystery { a 1 b [ 1 2 ] c \"x\" d Box { } e [ Group { } ] f TRUE }\n" +
      shape("Text { string \"hello\" }") + shape("Box { }"));
  EXPECT_NEAR(signed_volume(model.mesh), 8, 1e-12);
  EXPECT_TRUE(warns(model, "model.wrl:4: Mystery is left out"));
  EXPECT_TRUE(warns(model, "Text is left out"));
  EXPECT_FALSE(warns(model, "TimeSensor"));
}

TEST(VrmlErrors, NameTheLineAndWhatWasExpected) {
  const ModelOnDisk disk;
  EXPECT_EQ(disk.vrml_refusal("Group {\n\n  children }"),
            "model.wrl:4: expected a value of children, found '}'");
  EXPECT_EQ(disk.vrml_refusal("Group { children [\r\n Shape\r 12 ] }"),
            "model.wrl:3: expected a value of children or ']', found 'Shape'");
  EXPECT_EQ(disk.vrml_refusal("Transform { translation 1 2\n children [ ] }"),
            "model.wrl:2: translation of Transform needs 3 numbers, found 2");
  EXPECT_EQ(disk.vrml_refusal("Group { children [ Shape { geometry Sphere { radius 1e999 } } ] }"),
            "model.wrl:2: the number '1e999' is out of range");
  EXPECT_EQ(disk.vrml_refusal("Text { string \"oh\n"),
            "model.wrl:2: the string that starts here has no closing quote");
  EXPECT_EQ(disk.vrml_refusal("Group {"),
            "model.wrl:2: expected a field of Group or '}', found the end of the file");
}

TEST(VrmlHeader, MayBeMissingOddOrMarked) {
  const ModelOnDisk disk;
  const std::string body = shape("Box { }");
  for (const char* head : {"", "# VRML V2.0\n", "\xef\xbb\xbf#VRML V2.0 utf8\r\n",
                           "#VRML V2.0 utf8 CosmoWorlds V1.0\r", "#VRML V2.0 utf8\n# caf\xe9 \xff\n"})
    EXPECT_EQ(disk.load("model.wrl", std::string(head) + body).mesh.triangle_count(), 12u) << head;
  EXPECT_EQ(disk.load("any.name", "#VRML V2.0 utf8\n" + body).mesh.triangle_count(), 12u)
      << "found by the first bytes";
  EXPECT_TRUE(warns(disk.load("model.wrl", "DEF Transform { children " + body + "}"),
                    "DEF without a name before Transform"));
}

TEST(VrmlLimits, EndWhatWouldNotEnd) {
  const ModelOnDisk disk;
  std::string laughs = "DEF L0 Group { }\n";
  std::string protos = "PROTO P0 [ ] { Group { } }\n";
  for (int i = 1; i < 40; ++i) {
    const std::string n = std::to_string(i);
    const std::string p = std::to_string(i - 1);
    laughs += "DEF L" + n + " Group { children [ USE L" + p + " USE L" + p + " ] }\n";
    protos += "PROTO P" + n + " [ ] { Group { children [ P" + p + " { } P" + p + " { } ] } }\n";
  }
  EXPECT_NE(disk.vrml_refusal(laughs).find("more nodes than the limit"), std::string::npos);
  EXPECT_NE(disk.vrml_refusal(protos + "P39 { }").find("more geometry than the limit"), std::string::npos)
      << "searches through the fields of nested instances are work, too";
  std::string nested;
  for (int i = 0; i < 100'000; ++i) nested += "Group { children ";
  EXPECT_NE(disk.vrml_refusal(nested).find("nested more than 64 deep"), std::string::npos);
  ModelLimits small;
  small.triangles = 100;
  EXPECT_NE(disk.vrml_refusal(shape("Sphere { }"), small).find("triangles than the limit of 100"),
            std::string::npos);
  EXPECT_NE(disk.vrml_refusal(shape("Extrusion { spine [ 0 0 0 0 1 0 0 2 0 ] crossSection [ " +
                                    std::string(800, '1') + " " + " 1" + " ] }"),
                              small),
            "");
  small.values = 1000;
  std::string numbers = "Mystery { list [ ";
  for (int i = 0; i < 1000; ++i) numbers += "1 ";
  EXPECT_NE(disk.vrml_refusal(numbers + "] }", small).find("more values than the limit"), std::string::npos);
}

TEST(VrmlNumbers, BeyondAllMeasureDropTheirFaces) {
  const ModelOnDisk disk;
  const Model model = disk.load_vrml(
      shape("IndexedFaceSet { coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 1e300 0 0 ] } coordIndex [ 0 "
            "1 2 -1 0 1 3 -1 ] }"));
  EXPECT_EQ(model.mesh.triangle_count(), 1u);
  EXPECT_TRUE(warns(model, "1 faces with coordinates out of range"));
}

TEST(VrmlInline, IsReadOnlyBelowTheModelsFolder) {
  const ModelOnDisk disk;
  const std::string box = "#VRML V2.0 utf8\n" + shape("Box { size 1 1 1 }");
  disk.write("parts/box.wrl", box);
  std::ofstream(disk.outer() / "secret.wrl") << box;
  std::filesystem::create_symlink(disk.outer() / "secret.wrl", disk.folder() / "link.wrl");
  const Model model = disk.load_vrml(
      "Inline { url [ \"missing.wrl\" \"parts/box.wrl\" ] } Inline { url \"parts\\\\box.wrl#View\" }");
  EXPECT_NEAR(signed_volume(model.mesh), 2, 1e-12);
  EXPECT_EQ(model.files.size(), 2u);
  for (const std::string& url :
       {std::string("../secret.wrl"), std::string("link.wrl"), (disk.outer() / "secret.wrl").string(),
        "file://" + (disk.outer() / "secret.wrl").string(), std::string("http://example.org/secret.wrl")}) {
    const std::string refusal = disk.vrml_refusal("Inline { url \"" + url + "\" }");
    EXPECT_NE(refusal.find("1 inlined files cannot be read (the first: '"), std::string::npos)
        << url << ": " << refusal;
  }
  const Model self = disk.load_vrml("Inline { url \"model.wrl\" } " + shape("Box { size 1 1 1 }"));
  EXPECT_TRUE(warns(self, "contains itself"));
}

TEST(Vrml1, StateGoesAlongAndSeparatorsHoldItBack) {
  const ModelOnDisk disk;
  disk.write("gray.png", "x");
  const Model model =
      disk.load("old.wrl",
                "#VRML V1.0 ascii\nSeparator {\n Separator { Translation { translation 10 0 0 } "
                "Material { diffuseColor 0 0 0 } Cube { width 1 height 1 depth 1 } }\n"
                " Scale { scaleFactor 2 1 1 } Cube { width 1 height 1 depth 1 } Texture2 { filename "
                "\"gray.png\" wrapS CLAMP }\n Cube { width 1 height 1 depth 1 } }");
  ASSERT_EQ(model.mesh.triangle_count(), 36u);
  EXPECT_NEAR(signed_volume(model.mesh), 1 + 2 + 2, 1e-12);
  EXPECT_EQ(model.mesh.materials[model.mesh.material_index[0]].source, ColorSource::kMaterial);
  EXPECT_EQ(model.mesh.materials[model.mesh.material_index[12]].source, ColorSource::kMaterial);
  EXPECT_NEAR(model.mesh.corner_luminance[12][0], .604, 1e-3)
      << "without a Material its default, a light gray";
  EXPECT_EQ(model.mesh.materials[model.mesh.material_index[24]].source, ColorSource::kTexture);
  EXPECT_FALSE(model.mesh.materials[model.mesh.material_index[24]].repeat_u);
  EXPECT_EQ(model.up, UpAxis::kY);
}

TEST(Vrml1, BindsMaterialsToFacesAndVertices) {
  const ModelOnDisk disk;
  const auto load = [&](const std::string& binding, const std::string& index) {
    return disk
        .load("old.wrl",
              "#VRML V1.0 ascii\nSeparator { Coordinate3 { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] } Material { "
              "diffuseColor [ 0 0 0, 1 1 1, 0 0 0, 1 1 1 ] }\n"
              "MaterialBinding { value " +
                  binding + " } IndexedFaceSet { coordIndex [ 0, 1, 2, -1, 0, 2, 3, -1 ] " + index + " } }")
        .mesh.corner_luminance;
  };
  EXPECT_EQ(load("OVERALL", "")[1], (std::array<float, 3>{0, 0, 0}));
  EXPECT_EQ(load("PER_FACE", "")[1], (std::array<float, 3>{1, 1, 1}));
  EXPECT_EQ(load("PER_FACE_INDEXED", "materialIndex [ 1, 0 ]")[0], (std::array<float, 3>{1, 1, 1}));
  EXPECT_EQ(load("PER_VERTEX_INDEXED", "")[1], (std::array<float, 3>{0, 0, 1}));
  EXPECT_EQ(load("PER_VERTEX", "")[0], (std::array<float, 3>{0, 1, 0}));
}

TEST(Vrml1, TransformsAndSwitches) {
  const ModelOnDisk disk;
  const auto volume = [&](const std::string& body) {
    return signed_volume(disk.load("old.wrl", "#VRML V1.0 ascii\nSeparator { " + body + " }").mesh);
  };
  EXPECT_NEAR(volume("MatrixTransform { matrix 2 0 0 0 0 3 0 0 0 0 1 0 5 6 7 1 } Cube { }"), 48, 1e-9);
  EXPECT_NEAR(volume("Switch { whichChild 1 Cube { } Cube { width 4 } }"), 16, 1e-12);
  EXPECT_NEAR(volume("Switch { whichChild -3 Cube { } Cube { width 4 } }"), 24, 1e-12);
  EXPECT_NEAR(volume("TransformSeparator { Scale { scaleFactor 9 9 9 } } Cube { }"), 8, 1e-12);
  EXPECT_NEAR(volume("Transform { scaleFactor 1 1 -2 } Cube { }"), 16, 1e-12);
}

}  // namespace
}  // namespace hilbrush
