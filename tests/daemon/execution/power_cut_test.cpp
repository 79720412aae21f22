#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/execution/executor.h"
#include "daemon/execution/journal.h"
#include "sim/devices/sim_cell.h"
#include "tests/daemon/execution/program_fixture.h"

/// The journal on a disk whose power may be cut at any write, and which may then have kept any part of what
/// was not synced; and on one that is full or broken.
namespace hilbrush {
namespace {

constexpr std::size_t kPage = 4096;
const std::string kCutProgram(64, 'a');

struct PowerCut {};

/// What is on the disk, what only the system's memory holds, and when it ends.
struct Disk {
  std::vector<std::uint8_t> current, durable;
  std::set<std::size_t> dirty;  ///< pages that differ
  std::uint64_t operations = 0;
  std::uint64_t cut_at = ~std::uint64_t{0};      ///< the operation in which the power is cut
  std::uint64_t fails_from = ~std::uint64_t{0};  ///< operations that fail, as on a full disk
  std::uint64_t fails_until = ~std::uint64_t{0};

  explicit Disk(std::size_t bytes) : current(bytes), durable(bytes) {}

  void operate() {
    const auto now = operations++;
    if (now >= cut_at) throw PowerCut{};
    if (now >= fails_from && now < fails_until) throw std::runtime_error("journal: no space left on device");
  }

  /// Of each page that was not synced: the old, the new, one up to some byte and the other from there, or
  /// either in each sector.
  void cut_power(std::mt19937& random) {
    for (const std::size_t page : dirty) {
      const auto begin = page * kPage;
      const auto end = begin + kPage;
      const auto keep = [&](std::size_t from, std::size_t to) {
        std::copy(current.begin() + static_cast<std::ptrdiff_t>(from),
                  current.begin() + static_cast<std::ptrdiff_t>(to),
                  durable.begin() + static_cast<std::ptrdiff_t>(from));
      };
      const std::size_t tear = begin + random() % kPage;
      switch (random() % 5) {
        case 0:
          break;
        case 1:
          keep(begin, end);
          break;
        case 2:
          keep(begin, tear);
          break;
        case 3:
          keep(tear, end);
          break;
        default:
          for (std::size_t sector = begin; sector < end; sector += 512)
            if (random() % 2 == 0) keep(sector, sector + 512);
      }
    }
    current = durable;
    dirty.clear();
  }
};

class DiskStorage final : public JournalStorage {
 public:
  explicit DiskStorage(std::shared_ptr<Disk> disk) : disk_(std::move(disk)) {}
  std::size_t size() const override { return disk_->current.size(); }
  void read(std::size_t offset, std::span<std::uint8_t> bytes) const override {
    std::copy_n(disk_->current.begin() + static_cast<std::ptrdiff_t>(offset), bytes.size(), bytes.begin());
  }
  void write(std::size_t offset, std::span<const std::uint8_t> bytes) override {
    disk_->operate();
    std::copy(bytes.begin(), bytes.end(), disk_->current.begin() + static_cast<std::ptrdiff_t>(offset));
    for (std::size_t page = offset / kPage; page <= (offset + bytes.size() - 1) / kPage; ++page)
      disk_->dirty.insert(page);
  }
  void sync() override {
    disk_->operate();
    disk_->durable = disk_->current;
    disk_->dirty.clear();
  }

 private:
  std::shared_ptr<Disk> disk_;
};

/// The truth about a part, and everything that a journal is asked to keep of it.
class Part {
 public:
  Part(std::size_t count, unsigned seed)
      : count_(count),
        disk_(std::make_shared<Disk>(Journal::bytes_for(count))),
        random_(seed),
        light_(count) {
    const Journal journal = Journal::create(std::make_unique<DiskStorage>(disk_), count, kCutProgram,
                                            "boot 0");  // published: durable
  }

  /// Paints until the power is cut, the process killed or the end; true at the end.
  bool paint_some() {
    const bool is_cut = random_() % 4 != 0;
    const std::string boot = "boot " + std::to_string(boots_);
    disk_->operations = 0;
    disk_->cut_at = random_() % (is_cut ? 1500 : 3000);
    bool is_done = false;
    {
      std::optional<Journal> journal;
      try {
        journal.emplace(Journal::open(std::make_unique<DiskStorage>(disk_), kCutProgram, boot));
        is_done = paint(*journal);
      } catch (const PowerCut&) {
      }
      abandon(journal);
    }
    if (is_done) return true;
    if (is_cut) {
      disk_->cut_power(random_);
      ++boots_;
    }
    check(is_cut);
    return false;
  }
  std::size_t cuts() const { return boots_; }

 private:
  /// The destructor would still sync: the dead do not.
  void abandon(std::optional<Journal>& journal) {
    const Disk at_death = *disk_;
    disk_->cut_at = 0;
    try {
      journal.reset();
    } catch (const PowerCut&) {
    }
    *disk_ = at_death;
  }

  bool paint(Journal& journal) {
    doubts_before_ = journal.in_doubt().size();
    doubts_of_run_ = 0;
    if (random_() % 2 == 0)
      for (const std::size_t i : journal.in_doubt())
        if (random_() % 2 == 0) {
          ordered_.insert(i);  // before the journal knows: the order may be lost, never invented
          journal.expose_again(i);
        }
    for (std::size_t i = 0; i < count_; ++i) {
      if (journal.state(i) != ExposureState::kRemaining) continue;
      journal.open_window_for(i);
      journal.arm(i);
      EXPECT_TRUE(light_[i] == 0 || ordered_.contains(i)) << "dot " << i << " is exposed twice";
      ordered_.erase(i);
      ++light_[i];
      if (random_() % 100 == 0) {
        ++doubts_of_run_;
        journal.mark_in_doubt(i);
      } else {
        journal.done(i);
      }
    }
    journal.close_window();
    return journal.in_doubt().empty();
  }

  /// Looks at what is left, as the next life of the daemon would, on a copy.
  void check(bool is_cut) {
    const auto copy = std::make_shared<Disk>(*disk_);
    copy->cut_at = ~std::uint64_t{0};
    const Journal journal =
        Journal::open(std::make_unique<DiskStorage>(copy), kCutProgram, "boot " + std::to_string(boots_));
    for (std::size_t i = 0; i < count_; ++i) {
      const auto state = journal.state(i);
      if (light_[i] > 0 && !ordered_.contains(i)) {
        ASSERT_NE(state, ExposureState::kRemaining) << "dot " << i << " was exposed and is forgotten";
      }
      if (state == ExposureState::kDone) {
        ASSERT_GE(light_[i], 1) << "dot " << i << " was never exposed";
      }
    }
    // Those that were in doubt before, those that the run itself left in doubt, and one window.
    const std::size_t bound = is_cut ? Journal::kWindow : 1;
    ASSERT_LE(journal.in_doubt().size(), doubts_before_ + doubts_of_run_ + bound);
    doubts_before_ = journal.in_doubt().size();  // for a next life that dies before it has read them
    doubts_of_run_ = 0;
  }

  const std::size_t count_;
  std::shared_ptr<Disk> disk_;
  std::mt19937 random_;
  std::vector<int> light_;         ///< how often each dot was really exposed
  std::set<std::size_t> ordered_;  ///< in doubt, and ordered again
  std::size_t boots_ = 0;
  std::size_t doubts_before_ = 0;
  std::size_t doubts_of_run_ = 0;
};

TEST(PowerCutTest, WhateverTheDiskKeptNoDotIsExposedTwiceOrForgotten) {
  const char* is_long = std::getenv("HILBRUSH_LONG");
  const unsigned parts = is_long != nullptr ? 5000 : 60;
  std::size_t cuts = 0;
  for (unsigned seed = 1; seed <= parts && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Part part(1100, seed);
    int lives = 0;
    while (!part.paint_some() && ++lives < 500 && !::testing::Test::HasFailure()) {
    }
    EXPECT_LT(lives, 500) << "never finished";
    cuts += part.cuts();
  }
  EXPECT_GT(cuts, parts);
  RecordProperty("power_cuts", static_cast<int>(cuts));
}

/// The bound itself, without the noise of dots that a run leaves in doubt.
TEST(PowerCutTest, AtMostOneWindowIsInDoubt) {
  std::size_t most = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    constexpr std::size_t kCount = 1100;
    const auto disk = std::make_shared<Disk>(Journal::bytes_for(kCount));
    std::optional<Journal> journal(
        Journal::create(std::make_unique<DiskStorage>(disk), kCount, kCutProgram, "before"));
    disk->operations = 0;
    disk->cut_at = random() % 2200;
    std::size_t exposed = 0;
    try {
      for (std::size_t i = 0; i < kCount; ++i) {
        journal->arm(i);
        ++exposed;
        journal->done(i);
      }
    } catch (const PowerCut&) {
    }
    const Disk at_death = *disk;
    try {
      journal.reset();
    } catch (const PowerCut&) {
    }
    *disk = at_death;
    disk->cut_power(random);
    disk->cut_at = ~std::uint64_t{0};
    const Journal after = Journal::open(std::make_unique<DiskStorage>(disk), kCutProgram, "after");
    most = std::max(most, after.in_doubt().size());
    ASSERT_LE(after.in_doubt().size(), Journal::kWindow);
    for (std::size_t i = 0; i < exposed; ++i) ASSERT_NE(after.state(i), ExposureState::kRemaining) << i;
    for (std::size_t i = exposed; i < kCount; ++i) ASSERT_NE(after.state(i), ExposureState::kDone) << i;
  }
  EXPECT_GT(most, Journal::kWindow / 2) << "the cuts must come near the bound, or they show nothing";
}

/// A disk that is full, or fails, from any operation on: the run ends before the dot, and when there is room
/// again the job goes on where it was.
TEST(PowerCutTest, AFullDiskStopsTheJobBeforeTheDotNotInIt) {
  const CellDescription description = test::small_cell();
  const auto program = test::small_program(600);
  for (std::uint64_t operation = 0; operation < 1200; operation += operation < 20 ? 1 : 97) {
    SCOPED_TRACE("operation " + std::to_string(operation));
    SimCell sim(description, {.laser_start_delay_s = 0});
    std::size_t pulses = 0;
    std::size_t cut_pulses = 0;
    sim.set_emission_sink([&](const Emission& emission) {
      ++pulses;
      cut_pulses += emission.length_s < emission.commanded_s;
    });
    bring_up(sim.cell());
    const auto disk = std::make_shared<Disk>(Journal::bytes_for(600));
    Journal journal = Journal::create(std::make_unique<DiskStorage>(disk), 600, kCutProgram, "boot");
    disk->operations = 0;
    disk->fails_from = operation;
    ExecutionControl control;
    const auto full = execute(program, {}, sim.cell(), description, journal, control);
    EXPECT_EQ(full.outcome, ExecutionOutcome::kFailed);
    EXPECT_NE(full.reason.find("no space"), std::string::npos) << full.reason;
    EXPECT_EQ(cut_pulses, 0u);
    EXPECT_FALSE(sim.cell().laser.status().is_emitting);
    EXPECT_EQ(pulses, journal.done_count() + journal.in_doubt().size());
    EXPECT_LE(journal.in_doubt().size(), 1u) << "the dot whose done could not be written";

    disk->fails_from = ~std::uint64_t{0};
    Journal again = Journal::open(std::make_unique<DiskStorage>(disk), kCutProgram, "boot");
    const auto rest = execute(program, {}, sim.cell(), description, again, control);
    ASSERT_EQ(rest.outcome, ExecutionOutcome::kFinished) << rest.reason;
    EXPECT_EQ(again.done_count() + again.in_doubt().size(), 600u);
    EXPECT_EQ(pulses, 600u);
  }
}

}  // namespace
}  // namespace hilbrush
