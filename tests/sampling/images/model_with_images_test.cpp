#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdlib>
#include <set>

#include "sampling/images/image_file.h"
#include "tests/sampling/model/model_on_disk.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

const std::string kBox = "#VRML V2.0 utf8\nShape { geometry Box { } }\n";

std::string gzipped(const std::string& text) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, text.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

TEST(ModelFile, IsGunzippedByItsFirstBytes) {
  const ModelOnDisk disk;
  EXPECT_EQ(disk.load("plain.wrl", gzipped(kBox)).mesh.triangle_count(), 12u);
  const std::string packed = gzipped(kBox);
  EXPECT_NE(disk.refusal("cut.wrl", packed.substr(0, packed.size() - 12)).find("truncated or corrupt"),
            std::string::npos);
  ModelLimits limits;
  limits.file_bytes = 10'000;
  EXPECT_NE(disk.refusal("bomb.wrl", gzipped(std::string(1'000'000, ' ')), limits)
                .find("unpacks to more than the limit of 10000 bytes"),
            std::string::npos);
}

TEST(ModelFile, IsGunzippedWithAllItsMembers) {
  const ModelOnDisk disk;
  const std::size_t half = kBox.size() / 2;
  const std::string members = gzipped(kBox.substr(0, half)) + gzipped("") + gzipped(kBox.substr(half));
  EXPECT_EQ(disk.load("members.wrl", members).mesh.triangle_count(), 12u);
  EXPECT_EQ(disk.load("padded.wrl", members + std::string(100, '\0')).mesh.triangle_count(), 12u);
  EXPECT_NE(disk.refusal("cut.wrl", members.substr(0, members.size() - 12)).find("truncated or corrupt"),
            std::string::npos);
}

TEST(ModelFile, LimitsItsFilesTogether) {
  const ModelOnDisk disk;
  ModelLimits limits;
  limits.file_bytes = 10'000;
  std::string inlines = "#VRML V2.0 utf8\n";
  for (int i = 0; i < 6; ++i) {
    const std::string name = "part" + std::to_string(i) + ".wrl";
    disk.write(name, kBox + std::string(9'000, ' '));
    inlines += "Inline { url \"" + name + "\" }\n";
  }
  EXPECT_NE(
      disk.refusal("model.wrl", inlines, limits).find("together are larger than the limit of 40000 bytes"),
      std::string::npos);
}

TEST(ModelFile, ReadsAnImageOnceWhateverItIsCalled) {
  const ModelOnDisk disk;
  disk.write("a.png", "x");
  disk.write("broken.png", "x");
  int reads = 0;
  const ImageReader reader = [&](const fs::path& file, std::size_t) -> Result<Texture> {
    ++reads;
    if (file.filename() == "broken.png") return Failure{"it is broken"};
    return Texture{2, 1, 3, {0, 1}, {}, ""};
  };
  std::string mtl;
  std::string obj = "mtllib m.mtl\nmtllib ./m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n";
  std::string ply = "ply\nformat ascii 1.0\n";
  std::string dots = "./";
  for (int i = 0; i < 20; ++i, dots += "./") {
    const std::string material = "m" + std::to_string(i);
    mtl += "newmtl " + material + "\nmap_Kd " + dots + (i % 2 ? "a.png\n" : "broken.png\n");
    obj += "usemtl " + material + "\nf 1 2 3\n";
    ply += "comment TextureFile " + dots + "broken.png\n";
  }
  disk.write("m.mtl", mtl);
  const Model model = load_model(disk.write("m.obj", obj), reader);
  EXPECT_EQ(reads, 2);
  EXPECT_EQ(model.mesh.textures.size(), 1u);
  reads = 0;
  load_model(
      disk.write("m.ply",
                 ply + "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement "
                       "face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 "
                       "0\n3 0 1 2\n"),
      reader);
  EXPECT_EQ(reads, 1);
}

TEST(ModelFile, RefusesWhatItCannotReadAndSaysWhatItIs) {
  const ModelOnDisk disk;
  EXPECT_NE(disk.refusal("m.glb", std::string("glTF\2\0\0\0", 8)).find("glTF"), std::string::npos);
  EXPECT_NE(disk.refusal("m.gltf", "{}").find("glTF"), std::string::npos);
  EXPECT_NE(disk.refusal("m.3mf", "PK\x03\x04").find("zip"), std::string::npos);
  EXPECT_NE(disk.refusal("m.xyz", "hello").find("what kind of model"), std::string::npos);
  EXPECT_NE(disk.refusal("m.wrl", "").find("the file is empty"), std::string::npos);
  EXPECT_THROW(load_model(disk.folder() / "nowhere.wrl", ModelOnDisk::fake_image), InputError);
  EXPECT_THROW(load_model(disk.folder() / "no/folder.wrl", ModelOnDisk::fake_image), InputError);
  EXPECT_THROW(load_model(disk.folder(), ModelOnDisk::fake_image), InputError);
}

TEST(ModelFile, NamesTheTexturesItTried) {
  const ModelOnDisk disk;
  const Model model = disk.load_vrml(
      "Shape { appearance Appearance { texture ImageTexture { url [ \"a.png\" \"../b.png\" ] } } geometry "
      "Box { } }");
  EXPECT_TRUE(warns(
      model, "model.wrl:2: the texture cannot be read (there is no such file); tried 'a.png', '../b.png'"));
  EXPECT_EQ(model.mesh.materials[0].texture, -1);
}

TEST(ModelFile, FindsTexturesUnderTheEndOfAForeignPath) {
  const ModelOnDisk disk;
  disk.write("maps/a b.png", "x");
  for (const char* url : {"maps/a b.png", "maps\\\\a b.png", "maps/a%20b.png",
                          "C:\\\\work\\\\maps\\\\a b.png", "/elsewhere/maps/a b.png", "file:maps/a b.png"}) {
    const Model model =
        disk.load_vrml(std::string("Shape { appearance Appearance { texture ImageTexture { url \"") + url +
                       "\" } } geometry Box { } }");
    EXPECT_EQ(model.mesh.textures.size(), 1u) << url;
    EXPECT_EQ(model.files.size(), 2u) << url;
  }
}

TEST(ModelFile, SharesTexturesAndCountsTheirPixels) {
  const ModelOnDisk disk;
  disk.write("a.png", "x");
  const std::string shape =
      "Shape { appearance Appearance { texture ImageTexture { url \"a.png\" } } geometry Box { } }\n";
  EXPECT_EQ(disk.load_vrml(shape + shape).mesh.textures.size(), 1u);
  std::vector<std::size_t> limits_seen;
  const auto reader = [&](const fs::path&, std::size_t limit) {
    limits_seen.push_back(limit);
    return Texture{2, 1, 3, {0, 1}, {}, ""};
  };
  disk.write("b.png", "x");
  ModelLimits limits;
  limits.image_pixels = 5;
  load_model(
      disk.write(
          "m.wrl",
          "#VRML V2.0 utf8\n" + shape +
              "Shape { appearance Appearance { texture ImageTexture { url \"b.png\" } } geometry Box { } }"),
      reader, limits);
  EXPECT_EQ(limits_seen, (std::vector<std::size_t>{5, 3}));
}

/// Facts about published models; HILBRUSH_TEST_MODELS names the folder they are in.
class RealModels : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("HILBRUSH_TEST_MODELS");
    if (!folder || !fs::is_directory(folder))
      GTEST_SKIP()
          << "HILBRUSH_TEST_MODELS does not name the folder of test models: real models are not tested";
    folder_ = folder;
  }
  Model load(const std::string& name) const { return load_model(folder_ / name, load_image_file); }
  static std::size_t count_of(const Model& model, ColorSource source) {
    std::size_t count = 0;
    for (const std::uint32_t m : model.mesh.material_index) count += model.mesh.materials[m].source == source;
    return count;
  }
  fs::path folder_;
};

TEST_F(RealModels, HoldWhatTheyAreKnownToHold) {
  const Model cow = load("facebookresearch+pytorch3d/docs/tutorials/data/cow_mesh/cow.obj");
  EXPECT_EQ(cow.mesh.triangle_count(), 5856u);
  EXPECT_EQ(count_of(cow, ColorSource::kTexture), 5856u);
  EXPECT_GT(signed_volume(cow.mesh), 0);
  const Model chest = load("jrl-umi3218+mc_openrtm/projects/JVRC1/model/JVRC1/chest.wrl");
  EXPECT_EQ(chest.mesh.triangle_count(), 1034u);
  EXPECT_EQ(chest.mesh.textures.size(), 2u);
  EXPECT_TRUE(chest.warnings.empty());
  EXPECT_GT(signed_volume(chest.mesh), 0);
  const Model house = load("choreonoid+choreonoid/share/model/house/house.wrl");
  EXPECT_EQ(house.mesh.textures.size(), 10u);
  EXPECT_GT(house.mesh.triangle_count(), 13'511u) << "that many are polygons, solids come on top";
  const Model belt = load("choreonoid+choreonoid/share/model/AizuSpider/resource/MAIN_BELT.wrl");
  EXPECT_EQ(belt.mesh.triangle_count(), 11'332u);
  EXPECT_EQ(count_of(belt, ColorSource::kColors), 11'332u);
  EXPECT_EQ(load("mrdoob+three.js/examples/models/vrml/pixelTexture.wrl").mesh.textures.size(), 4u);
  EXPECT_EQ(load("mrdoob+three.js/examples/models/vrml/elevationGrid2.wrl").mesh.triangle_count(), 40u);
  EXPECT_GT(load("mrdoob+three.js/examples/models/vrml/extrusion3.wrl").mesh.triangle_count(), 60u);
  EXPECT_EQ(load("bartmcleod+VrmlParser/wrl/comet-tempel.wrl").mesh.triangle_count(), 32'040u);
  EXPECT_EQ(load("isri-aist+hrp4c_description/vrml/HRP4Cmain.wrl").files.size(), 9u)
      << "the robot and the covers that are there";
  EXPECT_EQ(load("mikedh+trimesh/models/fuze.ply").mesh.textures.size(), 1u);
  EXPECT_EQ(load("mikedh+trimesh/models/featuretype.STL").mesh.triangle_count(), 3476u);
  EXPECT_EQ(load("odedstein+meshes/objects/nefertiti/nefertiti-lowres.obj").mesh.triangle_count(), 70'000u);
}

TEST_F(RealModels, AreReadOrRefusedWithAReason) {
  const std::set<std::string> endings{".wrl", ".WRL", ".obj", ".ply", ".off", ".stl", ".STL"};
  std::size_t read = 0;
  std::size_t refused = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    if (!endings.count(entry.path().extension().string())) continue;
    try {
      EXPECT_GT(load_model(entry.path(), ModelOnDisk::fake_image).mesh.triangle_count(), 0u) << entry.path();
      ++read;
    } catch (const InputError& error) {
      ++refused;
      EXPECT_EQ(error.at().find(entry.path().filename().string()), 0u) << error.what();
      EXPECT_GT(error.sentence().size(), 10u) << error.what();
    }
  }
  EXPECT_GT(read, 120u);
  EXPECT_LT(refused, 40u);
}

}  // namespace
}  // namespace hilbrush
