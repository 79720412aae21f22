#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <fstream>

#include "sampling/base/input_error.h"
#include "sampling/images/image_file.h"
#include "sampling/model/model_file.h"
#include "tests/fuzz/campaign.h"
#include "tests/fuzz/mutator.h"
#include "tests/fuzz/opened_files.h"
#include "tests/fuzz/playground.h"

/// Seeded mutants of the corpus, read as an operator's files would be. None may crash, take more than 5 s,
/// need more than 1 GB, or make the readers open a file outside the model's folder. HILBRUSH_FUZZ_INPUTS is
/// the number of mutants, HILBRUSH_FUZZ_SEED the first seed.
namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using test::CrashReports;
using test::current_seed;
using test::number_from_environment;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

using Clock = std::chrono::steady_clock;

/// Processor time: nothing here waits, so it is what an operator would wait on an idle machine, even on a
/// busy one.
double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0) return std::strtod(line.c_str() + 6, nullptr) / 1024;
  return 0;
}

bool is_below(const fs::path& file, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first == folder.end();
}

/// Runs `read` on mutants until the count or, without one asked for, the time of a slice is used up.
template <class Read>
void run_campaign(const std::map<std::string, std::string>& seeds, double slice_s, const Read& read) {
  const CrashReports crash_reports;
  const std::uint64_t wanted = number_from_environment("HILBRUSH_FUZZ_INPUTS", 0);
  const std::uint64_t first_seed = number_from_environment("HILBRUSH_FUZZ_SEED", 1);
  std::vector<std::string> donors;
  for (const auto& [name, bytes] : seeds) donors.push_back(bytes);
  Mutator mutator(donors);
  const auto start = Clock::now();
  double slowest_s = 0;
  std::uint64_t count = 0;
  std::uint64_t slowest_seed = 0;
  for (;; ++count) {
    if (wanted ? count >= wanted
               : count >= 2000 || std::chrono::duration<double>(Clock::now() - start).count() > slice_s)
      break;
    const std::uint64_t seed = first_seed + count;
    current_seed = seed;
    auto pick = seeds.begin();
    std::advance(pick, static_cast<std::ptrdiff_t>(seed % seeds.size()));
    const std::string mutant = mutator.mutate(pick->second, seed);
    alarm(kIsSanitized ? 600 : 120);  // a reader that sleeps forever is killed, and its seed printed
    const double begin_s = cpu_s();
    read("mutant" + fs::path(pick->first).extension().string(), mutant, seed);
    const double took_s = cpu_s() - begin_s;
    alarm(0);
    if (took_s > slowest_s) {
      slowest_s = took_s;
      slowest_seed = seed;
    }
    ASSERT_LT(took_s, kIsSanitized ? 30 : 5) << "seed " << seed << " from " << pick->first;
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_TRUE(kIsSanitized || peak_memory_mb() < 1024) << peak_memory_mb() << " MB";
  std::printf("%llu mutants from seed %llu; slowest %.2f s (seed %llu), peak memory %.0f MB\n",
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(first_seed), slowest_s,
              static_cast<unsigned long long>(slowest_seed), peak_memory_mb());
  EXPECT_GT(count, 0u);
}

/// Checks what every later stage relies on.
void expect_sound(const TexturedMesh& mesh, std::uint64_t seed) {
  const std::size_t count = mesh.triangle_count();
  ASSERT_GT(count, 0u) << "seed " << seed;
  ASSERT_EQ(mesh.corner_uv.size(), count);
  ASSERT_EQ(mesh.corner_luminance.size(), count);
  ASSERT_EQ(mesh.material_index.size(), count);
  for (std::size_t t = 0; t < count; ++t) {
    const Material& material = mesh.materials.at(mesh.material_index[t]);
    ASSERT_LT(material.texture, static_cast<int>(mesh.textures.size())) << "seed " << seed;
    ASSERT_TRUE(material.opacity >= 0 && material.opacity <= 1) << "seed " << seed;
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_LT(mesh.triangles[t][c], mesh.vertices.size()) << "seed " << seed;
      ASSERT_TRUE(mesh.vertices[mesh.triangles[t][c]].allFinite()) << "seed " << seed;
      ASSERT_TRUE(mesh.corner_uv[t][c].allFinite()) << "seed " << seed;
      ASSERT_TRUE(mesh.corner_luminance[t][c] >= 0 && mesh.corner_luminance[t][c] <= 1) << "seed " << seed;
    }
  }
}

TEST(ModelFuzz, MutatedModelsNeitherCrashNorHangNorReadOutsideTheirFolder) {
  const Playground playground;
  (void)load_image_file(playground.folder() / "gradient.png",
                        1 << 20);  // so that OpenImageIO opens its own files now
  std::size_t read_count = 0;
  run_campaign(
      playground.models(), 25, [&](const std::string& name, const std::string& mutant, std::uint64_t seed) {
        const fs::path file = playground.write(name, mutant);
        const ImageReader reader = [&](const fs::path& image, std::size_t limit) {
          EXPECT_TRUE(is_below(fs::canonical(image), playground.folder())) << image << " seed " << seed;
          return load_image_file(image, limit);
        };
        std::vector<std::string> opened;
        try {
          const OpenedFiles watcher;
          const auto note_names = [&] { opened = watcher.names(); };
          try {
            const Model model = load_model(file, reader);
            note_names();
            expect_sound(model.mesh, seed);
            ++read_count;
            for (const fs::path& used : model.files)
              EXPECT_TRUE(is_below(fs::canonical(used), playground.folder())) << used << " seed " << seed;
          } catch (const InputError&) {
            note_names();
            throw;
          }
        } catch (const InputError& error) {
          EXPECT_FALSE(error.sentence().empty());
        }
        EXPECT_FALSE(opened.empty()) << "the watcher saw nothing";
        for (const std::string& used : opened) {
          std::error_code ignored;
          const fs::path real = fs::canonical(used, ignored);
          EXPECT_TRUE(ignored || is_below(real, playground.folder())) << used << " seed " << seed;
        }
      });
  EXPECT_GT(read_count, 0u);
}

TEST(ModelFuzz, TheCorpusItselfIsRead) {
  const Playground playground;
  for (const auto& [name, bytes] : playground.models()) {
    if (fs::path(name).extension() == ".mtl") continue;
    EXPECT_NO_THROW(expect_sound(load_model(playground.folder() / name, load_image_file).mesh, 0)) << name;
  }
}

TEST(ImageFuzz, MutatedImagesNeitherCrashNorHang) {
  const Playground playground;
  run_campaign(
      playground.images(), 10, [&](const std::string& name, const std::string& mutant, std::uint64_t seed) {
        const auto texture = load_image_file(playground.write(name, mutant), 1 << 22);
        if (!texture) {
          EXPECT_FALSE(texture.reason().empty()) << "seed " << seed;
          return;
        }
        ASSERT_EQ(texture->luminance.size(),
                  static_cast<std::size_t>(texture->width) * static_cast<std::size_t>(texture->height))
            << "seed " << seed;
        for (const float value : texture->luminance)
          ASSERT_TRUE(value >= 0 && value <= 1.0001f) << "seed " << seed;
      });
}

}  // namespace
}  // namespace hilbrush
