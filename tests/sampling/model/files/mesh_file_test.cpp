#include "sampling/model/files/mesh_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <initializer_list>

#include "sampling/model/files/face_list.h"
#include "tests/sampling/model/model_on_disk.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(ObjFile, ReadsMaterialsTexturesAndSeams) {
  const ModelOnDisk disk;
  disk.write("rgb.png", "x");
  disk.write("m.mtl", "newmtl a\nKd 0.5 0.5 0.5\nd 0.25\nnewmtl b\r\nmap_Kd -s 2 2 2 rgb.png\r\nTr 0.5\n");
  const Model model = disk.load(
      "m.obj",
      "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .25\n"
      "usemtl a\nf 1 2 3\nusemtl b\nf 1/1 3/3 4/4\nf -4/5 -3/5 -1/5\nusemtl c\nf 1 2 \\\n4\n");
  ASSERT_EQ(model.mesh.triangle_count(), 4u);
  const auto material = [&](std::size_t t) { return model.mesh.materials[model.mesh.material_index[t]]; };
  EXPECT_EQ(material(0).source, ColorSource::kMaterial);
  EXPECT_DOUBLE_EQ(material(0).opacity, .25);
  EXPECT_NEAR(model.mesh.corner_luminance[0][0], .21404, 1e-4);
  EXPECT_EQ(material(1).source, ColorSource::kTexture);
  EXPECT_DOUBLE_EQ(material(1).opacity, .5);
  EXPECT_EQ(model.mesh.corner_uv[1][1], Vector2d(1, 1));
  EXPECT_EQ(model.mesh.corner_uv[2][0], Vector2d(.5, .25))
      << "texture coordinates belong to corners, not points";
  EXPECT_EQ(model.mesh.corner(2, 0), Vector3d(0, 0, 0)) << "relative indices count from where they stand";
  EXPECT_EQ(material(3).source, ColorSource::kNone);
  EXPECT_EQ(model.files.size(), 3u);
  EXPECT_EQ(model.up, UpAxis::kY);
  EXPECT_FALSE(model.unit_m);
}

TEST(ObjFile, ResolvesRelativeIndicesWhereTheyStand) {
  const ModelOnDisk disk;
  const Model model =
      disk.load("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n");
  EXPECT_EQ(model.mesh.corner(0, 0).z(), 0);
  EXPECT_EQ(model.mesh.corner(1, 0).z(), 5);
}

TEST(ObjFile, KeepsFacesThatDoNotFitTogether) {
  const ModelOnDisk disk;
  // Three triangles on one edge, one of them twice: mesh_repair decides, not the reader.
  const Model model = disk.load(
      "m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\nf 1 2 5\n");
  EXPECT_EQ(model.mesh.triangle_count(), 4u);
  EXPECT_EQ(model.mesh.vertices.size(), 5u);
}

TEST(ObjFile, IsReadInDoublePrecision) {
  const ModelOnDisk disk;
  const Model model = disk.load("m.obj", "v 1000000 0 0\nv 1000000.000000001 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(model.mesh.corner(0, 0).x(), 1e6);
  EXPECT_EQ(model.mesh.corner(0, 1).x(), 1e6 + 1e-9);
}

TEST(ObjFile, ReadsColorsOfPoints) {
  const ModelOnDisk disk;
  const Model model = disk.load("m.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(model.mesh.materials[0].source, ColorSource::kColors);
  EXPECT_NEAR(model.mesh.corner_luminance[0][0], .2126, 1e-3);
  EXPECT_NEAR(model.mesh.corner_luminance[0][1], .7152, 1e-3);
  EXPECT_NEAR(model.mesh.corner_luminance[0][2], 1, 1e-6);
  EXPECT_TRUE(warns(model, "1 of 3 points have no color"));
}

TEST(ObjFile, ReportsWhatIsWrongWithItsLine) {
  const ModelOnDisk disk;
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_EQ(disk.refusal("m.obj", points + "f 1 2 x\n"), "m.obj:4: expected the index of a point, found 'x'");
  EXPECT_EQ(disk.refusal("m.obj", "v 0 zero 0\n"), "m.obj:1: expected three coordinates after v");
  EXPECT_NE(disk.refusal("m.obj", points + "f 1 2 9\n")
                .find("m.obj:4: 1 faces were dropped: they name points that do not exist"),
            std::string::npos);
  EXPECT_NE(disk.refusal("m.obj", points).find("there is no face in it"), std::string::npos);
  EXPECT_TRUE(
      warns(disk.load("m.obj", points + "f 1 2 3\nf 1 1 2\n"), "m.obj:5: 1 faces with fewer than three"));
  EXPECT_EQ(disk.load("m.obj", points + "v nan 0 0\nf 1 2 3\nf 1 2 4\n").mesh.triangle_count(), 1u);
}

TEST(ObjFile, WithoutAWordOfColorIsPaintedGray) {
  const ModelOnDisk disk;
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const Model model = disk.load("m.obj", triangle);
  EXPECT_TRUE(warns(model, "says nothing of color"));
  EXPECT_NEAR(model.mesh.corner_luminance[0][0], .604, 1e-3);  // sRGB .8 in linear light
  disk.write("m.mtl", "newmtl a\nKd 1 1 1\n");
  EXPECT_EQ(disk.load("m.obj", "mtllib m.mtl\nusemtl a\n" + triangle).mesh.corner_luminance[0][0], 1)
      << "white is a word";
}

TEST(ObjFile, TransparencyOfOneIsTakenAsOpacity) {
  const ModelOnDisk disk;
  const auto opacity = [&](const std::string& line) {
    disk.write("m.mtl", "newmtl a\nKd 0 0 0\n" + line + "\n");
    return disk.load("m.obj", "mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        .mesh.materials[0]
        .opacity;
  };
  EXPECT_EQ(opacity("Tr 1"), 1);
  EXPECT_EQ(opacity("Tr 0.25"), .75);
  EXPECT_EQ(opacity("d 0.25"), .25);
  EXPECT_EQ(opacity("d 0"), 0);
}

TEST(ObjFile, ReadsNothingOutsideItsFolder) {
  const ModelOnDisk disk;
  std::ofstream(disk.outer() / "secret.mtl") << "newmtl a\nKd 0 0 0\n";
  std::ofstream(disk.outer() / "secret.png") << "x";
  disk.write("m.mtl", "newmtl a\nmap_Kd ../secret.png\n");
  const Model model = disk.load(
      "m.obj", "mtllib ../secret.mtl\nmtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_TRUE(warns(model, "outside the model's folder"));
  EXPECT_GT(model.mesh.corner_luminance[0][0], .5)
      << "the default gray, not the black of the library outside";
  EXPECT_TRUE(model.mesh.textures.empty());
  EXPECT_EQ(model.files.size(), 2u);
}

const std::string kPlyPoints = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";

std::string ply(const std::string& vertex_properties, const std::string& face_properties,
                const std::string& body, int faces = 1, const std::string& comment = "") {
  return "ply\nformat ascii 1.0\n" + comment +
         "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n" + vertex_properties +
         "element face " + std::to_string(faces) + "\nproperty list uchar int vertex_indices\n" +
         face_properties + "end_header\n" + body;
}

TEST(PlyFile, ReadsTextureCoordinatesUnderEveryName) {
  const ModelOnDisk disk;
  disk.write("rgb.png", "x");
  for (const auto& [u, v] : {std::pair("u", "v"), std::pair("s", "t"), std::pair("texture_u", "texture_v")}) {
    const Model model =
        disk.load("m.ply", ply(std::string("property float ") + u + "\nproperty float " + v + "\n", "",
                               "0 0 0 .1 .2\n1 0 0 .3 .4\n0 1 0 .5 .6\n0 0 1 0 0\n3 0 1 2", 1,
                               "comment TextureFile rgb.png\n"));
    EXPECT_EQ(model.mesh.materials[0].source, ColorSource::kTexture);
    EXPECT_LT((model.mesh.corner_uv[0][1] - Vector2d(.3, .4)).norm(), 1e-6) << u;
  }
  const Model corners =
      disk.load("m.ply", ply("", "property list uchar float texcoord\n",
                             kPlyPoints + "3 0 1 2 6 .1 .2 .3 .4 .5 .6\n3 0 2 3 6 1 0 1 1 0 1\n", 2,
                             "comment TextureFile rgb.png\n"));
  EXPECT_LT((corners.mesh.corner_uv[0][2] - Vector2d(.5, .6)).norm(), 1e-6);
  EXPECT_LT((corners.mesh.corner_uv[1][0] - Vector2d(1, 0)).norm(), 1e-6);
  EXPECT_EQ(corners.up, UpAxis::kZ);
}

TEST(PlyFile, ReadsColorsOfPointsAndFaces) {
  const ModelOnDisk disk;
  const std::string rgb = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  Model model =
      disk.load("m.ply", ply(rgb, "", "0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1 0 0 0\n3 0 1 2\n"));
  EXPECT_EQ(model.mesh.materials[0].source, ColorSource::kColors);
  EXPECT_NEAR(model.mesh.corner_luminance[0][1], .7152, 1e-3);
  model = disk.load("m.ply", ply("", rgb, kPlyPoints + "4 0 1 2 3 255 255 255\n3 0 1 2 0 0 0\n", 2));
  ASSERT_EQ(model.mesh.triangle_count(), 3u);
  EXPECT_EQ(model.mesh.corner_luminance[1][0], 1);
  EXPECT_EQ(model.mesh.corner_luminance[2][0], 0);
}

TEST(PlyFile, ReadsEveryTypeThatCountsLists) {
  const ModelOnDisk disk;
  for (const char* count : {"char", "uchar", "int8", "uint8", "short", "ushort", "int16", "uint16", "int",
                            "uint", "int32", "uint32"}) {
    std::string text = ply("", "", kPlyPoints + "3 0 1 2\n");
    text.replace(text.find("uchar int"), 5, count);
    EXPECT_EQ(disk.load("m.ply", text).mesh.triangle_count(), 1u) << count;
  }
}

/// Numbers as a binary file has them.
template <class Number>
std::string bytes_of(std::initializer_list<Number> numbers, bool is_big_endian = false) {
  std::string out;
  for (const Number number : numbers) {
    std::string bytes(reinterpret_cast<const char*>(&number), sizeof number);
    if (is_big_endian) std::reverse(bytes.begin(), bytes.end());
    out += bytes;
  }
  return out;
}

TEST(PlyFile, ReadsBinaryInBothByteOrdersAndDoublePrecision) {
  const ModelOnDisk disk;
  for (const bool is_big : {false, true}) {
    const std::string header =
        std::string("ply\nformat ") + (is_big ? "binary_big_endian" : "binary_little_endian") +
        " 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
        "property ushort red\nproperty ushort green\nproperty ushort blue\n"
        "element extra 1\nproperty list uchar short skipped\nproperty int more\n"
        "element face 1\nproperty list uchar int vertex_index\nend_header\n";
    std::string body;
    for (const auto& p : {Vector3d(1e6, 0, 0), Vector3d(1e6 + 1e-9, 0, 0), Vector3d(0, 1, 0)})
      body += bytes_of({p.x(), p.y(), p.z()}, is_big) + bytes_of<std::uint16_t>({0, 65535, 0}, is_big);
    body += bytes_of<std::uint8_t>({2}) + bytes_of<std::int16_t>({-5, 7}, is_big) +
            bytes_of<std::int32_t>({9}, is_big);
    body += bytes_of<std::uint8_t>({3}) + bytes_of<std::int32_t>({0, 1, 2}, is_big);
    const Model model = disk.load("m.ply", header + body);
    ASSERT_EQ(model.mesh.triangle_count(), 1u);
    EXPECT_EQ(model.mesh.corner(0, 1).x(), 1e6 + 1e-9);
    EXPECT_NEAR(model.mesh.corner_luminance[0][0], .7152, 1e-6);
    EXPECT_NE(disk.refusal("m.ply", header + body.substr(0, body.size() - 1)), "");
  }
}

TEST(PlyFile, ReadsColorsInFloatingPointOfBothSizes) {
  const ModelOnDisk disk;
  for (const std::string type : {"float", "double"}) {
    std::string rgb;
    for (const char* channel : {"red", "green", "blue"}) rgb += "property " + type + " " + channel + "\n";
    const Model model =
        disk.load("m.ply", ply(rgb, "", "0 0 0 .5 .5 .5\n1 0 0 0 1 0\n0 1 0 0 0 1\n0 0 1 0 0 0\n3 0 1 2\n"));
    EXPECT_NEAR(model.mesh.corner_luminance[0][0], .21404, 1e-4) << type;
    EXPECT_NEAR(model.mesh.corner_luminance[0][1], .7152, 1e-4) << type;
  }
}

TEST(PlyFile, ReadsTriangleStripsThatMinusOneEnds) {
  const ModelOnDisk disk;
  std::string text = ply("", "", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n12 0 1 2 3 -1 2 1 3 0 0 -1 2\n");
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  text.replace(text.find(faces), faces.size(), "element tristrips 1\nproperty list int int vertex_indices\n");
  const Model model = disk.load("m.ply", text);
  ASSERT_EQ(model.mesh.triangle_count(), 4u);
  EXPECT_GT(model.mesh.area_vector(0).z(), 0);
  EXPECT_GT(model.mesh.area_vector(1).z(), 0) << "every second triangle of a strip is the other way around";
  EXPECT_GT(model.mesh.area_vector(2).z(), 0) << "a strip after -1 begins with its own orientation";
  EXPECT_LT(model.mesh.area_vector(3).z(), 0);
}

TEST(PlyFile, BelievesNoCount) {
  const ModelOnDisk disk;
  const std::string good = ply("", "", kPlyPoints + "3 0 1 2\n");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_EQ(disk.refusal("m.ply", good), "");
  EXPECT_NE(disk.refusal("m.ply", with("vertex 4", "vertex 4000000000"))
                .find("m.ply:3: the element vertex has more entries than the limit"),
            std::string::npos);
  EXPECT_NE(
      disk.refusal("m.ply", with("vertex 4", "vertex 400000")).find("promises more than the file holds"),
      std::string::npos);
  EXPECT_NE(disk.refusal("m.ply", with("3 0 1 2", "2000000000 0 1")).find("ends early"), std::string::npos);
  EXPECT_NE(disk.refusal("m.ply", with("1 0 0", "1 nan 0")), "");
  EXPECT_NE(disk.refusal("m.ply", with("3 0 1 2", "3 0 1 7")).find("no usable face"), std::string::npos);
  EXPECT_NE(disk.refusal("m.ply", with("face 1", "face 0")).find("point clouds have no surface"),
            std::string::npos);
  EXPECT_NE(disk.refusal("m.ply", with("float z", "float w")).find("no property z"), std::string::npos);
  EXPECT_NE(
      disk.refusal("m.ply", "ply\nformat ascii 1.0\nelement vertex 1\n").find("the header does not end"),
      std::string::npos);
}

TEST(OffFile, ReadsCommentsCountsOnTheFirstLineAndColors) {
  const ModelOnDisk disk;
  Model model = disk.load("m.off",
                          "OFF 4 2 0 # counts here\n0 0 0\n\n1 0 0 # a comment\n0 1 0\n0 0 1\n3 0 1 2 255 "
                          "255 255\n3 0 1 3 0.0 0.0 0.0\n");
  EXPECT_EQ(model.mesh.triangle_count(), 2u);
  EXPECT_EQ(model.mesh.materials[0].source, ColorSource::kColors);
  EXPECT_EQ(model.mesh.corner_luminance[0][0], 1);
  EXPECT_EQ(model.mesh.corner_luminance[1][0], 0);
  model =
      disk.load("m.off", "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n3 0 1 2\n");
  EXPECT_NEAR(model.mesh.corner_luminance[0][1], .7152, 1e-3);
  model = disk.load("m.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(model.mesh.materials[0].source, ColorSource::kMaterial) << "nothing is left of the file before";
  EXPECT_EQ(disk.refusal("m.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"),
            "m.off:4: expected vertex 3 of 3, found the end of the file");
  EXPECT_NE(disk.refusal("m.off", "OFF BINARY\n").find("binary OFF is not read"), std::string::npos);
}

TEST(OffFile, ReadsFacesAndVerticesThatSpanLines) {
  const ModelOnDisk disk;
  const Model model = disk.load(
      "m.off", "OFF\n4 2 0\n0 0\n0\n1 0 0\n0 1 0\n0 0 1\n3 0 1\n  # half of it\n 2 255 0 0\n4\n0 1\n2 3\n");
  EXPECT_EQ(model.mesh.triangle_count(), 3u);
  EXPECT_NEAR(model.mesh.corner_luminance[0][0], .2126, 1e-3) << "the color follows the last corner";
  EXPECT_EQ(disk.refusal("m.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0\n1 x\n"),
            "m.off:7: expected the indices of the 3 corners of face 1 of 1, found 'x'");
}

/// Two points 1e-9 apart at 1e6: nothing of that is left in single precision.
constexpr double kFar = 1e6;
constexpr double kNear = 1e6 + 1e-9;

TEST(OffFile, IsReadInDoublePrecision) {
  const ModelOnDisk disk;
  const Model model = disk.load("m.off", "OFF\n3 1 0\n1000000 0 0\n1000000.000000001 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(model.mesh.corner(0, 0).x(), kFar);
  EXPECT_EQ(model.mesh.corner(0, 1).x(), kNear);
}

std::string binary_stl(std::uint32_t promised, const std::vector<std::array<float, 9>>& triangles) {
  std::string bytes = std::string("solid but binary").append(64, ' ');
  bytes.append(reinterpret_cast<const char*>(&promised), 4);
  for (const auto& triangle : triangles) {
    bytes.append(12, '\0')
        .append(reinterpret_cast<const char*>(triangle.data()), sizeof triangle)
        .append(2, '\0');
  }
  return bytes;
}

TEST(StlFile, ReadsTextAndBinaryThatBeginsLikeText) {
  const ModelOnDisk disk;
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  EXPECT_EQ(disk.load("m.stl", "solid an outer vertex\n" + facet + "endsolid\n").mesh.triangle_count(), 1u);
  EXPECT_EQ(disk.refusal("m.stl", "solid\nfacet\nouter loop\nvertex 0 0 x\n"),
            "m.stl:4: expected three coordinates after vertex");
  EXPECT_EQ(disk.refusal("m.stl", "solid\nfacet\nouter loop\nvertex 0 0 0\nendloop\n"),
            "m.stl:5: a facet has 1 corners, not three");
  const std::array<float, 9> triangle{0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::array<float, 9> other{0, 0, 1, 1, 0, 1, 0, 1, 1};
  std::array<float, 9> bad = other;
  bad[4] = std::numeric_limits<float>::quiet_NaN();
  const Model model = disk.load("m.stl", binary_stl(3, {triangle, bad, other}));
  EXPECT_EQ(model.mesh.triangle_count(), 2u);
  EXPECT_TRUE(warns(model, "1 triangles with coordinates out of range were dropped"));
  std::string lie = binary_stl(4'000'000'000u, {triangle});
  lie[0] = 'S', lie[1] = '!';
  EXPECT_NE(disk.refusal("m.stl", lie).find("promises 4000000000 triangles, the file holds 1"),
            std::string::npos);
}

TEST(StlFile, IsReadInDoublePrecisionWhereItIsText) {
  const ModelOnDisk disk;
  const Model model =
      disk.load("m.stl",
                "solid\nfacet normal 0 0 1\nouter loop\nvertex 1000000 0 0\nvertex 1000000.000000001 "
                "0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n");
  EXPECT_EQ(model.mesh.corner(0, 0).x(), kFar);
  EXPECT_EQ(model.mesh.corner(0, 1).x(), kNear);
}

TEST(StlFile, GivesEqualCornersOnePoint) {
  const ModelOnDisk disk;
  const Model model =
      disk.load("m.stl", binary_stl(2, {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, -0.f, 0, 0, 0, 0, 1}}));
  EXPECT_EQ(model.mesh.vertices.size(), 4u);
}

}  // namespace
}  // namespace hilbrush
