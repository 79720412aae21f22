#include "daemon/server/cell_thread.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "drivers/driver_error.h"
#include "planner/cell_model/program_file.h"
#include "sampling/base/check.h"
#include "sampling/base/sha256.h"

namespace hilbrush {
namespace {

using Steady = std::chrono::steady_clock;

constexpr auto kProgressInterval = std::chrono::milliseconds(100);
constexpr double kAtRest = 1e-6;  ///< rad or m: the axes are still where the approach begins

/// The job's own files are at fault.
struct JobFilesFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The job is to be painted by a daemon with another cell.
struct OtherCellFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::string program_sha256(const std::filesystem::path& file) {
  Sha256 hash;
  if (!hash.update_from_file(file)) throw JobFilesFault(file.string() + ": cannot be read");
  return hash.hex_digest();
}

/// What the job needs to go on after a power cut - program, model, its row in the store - is durable before
/// its first dot.
void sync_file_system(const std::filesystem::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool is_synced = fd >= 0 && ::syncfs(fd) == 0;
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (!is_synced)
    throw std::runtime_error(folder.string() + ": cannot be synced to disk: " + std::strerror(error));
}

void check_provenance(const Provenance& found, const PaintOrder& order, const CellDescription& description) {
  const Provenance wanted{order.model_sha256, order.settings_sha256, description.sha256, HILBRUSH_VERSION};
  if (found.cell_sha256 != wanted.cell_sha256)
    throw OtherCellFault("the program was made for another cell than \"" + description.name +
                         "\" as its file is now: start the daemon with the cell file that it was made for");
  const std::string mismatch = provenance_mismatch(found, wanted);
  if (!mismatch.empty())
    throw JobFilesFault("the program was made for " + mismatch + "; a program is never run on another model");
  if (found.version != wanted.version)
    throw JobFilesFault("the program was made by version " + found.version + " of hilbrush, and this is " +
                        wanted.version + ": submit the model again");
}

}  // namespace

std::filesystem::path copy_file(const PaintOrder& order, const char* stem, const char* extension) {
  const std::string number = order.copy > 1 ? "-" + std::to_string(order.copy) : "";
  return order.folder / (stem + number + extension);
}

CellThread::CellThread(CellDevices& devices, const CellDescription& description, PostToSocketThread post)
    : devices_(devices), cell_(devices.cell()), description_(description), post_(std::move(post)) {
  control_.stop.store(true);  // the cell starts stopped
  thread_ = std::thread([this] { run(); });
  stop_thread_ = std::thread([this] { carry_out_stops(); });
}

CellThread::~CellThread() {
  stop_now();
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    tasks_.clear();
  }
  woken_.notify_all();
  thread_.join();
  stop_thread_.join();
}

bool CellThread::stop_now() noexcept {
  return request_stop(cell_, control_);
}

void CellThread::stop(std::function<void(bool)> on_end) {
  control_.stop.store(true);
  ++orders_under_way_;
  {
    const std::lock_guard lock(mutex_);
    stops_.push_back(std::move(on_end));
  }
  woken_.notify_all();
}

/// Stops that were ordered meanwhile are carried out together. A command that the executor was about to send
/// when the stop came (a reference run may take a minute) is stopped again, until the executor is at rest.
void CellThread::carry_out_stops() {
  for (;;) {
    std::vector<std::function<void(bool)>> ordered;
    {
      std::unique_lock lock(mutex_);
      woken_.wait(lock, [this] { return is_ending_ || !stops_.empty(); });
      if (is_ending_) return;
      ordered.swap(stops_);
    }
    const bool is_off = stop_now();
    for (auto& on_end : ordered)
      post_([this, is_off, on_end = std::move(on_end)] {
        --orders_under_way_;
        on_end(is_off);
      });
    constexpr auto kAgain = std::chrono::milliseconds(20);
    std::unique_lock lock(mutex_);
    while (is_working_ && !woken_.wait_for(lock, kAgain, [this] { return is_ending_ || !stops_.empty(); })) {
      lock.unlock();
      if (is_stop_latched()) stop_now();
      lock.lock();
    }
  }
}

void CellThread::push(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    CHECK_LT(tasks_.size(),
             kQueueMax);  // acts wait for each other's answers, so only a few can ever be under way
    tasks_.push_back(std::move(task));
  }
  woken_.notify_all();
}

void CellThread::run() {
  for (;;) {
    std::function<void()> task;
    {
      std::unique_lock lock(mutex_);
      woken_.wait(lock, [this] { return is_ending_ || !tasks_.empty(); });
      if (is_ending_) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
      is_working_ = true;
    }
    task();
    const std::lock_guard lock(mutex_);
    is_working_ = false;
  }
}

/// Does `work` on the executor's thread and calls `answer` with its result on the socket thread.
template <class Work, class Answer>
void CellThread::order(Work work, Answer answer) {
  ++orders_under_way_;
  push([this, work = std::move(work), answer = std::move(answer)]() mutable {
    auto result = std::make_shared<decltype(work())>(work());
    post_([this, result, answer = std::move(answer)]() mutable {
      --orders_under_way_;
      answer(std::move(*result));
    });
  });
}

void CellThread::act(std::function<void()> work, OnActEnd on_end) {
  order(
      [work = std::move(work)]() -> std::optional<CellFault> {
        try {
          work();
          return std::nullopt;
        } catch (const std::exception& error) {
          return CellFault{error.what()};
        }
      },
      std::move(on_end));
}

/// Called between any two steps of an act that a stop may overtake.
void CellThread::check_stop() const {
  if (control_.stop.load()) throw DriverError("the cell was stopped");
}

void CellThread::clear(OnActEnd on_end) {
  act([this] { clear_devices(); }, std::move(on_end));
}

void CellThread::clear_devices() {
  const auto bring_back = [this](auto& device) {
    check_stop();
    if (device.status().state == DeviceState::kFault) device.clear_fault();
    check_stop();
    if (device.status().state == DeviceState::kDisconnected) device.connect();
  };
  bring_back(cell_.laser);
  if (!cell_.laser.off()) throw DriverError("the laser does not confirm that it is off");
  bring_back(cell_.robot);
  bring_back(cell_.table);
  const auto enable = [this](auto& axes) {
    check_stop();
    if (axes.status().state == DeviceState::kConnected) axes.enable();
  };
  enable(cell_.robot);
  enable(cell_.table);
}

void CellThread::arm(OnActEnd on_end) {
  act([this] { arm_devices(); }, std::move(on_end));
}

/// Of the axes that have lost theirs.
void CellThread::find_references() {
  const auto home = [this](auto& axes) {
    check_stop();
    if (axes.status().state == DeviceState::kEnabled) axes.home();
  };
  home(cell_.robot);
  home(cell_.table);
  check_stop();
}

/// A stop may come at any instant of this: its flag is checked after emission has been armed, so that one of
/// the two always undoes it.
void CellThread::arm_devices() {
  find_references();
  if (cell_.laser.status().state == DeviceState::kConnected) cell_.laser.enable();
  if (control_.stop.load()) cell_.laser.disable();
  check_stop();
  const auto check_ready = [](const char* name, const auto& status) {
    if (status.state == DeviceState::kReady) return;
    throw DriverError(std::string("the ") + name + " is not ready but " + device_state_name(status.state) +
                      (status.fault.empty() ? "" : ": " + status.fault));
  };
  check_ready("robot", cell_.robot.status());
  check_ready("table", cell_.table.status());
  check_ready("laser", cell_.laser.status());
}

void CellThread::home(OnActEnd on_end) {
  act([this] { travel_home(); }, std::move(on_end));
}

void CellThread::travel_home() {
  find_references();
  Joints up = true_joints();
  up[kJ3] = std::max(up[kJ3], description_.axes[kJ3].home);
  Joints table = up;
  table[kTilt] = description_.axes[kTilt].home;
  table[kRotation] = description_.axes[kRotation].home;
  Joints home;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) home[axis] = description_.axes[axis].home;
  const ExecutionResult result = travel({up, table, home}, cell_, description_, control_);
  if (result.outcome != ExecutionOutcome::kFinished) throw DriverError(result.reason);
}

void CellThread::disarm() {
  push([this] { cell_.laser.disable(); });
}

Joints CellThread::true_joints() const {
  const auto robot = cell_.robot.status().positions;
  const auto table = cell_.table.status().positions;
  return {robot[0], robot[1], robot[2], robot[3], table[0], table[1]};
}

CellThread::Loaded CellThread::load(const PaintOrder& order) const {
  const auto program_file = order.folder / "program.ply";
  const auto journal_file = copy_file(order, "journal", "");
  ExposureProgram program;
  try {
    program = read_program(program_file);
  } catch (const ProgramFileError& error) {
    throw JobFilesFault(error.what());
  }
  check_provenance(program.provenance, order, description_);
  const std::string sha256 = program_sha256(program_file);
  // A damaged journal may be repaired; the job stays resumable.
  const bool is_new = !std::filesystem::exists(journal_file);
  if (is_new && !order.may_create_journal)
    throw std::runtime_error(
        journal_file.string() +
        ": the journal is missing, so it is unknown what was exposed: this part cannot be finished; "
        "cancel the job and submit it again for a new part");
  if (is_new) sync_file_system(order.folder);
  Journal journal = is_new ? Journal::create(journal_file, program.exposures.size(), sha256)
                           : Journal::open(journal_file, sha256);
  if (journal.exposure_count() != program.exposures.size())
    throw JobFilesFault("the journal does not fit the program");
  return {std::move(program), std::move(journal), {}};
}

PaintTally CellThread::tally(const Loaded& loaded) {
  PaintTally tally;
  tally.exposed = loaded.journal.done_count();
  for (const std::size_t i : loaded.journal.in_doubt())
    tally.in_doubt.push_back(loaded.program.exposures[i].dot_index);
  return tally;
}

void CellThread::prepare(PaintOrder wanted, std::function<void(Prepared)> on_end) {
  order(
      [this, wanted = std::move(wanted)]() -> Prepared {
        Prepared prepared;
        try {
          loaded_.reset();
          loaded_.emplace(load(wanted));
          Journal& journal = loaded_->journal;
          if (wanted.exposes_in_doubt)
            for (const std::size_t i : journal.in_doubt()) journal.expose_again(i);
          for (std::size_t i = 0; i < journal.exposure_count() && !prepared.next; ++i)
            if (journal.state(i) == ExposureState::kRemaining) prepared.next = i;
          devices_.record_emissions(copy_file(wanted, "emissions", ".ply"));
          prepared.tally = tally(*loaded_);
          prepared.from = loaded_->from = true_joints();
        } catch (const std::exception& error) {
          loaded_.reset();
          prepared.fault = CellFault{error.what(), dynamic_cast<const JobFilesFault*>(&error) != nullptr,
                                     dynamic_cast<const OtherCellFault*>(&error) != nullptr};
        }
        return prepared;
      },
      std::move(on_end));
}

void CellThread::paint(std::vector<Joints> approach, std::function<void(std::size_t)> on_progress,
                       std::function<void(ExecutionResult, PaintTally)> on_end) {
  using Painted = std::pair<ExecutionResult, PaintTally>;
  order(
      [this, approach = std::move(approach), on_progress = std::move(on_progress)]() -> Painted {
        CHECK(loaded_.has_value());
        ExecutionResult result;
        const Joints now = true_joints();
        const bool is_at_rest = std::equal(now.begin(), now.end(), loaded_->from.begin(),
                                           [](double a, double b) { return std::abs(a - b) <= kAtRest; });
        if (is_at_rest) {
          auto last_report = Steady::now();
          result = execute(loaded_->program, approach, cell_, description_, loaded_->journal, control_,
                           [&](std::size_t exposed) {
                             const auto time = Steady::now();
                             if (time - last_report < kProgressInterval) return;
                             last_report = time;
                             post_([on_progress, exposed] { on_progress(exposed); });
                           });
        } else {
          result.outcome = ExecutionOutcome::kFailed;
          result.reason = "the axes moved while the approach was planned";
        }
        try {
          loaded_->journal.close_window();
          devices_.record_emissions({});
        } catch (const std::exception& error) {
          result.outcome = ExecutionOutcome::kFailed;
          result.reason = error.what();
        }
        Painted painted{result, tally(*loaded_)};
        loaded_.reset();
        return painted;
      },
      [on_end = std::move(on_end)](Painted painted) {
        on_end(std::move(painted.first), std::move(painted.second));
      });
}

void CellThread::release() {
  push([this] {
    loaded_.reset();
    try {
      devices_.record_emissions({});
    } catch (const std::exception&) {  // closing a record cannot fail in a way that matters here
    }
  });
}

void CellThread::inspect(PaintOrder wanted, std::function<void(std::optional<PaintTally>)> on_end) {
  order(
      [this, wanted = std::move(wanted)]() -> std::optional<PaintTally> {
        try {
          return tally(load(wanted));
        } catch (const std::exception&) {
          return std::nullopt;
        }
      },
      std::move(on_end));
}

}  // namespace hilbrush
