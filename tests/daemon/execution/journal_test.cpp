#include "daemon/execution/journal.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include "sampling/base/check.h"
#include "tests/daemon/execution/program_fixture.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

const std::string kProgram(64, 'a');
constexpr std::size_t kHeaderBytes = 2 * 4096;

/// What the file system holds at this moment, as a process that was killed leaves it.
fs::path snapshot(const fs::path& journal) {
  const fs::path copy = journal.string() + ".snapshot";
  fs::copy_file(journal, copy, fs::copy_options::overwrite_existing);
  return copy;
}

void overwrite(const fs::path& file, std::size_t offset, const std::string& bytes) {
  std::fstream out(file, std::ios::binary | std::ios::in | std::ios::out);
  out.seekp(static_cast<std::streamoff>(offset));
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  ASSERT_TRUE(out.good());
}

void paint(Journal& journal, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; ++i) {
    journal.arm(i);
    journal.done(i);
  }
}

/// Where the records of exposures begin: after the header and the window table, each in whole pages.
std::size_t records_begin(std::size_t count) {
  const std::size_t windows = (count + Journal::kWindow - 1) / Journal::kWindow;
  return kHeaderBytes + (windows * 8 + 4095) / 4096 * 4096;
}

struct BrokenInvariant : std::logic_error {
  using std::logic_error::logic_error;
};
[[noreturn]] void throw_invariant(const std::string& message) {
  throw BrokenInvariant(message);
}

TEST(JournalTest, KeepsStatesInMemory) {
  Journal journal = Journal::in_memory(3);
  journal.arm(0);
  EXPECT_EQ(journal.state(0), ExposureState::kArmed);
  journal.done(0);
  journal.arm(2);
  journal.mark_in_doubt(2);
  EXPECT_EQ(journal.state(0), ExposureState::kDone);
  EXPECT_EQ(journal.state(1), ExposureState::kRemaining);
  EXPECT_EQ(journal.done_count(), 1u);
  EXPECT_EQ(journal.in_doubt(), std::vector<std::size_t>{2});
  journal.expose_again(2);
  EXPECT_EQ(journal.state(2), ExposureState::kRemaining);
}

TEST(JournalTest, SurvivesAnOrderlyEndAndAPowerCutAfterIt) {
  const TemporaryFolder folder;
  {
    Journal journal = Journal::create(folder / "journal", 1000, kProgram);
    paint(journal, 0, 300);
  }
  const Journal journal = Journal::open(folder / "journal", kProgram, "another boot");
  EXPECT_EQ(journal.done_count(), 300u);
  EXPECT_TRUE(journal.in_doubt().empty());
  EXPECT_EQ(journal.state(300), ExposureState::kRemaining);
}

TEST(JournalTest, AKilledProcessLeavesTheArmedExposureInDoubtAndNoOther) {
  const TemporaryFolder folder;
  Journal journal = Journal::create(folder / "journal", 1000, kProgram);
  paint(journal, 0, 300);
  journal.arm(300);
  const Journal reopened = Journal::open(snapshot(folder / "journal"), kProgram);
  EXPECT_EQ(reopened.done_count(), 300u);
  EXPECT_EQ(reopened.in_doubt(), std::vector<std::size_t>{300});
  EXPECT_EQ(reopened.state(301), ExposureState::kRemaining);
}

TEST(JournalTest, APowerCutLeavesTheOpenWindowInDoubtAndNoMore) {
  const TemporaryFolder folder;
  Journal journal = Journal::create(folder / "journal", 4 * Journal::kWindow, kProgram);
  paint(journal, 0, Journal::kWindow + 10);
  const Journal reopened = Journal::open(snapshot(folder / "journal"), kProgram, "another boot");
  EXPECT_EQ(reopened.done_count(), Journal::kWindow + 10);
  const auto doubts = reopened.in_doubt();
  ASSERT_EQ(doubts.size(), Journal::kWindow - 10);
  EXPECT_EQ(doubts.front(), Journal::kWindow + 10);
  EXPECT_EQ(doubts.back(), 2 * Journal::kWindow - 1);
  EXPECT_EQ(reopened.state(2 * Journal::kWindow), ExposureState::kRemaining);
}

/// The disk may hold nothing newer than the last sync: what was written when the window was opened.
TEST(JournalTest, NothingThatWasExposedIsEverRemainingOnTheDiskOfAPowerCut) {
  const TemporaryFolder folder;
  Journal journal = Journal::create(folder / "journal", 3 * Journal::kWindow, kProgram);
  paint(journal, 0, Journal::kWindow);
  journal.arm(Journal::kWindow);
  const fs::path at_last_sync = snapshot(folder / "journal");
  journal.done(Journal::kWindow);
  paint(journal, Journal::kWindow + 1, 2 * Journal::kWindow);
  const Journal reopened = Journal::open(at_last_sync, kProgram, "another boot");
  for (std::size_t i = 0; i < 2 * Journal::kWindow; ++i)
    ASSERT_NE(reopened.state(i), ExposureState::kRemaining) << i;
  EXPECT_EQ(reopened.in_doubt().size(), Journal::kWindow);
}

TEST(JournalTest, DoubtsOutliveReopeningAndCanBeExposedAgainOnce) {
  const TemporaryFolder folder;
  {
    Journal journal = Journal::create(folder / "journal", 10, kProgram);
    paint(journal, 0, 3);
    journal.arm(3);
    journal.mark_in_doubt(3);
    paint(journal, 4, 6);
  }
  {
    Journal journal = Journal::open(folder / "journal", kProgram);
    ASSERT_EQ(journal.in_doubt(), std::vector<std::size_t>{3});
    journal.expose_again(3);
    paint(journal, 3, 4);
  }
  const Journal journal = Journal::open(folder / "journal", kProgram, "another boot");
  EXPECT_EQ(journal.done_count(), 6u);
  EXPECT_TRUE(journal.in_doubt().empty());
}

TEST(JournalTest, DamagedRecordsAreInDoubtNeverRemaining) {
  constexpr std::size_t kCount = 5000;
  const TemporaryFolder folder;
  std::mt19937 random(20);
  for (int round = 0; round < 20; ++round) {
    const fs::path file = folder / ("journal" + std::to_string(round));
    {
      Journal journal = Journal::create(file, kCount, kProgram);
      paint(journal, 0, 2500);
    }
    const std::size_t victim = random() % kCount;
    std::string garbage(8, '\0');
    if (round % 2 == 1)
      for (char& byte : garbage) byte = static_cast<char>(random());
    overwrite(file, records_begin(kCount) + 8 * victim, garbage);
    const Journal journal = Journal::open(file, kProgram);
    EXPECT_EQ(journal.in_doubt(), std::vector<std::size_t>{victim}) << "round " << round;
  }
}

TEST(JournalTest, APageOfZeroesIsInDoubt) {
  constexpr std::size_t kCount = 5000;
  const TemporaryFolder folder;
  {
    Journal journal = Journal::create(folder / "journal", kCount, kProgram);
    paint(journal, 0, 100);
  }
  overwrite(folder / "journal", records_begin(kCount) + 4096, std::string(4096, '\0'));
  const Journal journal = Journal::open(folder / "journal", kProgram);
  EXPECT_EQ(journal.done_count(), 100u);
  EXPECT_EQ(journal.in_doubt().size(), 512u);
  EXPECT_EQ(journal.in_doubt().front(), 512u);
}

TEST(JournalTest, ARecordInAnotherPlaceIsDamage) {
  constexpr std::size_t kCount = 100;
  const TemporaryFolder folder;
  { const Journal journal = Journal::create(folder / "journal", kCount, kProgram); }
  std::string record(8, '\0');
  std::ifstream in(folder / "journal", std::ios::binary);
  in.seekg(static_cast<std::streamoff>(records_begin(kCount)));
  in.read(record.data(), 8);
  overwrite(folder / "journal", records_begin(kCount) + 8 * 7, record);
  const Journal journal = Journal::open(folder / "journal", kProgram);
  EXPECT_EQ(journal.in_doubt(), std::vector<std::size_t>{7});
}

TEST(JournalTest, RefusesWhatIsNotItsOwn) {
  const TemporaryFolder folder;
  const fs::path file = folder / "journal";
  { const Journal journal = Journal::create(file, 1000, kProgram); }
  EXPECT_THROW(Journal::create(file, 1000, kProgram), std::runtime_error) << "exists already";
  EXPECT_THROW(Journal::open(file, std::string(64, 'b')), std::runtime_error) << "another program";
  EXPECT_THROW(Journal::open(folder / "absent", kProgram), std::runtime_error);

  for (std::size_t offset : {0u, 9u, 17u, 30u, 90u}) {  // magic, version, count, program, checksum
    fs::copy_file(file, folder / "damaged", fs::copy_options::overwrite_existing);
    overwrite(folder / "damaged", offset, "\x7f");
    EXPECT_THROW(Journal::open(folder / "damaged", kProgram), std::runtime_error) << "byte " << offset;
  }
  for (std::uintmax_t size : {0u, 100u, 4096u, 8192u}) {
    fs::copy_file(file, folder / "short", fs::copy_options::overwrite_existing);
    fs::resize_file(folder / "short", size);
    EXPECT_THROW(Journal::open(folder / "short", kProgram), std::runtime_error) << size << " bytes";
  }
}

TEST(JournalTest, IsHeldByOneAtATime) {
  const TemporaryFolder folder;
  const Journal journal = Journal::create(folder / "journal", 10, kProgram);
  EXPECT_THROW(Journal::open(folder / "journal", kProgram), std::runtime_error);
}

TEST(JournalTest, AFullDiskIsFoundBeforeTheFirstDot) {
  const TemporaryFolder folder;
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1 << 16;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(Journal::create(folder / "journal", 1000000, kProgram), std::runtime_error);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  ::signal(SIGXFSZ, handler);
  EXPECT_TRUE(fs::is_empty(folder.path())) << "nothing half made stays behind";
}

TEST(JournalTest, NoExposureIsArmedTwice) {
  const CheckHandler before = set_check_handler(throw_invariant);
  Journal journal = Journal::in_memory(3);
  paint(journal, 0, 1);
  EXPECT_THROW(journal.arm(0), BrokenInvariant);
  journal.arm(1);
  EXPECT_THROW(journal.arm(1), BrokenInvariant);
  EXPECT_THROW(journal.done(2), BrokenInvariant);
  EXPECT_THROW(journal.expose_again(0), BrokenInvariant);
  EXPECT_THROW(journal.arm(3), BrokenInvariant);
  set_check_handler(before);
}

}  // namespace
}  // namespace hilbrush
