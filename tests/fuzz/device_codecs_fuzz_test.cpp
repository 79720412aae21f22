#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/fuzz/campaign.h"
#include "tests/fuzz/device_codecs.h"
#include "tests/fuzz/mutator.h"

/// Seeded mutants of what devices send. HILBRUSH_FUZZ_INPUTS is their number, HILBRUSH_FUZZ_SEED the first
/// seed.
namespace hilbrush {
namespace {

using test::CrashReports;
using test::current_seed;
using test::number_from_environment;

std::vector<std::string> corpus() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(HILBRUSH_SOURCE_DIR) + "/tests/fuzz/corpus/devices"))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<std::string> inputs;
  for (const auto& file : files) {
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream bytes;
    bytes << stream.rdbuf();
    inputs.push_back(bytes.str());
  }
  return inputs;
}

TEST(DeviceCodecsFuzz, MutantsOfTranscriptsAreReadOrRefused) {
  const std::vector<std::string> inputs = corpus();
  ASSERT_GE(inputs.size(), 10u);
  for (const std::string& input : inputs) decode_as_every_device(input);
  const std::uint64_t count = number_from_environment("HILBRUSH_FUZZ_INPUTS", 20000);
  const std::uint64_t first = number_from_environment("HILBRUSH_FUZZ_SEED", 1);
  const CrashReports crash_reports;
  Mutator mutator(inputs);
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    current_seed = seed;
    // Short is enough: the corpus and joined pieces of it exceed the readers' own limits.
    decode_as_every_device(mutator.mutate(inputs[seed % inputs.size()], seed).substr(0, 1 << 14));
  }
}

}  // namespace
}  // namespace hilbrush
