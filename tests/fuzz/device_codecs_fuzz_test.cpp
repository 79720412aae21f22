#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/fuzz/device_codecs.h"
#include "tests/fuzz/mutator.h"

/// Seeded mutants of what devices say. HILBRUSH_FUZZ_INPUTS runs so many, HILBRUSH_FUZZ_SEED sets where they start.
namespace hilbrush {
namespace {

volatile std::uint64_t current_seed = 0;

void report_crash(int signal) {
  std::fprintf(stderr, "signal %d on the mutant of seed %llu\n", signal, static_cast<unsigned long long>(current_seed));
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

std::uint64_t number_from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

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
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT}) std::signal(signal, report_crash);
  Mutator mutator(inputs);
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    current_seed = seed;
    // Short: the readers' own limits are met by the corpus and by joining pieces of it.
    decode_as_every_device(mutator.mutate(inputs[seed % inputs.size()], seed).substr(0, 1 << 14));
  }
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT}) std::signal(signal, SIG_DFL);
}

}  // namespace
}  // namespace hilbrush
